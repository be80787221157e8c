"""What places see, as runs along rows: against lines of sight to every node."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.geometry.edge_index import build_edge_index, point_is_free
from sightfield.systems.numerics.geometry.segment_sight import are_clear
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.tracking.visibility_game.bounds import NO_CORNERS, NO_SPOTS
from sightfield.systems.numerics.tracking.visibility_game.ground import NO_WALL_PLACES
from sightfield.systems.numerics.tracking.visibility_game.lattice import Lattice, free_nodes
from sightfield.systems.numerics.tracking.visibility_game.near_sight import see_runs_from_near
from sightfield.systems.numerics.tracking.visibility_game.planes import TILE
from sightfield.systems.numerics.tracking.visibility_game.sight_rows import (
    fill_tiles,
    lay_out,
    see_runs,
)


def pillar(x, y):
    return [(x, y), (x + 0.011, y + 0.003), (x + 0.004, y + 0.013)]


WORLDS = {
    # Nodes lie on its walls, and rows run through its corners.
    "box": make_world([(0, 0), (4, 0), (4, 3), (0, 3)], [[(1, 1), (2, 1), (2, 2), (1, 2)]]),
    "turned": make_world(
        [(0.1, 0.0), (4.0, 0.7), (3.6, 2.9), (2.1, 2.6), (2.0, 1.7), (0.0, 2.4)],
        [[(0.9, 0.8), (1.5, 0.7), (1.2, 1.5)]],
    ),
    # Through its pillars a row is seen in more pieces than are counted.
    "pillars": make_world(
        [(0, 0), (4, 0), (4, 3), (0, 3)], [pillar(0.2 + 0.036 * k, 1.07) for k in range(100)]
    ),
}
GRIDS = {
    "box": Lattice(-0.25, -0.25, 0.125, 30, 36),
    "turned": Lattice(-0.21, -0.17, 0.119, 29, 38),
    "pillars": Lattice(0.013, 0.017, 0.091, 33, 44),
}


def raster(runs, begin, end, shape):
    """Runs as a plane."""
    seen = np.zeros(shape, dtype=bool)
    for row, first, last in runs[begin:end]:
        assert first < last
        assert not seen[row, first:last].any()
        seen[row, first:last] = True
    return seen


@pytest.mark.parametrize("sight_range", [math.inf, 1.25])
@pytest.mark.parametrize("name", WORLDS)
def test_places_see_what_lines_of_sight_reach(name, sight_range):
    world, grid, rng = WORLDS[name], GRIDS[name], np.random.default_rng(3)
    index = build_edge_index(world)
    free = free_nodes(grid, index)
    places = rng.uniform(world.bounds[:2] - 0.1, world.bounds[2:] + 0.1, (14, 2))
    # One at a node, one on a wall if nodes are there, and one before the pillars.
    places[:3] = grid.at(9, 7), grid.at(2, 20), (2.0, 0.3)
    windows, runs, ends, sighted = see_runs(
        index,
        places,
        tuple(grid),
        free,
        *NO_SPOTS,
        NO_WALL_PLACES,
        NO_CORNERS,
        sight_range,
        0.3,
        0.0,
        0.0,
    )
    slots, tiles = lay_out(windows, runs, ends)
    filled = np.zeros((tiles, TILE * TILE), dtype=np.uint8)
    fill_tiles(windows, slots, runs, ends, filled, 7)
    points, begin, used = grid.points.reshape(-1, 2), 0, 0
    for p, place in enumerate(places):
        expected = np.zeros(free.size, dtype=bool)
        if point_is_free(index, *place):
            near = np.hypot(*(points - place).T) <= sight_range * (1 + 1e-9)
            expected = are_clear(index, np.tile(place, (len(points), 1)), points) & near
        expected = expected.reshape(free.shape) & free
        seen = raster(runs, begin, ends[p], free.shape)
        np.testing.assert_array_equal(seen, expected)
        assert sighted[p] == expected.sum()
        begin = ends[p]
        # The window is as small as can be, and its tiles hold the same.
        row, column, rows, columns, slot = windows[p]
        if expected.any():
            whole = [np.unique(each // TILE) for each in np.nonzero(expected)]
            assert [row, column] == [each[0] for each in whole]
            assert [rows, columns] == [each[-1] - each[0] + 1 for each in whole]
        else:
            assert rows * columns == 0
        padded = np.pad(expected, ((0, TILE), (0, TILE)))
        for r in range(rows):
            for c in range(columns):
                at = (row + r) * TILE, (column + c) * TILE
                tile = padded[at[0] : at[0] + TILE, at[1] : at[1] + TILE]
                number = slots[slot + r * columns + c]
                assert (number >= 0) == tile.any()
                if number >= 0:
                    kept = np.zeros((TILE, TILE), dtype=bool)
                    kept[: tile.shape[0], : tile.shape[1]] = tile
                    np.testing.assert_array_equal(filled[number].reshape(TILE, TILE), 7 * kept)
                    used += 1
    assert used == tiles > 0


@pytest.mark.parametrize("name", ["box", "turned"])
def test_who_is_seen_from_near_a_node_is_seen_from_some_place_there(name):
    world, slack = WORLDS[name], 0.17
    index, fine = build_edge_index(world), GRIDS[name]
    coarse = Lattice(-0.33, -0.29, 0.41, 9, 11)
    free = free_nodes(fine, index)
    numbers = np.arange(99).reshape(9, 11)
    numbers[3, 4] = -1
    numbers[numbers >= 0] = np.arange(98)
    windows, runs, ends = see_runs_from_near(
        index, numbers, tuple(coarse), tuple(fine), free, slack, 2
    )
    angles = np.linspace(0, 2 * np.pi, 48, endpoint=False)
    ring = np.concatenate(
        [
            r * np.column_stack([np.cos(angles), np.sin(angles)])
            for r in (0.0, 0.4 * slack, 0.8 * slack, slack)
        ]
    )
    missed, begin = 0, 0
    for p, end in enumerate(ends):
        row, column = np.argwhere(numbers == p)[0]
        seen = raster(runs, begin, end, free.shape)
        begin = end
        around = coarse.at(row, column) + ring
        around = around[[bool(point_is_free(index, *each)) for each in around]]
        nodes = np.argwhere(free)
        points, found = fine.at(*nodes.T), np.zeros(len(nodes), dtype=bool)
        for each in around:
            found |= are_clear(index, np.tile(each, (len(points), 1)), points)
        # Nothing that some place sees is missing, and hardly anything else is there.
        assert seen[tuple(nodes[found].T)].all()
        missed += seen.sum() - found.sum()
        if seen.any():
            first_row, first_column, rows, columns, _ = windows[p]
            lows = [max(each.min() - 2, 0) // TILE for each in np.nonzero(seen)]
            sizes = zip(np.nonzero(seen), free.shape, strict=True)
            highs = [min(each.max() + 2, size - 1) // TILE for each, size in sizes]
            assert [first_row, first_column] == lows
            assert [first_row + rows - 1, first_column + columns - 1] == highs
    assert missed < 0.03 * free.sum() * len(ends)
