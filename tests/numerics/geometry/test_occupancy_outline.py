"""Occupancy maps become worlds that keep the map's topology, walls and areas."""

import cv2
import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.occupancy_map import FREE, OCCUPIED, UNKNOWN, OccupancyMap
from sightfield.systems.numerics.geometry.occupancy_outline import (
    OutlineOptions,
    hausdorff_distance,
    outline_occupancy_map,
    wall_guards,
)
from sightfield.systems.numerics.geometry.world import World

SIZE = 40


@pytest.fixture
def hall():
    """Free cells with a frame of others."""
    cells = np.zeros((SIZE, SIZE), dtype=bool)
    cells[1:-1, 1:-1] = True
    return cells


def guarded(inside: np.ndarray, tolerance: float) -> set[tuple[int, int]]:
    """Row and column of the cells with guards."""
    points = wall_guards(inside, tolerance)
    return {(int(row), int(column)) for column, row in np.floor(points)}


def test_an_empty_room_has_no_guards(hall):
    assert guarded(hall, 1.0) == set()


@pytest.mark.parametrize("step", [(0, 1), (1, 0), (1, 1), (-1, 1)])
def test_every_cell_of_a_wall_one_cell_thick_is_guarded(hall, step):
    wall = {(20 + k * step[0], 20 + k * step[1]) for k in range(10)}
    hall[tuple(np.array(sorted(wall)).T)] = False
    assert guarded(hall, 1.0) == wall


def test_guards_surround_the_middle_of_a_cell(hall):
    hall[20, 10:30] = False
    around = wall_guards(hall, 1.0)[:4] - [10.5, 20.5]
    assert sorted(map(tuple, around)) == [(-0.25, 0.0), (0.0, -0.25), (0.0, 0.25), (0.25, 0.0)]


def test_what_is_thicker_than_two_tolerances_needs_no_guard(hall):
    hall[20:23, 10:30] = False
    assert guarded(hall, 1.0) == set()
    assert guarded(hall, 1.5) != set()


def test_a_bump_is_no_wall_and_a_wall_on_something_thick_is(hall):
    hall[10:20, 10:20] = False
    hall[20, 15] = False
    assert guarded(hall, 1.0) == set()
    hall[20:23, 15] = False
    assert guarded(hall, 1.0) == {(20, 15), (21, 15), (22, 15)}


def test_a_bump_on_a_thin_obstacle_is_no_wall_either(hall):
    hall[10:16, 10:16] = False
    hall[16, 12] = False
    assert (16, 12) not in guarded(hall, 4.0)
    assert guarded(hall, 4.0) != set()


def test_a_stub_of_the_border_counts_from_the_border(hall):
    hall[1, 20] = False
    assert guarded(hall, 1.0) == set()
    hall[1:6, 20] = False
    assert {(row, 20) for row in range(1, 6)} == guarded(hall, 1.0)


def test_a_region_that_is_thin_everywhere_is_guarded_itself():
    corridor = np.zeros((10, SIZE), dtype=bool)
    corridor[5, 3:-3] = True
    assert guarded(corridor, 1.0) == {(5, column) for column in range(3, SIZE - 3)}


def test_every_thin_obstacle_keeps_a_guard(hall):
    rng = np.random.default_rng(3)
    hall[5:35, 5:35] &= rng.random((30, 30)) > 0.2
    points = wall_guards(hall, 50.0)
    assert len(points) > 0
    # With a tolerance larger than the room, every obstacle is thin.
    _, parts = cv2.connectedComponents((~hall).astype(np.uint8), connectivity=8)
    kept = {int(parts[int(y), int(x)]) for x, y in points}
    assert kept >= set(range(1, parts.max() + 1)) - {int(parts[0, 0])}


SQUARE = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]])


def test_equal_outlines_are_at_no_distance():
    assert hausdorff_distance([SQUARE], [np.roll(SQUARE, 1, axis=0)], 1e-6) == 0.0


def test_a_shifted_square_is_as_far_as_it_was_shifted():
    assert hausdorff_distance([SQUARE], [SQUARE + np.array([1.0, 0.0])], 1e-6) == pytest.approx(1.0)


def test_a_larger_square_is_farthest_at_its_corners():
    larger = 1.5 * (SQUARE - 2.0) + 2.0
    assert hausdorff_distance([SQUARE], [larger], 1e-6) == pytest.approx(np.sqrt(2.0))


def test_the_farthest_point_may_lie_inside_an_edge():
    left = np.array([[0.0, 0.0], [0.0, 1.0], [-1.0, 0.0]])
    right = np.array([[10.0, 0.0], [11.0, 0.0], [10.0, 1.0]])
    joined = np.array([[-1.0, 0.0], [11.0, 0.0], [10.0, 1.0], [0.0, 1.0]])
    # The upper edge runs from one tip to the other, 10 apart, the lower as far below.
    assert hausdorff_distance([left, right], [joined], 1e-6) == pytest.approx(5.0, abs=1e-5)


def test_the_order_does_not_matter():
    inner = SQUARE[:3] / 8.0
    assert hausdorff_distance([SQUARE], [inner], 1e-9) == pytest.approx(
        hausdorff_distance([inner], [SQUARE], 1e-9)
    )


@given(seed=st.integers(0, 2**32 - 1))
def test_it_agrees_with_dense_samples(seed):
    rng = np.random.default_rng(seed)
    one, other = ([rng.uniform(0, 5, (rng.integers(3, 7), 2))] for _ in range(2))

    def line(rings):
        return shapely.MultiLineString([np.vstack([ring, ring[:1]]) for ring in rings])

    fine = 0.02
    sampled = [shapely.segmentize(line(rings), fine) for rings in (one, other)]
    expected = max(
        shapely.distance(shapely.points(shapely.get_coordinates(a)), b).max()
        for a, b in [(sampled[0], line(other)), (sampled[1], line(one))]
    )
    # Between samples the distance grows by at most half their spacing.
    assert -1e-9 <= hausdorff_distance(one, other, 1e-9) - expected <= fine / 2


CELL = 0.05
KEEP_ALL = {"min_obstacle_area": 0.0, "min_wall_length": 0.0}


def from_cells(cells: np.ndarray, resolution=CELL, origin=(0.0, 0.0, 0.0)) -> OccupancyMap:
    """A map from classes, its first row at the bottom."""
    return OccupancyMap(np.asarray(cells, dtype=np.uint8), resolution, origin)


def room(rows=40, columns=60) -> np.ndarray:
    """A free room with walls one cell thick."""
    cells = np.full((rows, columns), OCCUPIED)
    cells[1:-1, 1:-1] = FREE
    return cells


def sees(world: World, one, other) -> bool:
    """Whether the segment between two points given in cells stays in the free region."""
    return world.polygon.covers(shapely.LineString(CELL * np.array([one, other])))


def is_free(world: World, point) -> bool:
    return world.polygon.covers(shapely.Point(CELL * np.array(point)))


def test_an_empty_room_is_a_rectangle():
    outline = outline_occupancy_map(from_cells(room()))
    assert (len(outline.world.obstacles), outline.world.vertex_count) == (0, 4)
    assert outline.world.free_area == pytest.approx(38 * 58 * CELL**2)
    assert outline.cell_area == pytest.approx(38 * 58 * CELL**2)
    np.testing.assert_allclose(outline.world.bounds, CELL * np.array([1, 1, 59, 39]))
    assert outline.simplification_error == 0.0


def test_a_box_becomes_an_obstacle_with_four_corners():
    cells = room()
    cells[10:20, 30:36] = OCCUPIED
    outline = outline_occupancy_map(from_cells(cells))
    (obstacle,) = outline.world.obstacles
    np.testing.assert_allclose(
        sorted(map(tuple, obstacle / CELL)), [(30, 10), (30, 20), (36, 10), (36, 20)]
    )
    assert len(outline.world.corners) == 4


def test_a_map_without_walls_ends_at_its_border():
    outline = outline_occupancy_map(from_cells(np.full((3, 5), FREE)))
    np.testing.assert_allclose(outline.world.bounds, CELL * np.array([0, 0, 5, 3]))


def test_the_origin_moves_and_turns_the_world():
    cells = room()
    cells[10:20, 30:36] = OCCUPIED
    plain = outline_occupancy_map(from_cells(cells)).world
    x, y, yaw = 3.0, -7.0, 0.6
    moved = outline_occupancy_map(from_cells(cells, origin=(x, y, yaw))).world
    turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
    for before, after in zip(plain.rings, moved.rings, strict=True):
        np.testing.assert_allclose(after, before @ turn.T + [x, y], atol=1e-12)


def test_the_size_of_a_cell_scales_the_world():
    cells = room()
    cells[10:20, 30:36] = OCCUPIED
    options = OutlineOptions(**KEEP_ALL)
    small = outline_occupancy_map(from_cells(cells), options)
    large = outline_occupancy_map(from_cells(cells, resolution=1.0), options)
    assert large.world.free_area == pytest.approx(small.world.free_area / CELL**2)


def test_unknown_cells_count_as_stated():
    cells = room()
    cells[10:20, 30:36] = UNKNOWN
    blocked = outline_occupancy_map(from_cells(cells))
    opened = outline_occupancy_map(from_cells(cells), OutlineOptions(unknown="free"))
    assert (len(blocked.world.obstacles), len(opened.world.obstacles)) == (1, 0)
    assert opened.cell_area - blocked.cell_area == pytest.approx(60 * CELL**2)


def test_the_unexplored_outside_does_not_win_over_the_room():
    cells = np.full((200, 200), UNKNOWN)
    cells[80:120, 70:130] = room()
    outline = outline_occupancy_map(from_cells(cells), OutlineOptions(unknown="free"))
    np.testing.assert_allclose(outline.world.bounds, CELL * np.array([71, 81, 129, 119]))
    assert outline.unreachable_area == pytest.approx((200 * 200 - 40 * 60) * CELL**2)


def test_the_largest_room_is_the_world_and_the_other_is_reported():
    cells = room()
    cells[:, 20] = OCCUPIED
    outline = outline_occupancy_map(from_cells(cells))
    np.testing.assert_allclose(outline.world.bounds, CELL * np.array([21, 1, 59, 39]))
    assert outline.unreachable_area == pytest.approx(38 * 19 * CELL**2)


def test_a_pocket_inside_an_obstacle_is_part_of_it():
    cells = room()
    cells[10:20, 30:40] = OCCUPIED
    cells[12:18, 32:38] = FREE
    outline = outline_occupancy_map(from_cells(cells))
    assert len(outline.world.obstacles) == 1
    assert outline.world.free_area == pytest.approx((38 * 58 - 100) * CELL**2)
    assert outline.unreachable_area == pytest.approx(36 * CELL**2)


def test_speckle_is_dropped_and_its_area_reported():
    cells = room()
    cells[[5, 9, 9, 10], [40, 12, 13, 12]] = OCCUPIED
    outline = outline_occupancy_map(from_cells(cells))
    assert len(outline.world.obstacles) == 0
    assert outline.speckle_area == pytest.approx(4 * CELL**2)
    assert outline.world.free_area == pytest.approx(38 * 58 * CELL**2)


def test_the_stated_area_itself_is_no_speckle():
    cells = room()
    cells[10:12, 10:14] = OCCUPIED  # 8 cells: 0.02 m^2
    cells[20:22, 10:13] = OCCUPIED
    for area, count in [(0.02, 1), (0.015, 2), (0.0201, 0)]:
        options = OutlineOptions(min_obstacle_area=area)
        assert len(outline_occupancy_map(from_cells(cells), options).world.obstacles) == count


def test_a_wall_is_kept_where_a_blob_of_the_same_area_is_dropped():
    cells = room()
    cells[20, 10:30] = OCCUPIED  # 1 m
    cells[5:9, 40:45] = OCCUPIED
    outline = outline_occupancy_map(from_cells(cells), OutlineOptions(min_obstacle_area=0.06))
    (wall,) = outline.world.obstacles
    assert np.ptp(wall[:, 0]) == pytest.approx(1.0)
    assert outline.speckle_area == pytest.approx(20 * CELL**2)


def test_speckle_at_a_wall_belongs_to_the_wall():
    cells = room()
    cells[1, 10] = OCCUPIED
    outline = outline_occupancy_map(from_cells(cells), OutlineOptions(tolerance=0.01))
    assert outline.speckle_area == 0.0
    assert not is_free(outline.world, (10.5, 1.5))


@pytest.mark.parametrize("tolerance", [0.01, 0.05, 0.1, 0.2, 1.0])
def test_a_wall_one_cell_thick_is_kept_and_opaque(tolerance):
    cells = room()
    cells[20, 10:50] = OCCUPIED
    world = outline_occupancy_map(from_cells(cells), OutlineOptions(tolerance=tolerance)).world
    assert len(world.obstacles) == 1
    for column in np.arange(11.5, 49.0, 0.5):
        assert not sees(world, (column, 15), (column, 26))
        assert not is_free(world, (column, 20.5))


@pytest.mark.parametrize("tolerance", [0.01, 0.05, 0.1, 0.2, 1.0])
def test_neither_sight_nor_motion_leaks_through_a_diagonal_wall(tolerance):
    cells = room()
    diagonal = np.arange(8, 32)
    cells[diagonal, diagonal] = OCCUPIED
    world = outline_occupancy_map(from_cells(cells), OutlineOptions(tolerance=tolerance)).world
    assert len(world.obstacles) == 1
    for along in np.arange(12.0, 28.0, 0.25):
        # Right through the corners that two cells share, and beside them.
        assert not sees(world, (along + 4, along - 4), (along - 4, along + 4))
    assert sees(world, (36, 2), (36, 38))


def test_a_diagonal_wall_from_wall_to_wall_parts_the_room():
    cells = room(40, 60)
    cells[np.arange(40), np.arange(10, 50)] = OCCUPIED
    outline = outline_occupancy_map(from_cells(cells))
    free = (cells == FREE) & (np.arange(60)[None] < np.arange(10, 50)[:, None])
    other = int((cells == FREE).sum() - free.sum())
    assert outline.unreachable_area == pytest.approx(min(int(free.sum()), other) * CELL**2)


def test_a_passage_one_cell_wide_stays_open():
    cells = room()
    cells[:, 28:32] = OCCUPIED
    cells[20, 28:32] = FREE
    world = outline_occupancy_map(from_cells(cells)).world
    assert sees(world, (20, 20.5), (40, 20.5))


def test_a_maze_of_corridors_one_cell_wide_keeps_its_area():
    cells = np.full((11, 21), OCCUPIED)
    cells[1:-1:2, 1:-1] = FREE
    cells[1:-1, 1] = FREE
    outline = outline_occupancy_map(from_cells(cells, resolution=1.0), OutlineOptions(**KEEP_ALL))
    assert outline.world.polygon.is_valid
    assert outline.world.free_area > 0.5 * outline.cell_area


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"unknown": "maybe"}, "`unknown` must be one of occupied, free; got maybe"),
        ({"tolerance": 0.0}, "`tolerance` must be positive; got 0.0"),
        ({"tolerance": float("nan")}, "`tolerance` must be a finite number; got nan"),
        ({"min_obstacle_area": -1.0}, "`min_obstacle_area` must be zero or positive; got -1.0"),
        ({"min_wall_length": -1.0}, "`min_wall_length` must be zero or positive; got -1.0"),
    ],
)
def test_bad_options_are_refused(options, message):
    with pytest.raises(InvalidInput, match=message):
        OutlineOptions(**options)
