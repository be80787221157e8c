"""The visibility game: against a slow solution, a closed form, and an evader that runs free."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.arenas.random_arena import Arena, draw_arena
from sightfield.systems.numerics.geometry.edge_index import build_edge_index, point_is_free
from sightfield.systems.numerics.geometry.grown_obstacles import shrink_world
from sightfield.systems.numerics.geometry.segment_sight import are_clear, segment_is_clear
from sightfield.systems.numerics.geometry.sight_loss import first_loss
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.tracking.corner_frame import to_corner_frame
from sightfield.systems.numerics.tracking.corner_game import escape_time, margins
from sightfield.systems.numerics.tracking.corner_table import corner_table
from sightfield.systems.numerics.tracking.visibility_game.guaranteed_times import (
    MOVES,
    solve_visibility_game,
)
from sightfield.systems.numerics.tracking.visibility_game.sweeps import FOR_EVER, steps_from

RATIO = 0.3
SQUARE = [(0, 0), (4, 0), (4, 4), (0, 4)]
# One reflex corner, where no node lies on its edges.
CORNER = make_world([(0, 0), (4, 0), (4, 4), (2.0317, 4), (2.0317, 2.0243), (0, 2.0243)])


def solve(world, grid, bound="middle", **more):
    speeds = {"pursuer_speed": 1.0, "evader_speed": RATIO}
    return solve_visibility_game(world, grid=grid, bound=bound, **(speeds | more))


def solve_slowly(world, table):
    """Steps that every pair of nodes is worth, by whole sweeps over a dense table."""
    index = build_edge_index(world)
    places, grid, free = table.places, table.evader_grid, table.evader_nodes
    points = grid.points[free]
    spacing = table.pursuer_grid.spacing

    def ways(nodes, cell):
        """Which nodes can be reached from which."""
        apart = np.hypot(*(nodes[:, None] - nodes[None, :]).transpose(2, 0, 1))
        near = apart <= MOVES.longest * cell * (1 + 1e-9)
        a, b = np.nonzero(near)
        near[a, b] = are_clear(index, nodes[a], nodes[b])
        return near

    pursuer_ways, evader_ways = ways(places, spacing), ways(points, grid.spacing)
    a, b = np.divmod(np.arange(len(places) * len(points)), len(points))
    seen = are_clear(index, places[a], points[b]).reshape(len(places), len(points))
    value = np.where(seen, FOR_EVER, 0)
    while True:
        replies = np.stack([value[:, near].min(axis=1) for near in evader_ways], axis=1)
        best = np.stack([replies[near].max(axis=0) for near in pursuer_ways])
        lowered = np.where(seen, np.minimum(best + 1, FOR_EVER), 0)
        if (lowered == value).all():
            return value
        value = lowered


@pytest.mark.parametrize(
    "world",
    [
        make_world([(0, 0), (2, 0), (2, 2), (0, 2)], [[(0.71, 0.63), (1.3, 0.63), (1.1, 1.29)]]),
        # A wall thinner than a step of the evader, in a room that is not convex.
        make_world(
            [
                *[(0, 0), (2.1, 0), (2.1, 1.0), (1.2, 1.3), (1.2, 2.0), (0.62, 2.0)],
                *[(0.62, 1.1), (0.6, 1.1), (0.6, 2.0), (0, 2.0)],
            ]
        ),
    ],
    ids=["triangle", "thin wall"],
)
def test_equals_a_slow_solution_to_the_step(world):
    table = solve(world, 0.25, evader_speed=0.4)
    expected = solve_slowly(world, table)
    rows, columns = table.evader_grid.rows, table.evader_grid.columns
    for p in range(len(table.places)):
        steps = steps_from(table.planes, table.rules, p)[:rows, :columns]
        np.testing.assert_array_equal(steps[table.evader_nodes], expected[p])
    assert 0 < table.share_for_ever < 1
    assert table.share_for_ever == pytest.approx(
        (expected == FOR_EVER).sum() / (expected > 0).sum()
    )


def against_the_corner_game(table, every):
    """Pairs in sight: guaranteed time, T* and M1 of the corner game (M1 infinite in the star)."""
    (corner,) = corner_table(CORNER)
    points, found = table.evader_grid.points, []
    for p in table.places[::every]:
        times = table.times_from(p)
        for j in range(0, times.shape[0], 3):
            for i in range(0, times.shape[1], 3):
                e = points[j, i]
                if np.isnan(times[j, i]) or not segment_is_clear(table.sight, *p, *e):
                    continue
                *state, _ = to_corner_frame(*p, *e, *corner[:4])
                margin = margins(*state, corner[3], RATIO)[0] if state[1] < 0 else math.inf
                found.append((times[j, i], escape_time(*state, corner[3], RATIO, 1.0), margin))
    return np.array(found).T


def test_middle_comes_near_the_corner_game():
    offsets = []
    for grid in (0.2, 0.1):
        times, theory, margin = against_the_corner_game(solve(CORNER, grid), 7)
        both = np.isfinite(times) & np.isfinite(theory)
        assert abs((times[both] - theory[both]).mean()) < grid
        # Who wins differs beside the barrier alone.
        differ = np.isfinite(times) != np.isfinite(theory)
        assert 0 < differ.mean() < 0.02
        offsets.append(np.abs(margin[differ]).mean())
    assert offsets[1] < 0.6 * offsets[0] < 0.08


@pytest.mark.parametrize("grid", [0.4, 0.2])
def test_lower_is_below_the_corner_game_everywhere(grid):
    times, theory, _ = against_the_corner_game(solve(CORNER, grid, "lower"), 17)
    assert (times <= theory).all()
    assert np.isinf(times).mean() > 0.8
    lost = np.isfinite(theory)
    assert (theory[lost] - times[lost]).mean() < 1.2


@pytest.mark.parametrize("bound", ["middle", "lower"])
def test_a_world_without_corners_is_kept_for_ever(bound):
    table = solve(make_world(SQUARE), 0.4, bound)
    assert table.share_for_ever == 1.0
    assert table.time([1.0, 1.0], [3.9, 0.1]) == math.inf


@pytest.mark.parametrize("bound", ["middle", "lower"])
@pytest.mark.parametrize("transform", ["mirrored", "turned", "moved", "scaled"])
def test_no_frame_is_special(bound, transform):
    world = draw_arena(Arena(obstacles=2, shortest=0.8, longest=1.2), 4)
    scale = 2.0 if transform == "scaled" else 1.0
    matrix = {
        "mirrored": [[-1, 0], [0, 1]],
        "turned": [[0, -1], [1, 0]],
        "moved": [[1, 0], [0, 1]],
        "scaled": [[2, 0], [0, 2]],
    }[transform]
    shift = np.array([3.0, -7.0]) if transform == "moved" else np.zeros(2)

    def carried(points):
        return np.asarray(points) @ np.array(matrix, dtype=float).T + shift

    other = make_world(carried(world.boundary), [carried(ring) for ring in world.obstacles])
    mine, theirs = (
        solve(each, 0.2 * factor, bound) for each, factor in ((world, 1.0), (other, scale))
    )
    assert theirs.pairs == pytest.approx(mine.pairs, rel=1e-3)
    rng = np.random.default_rng(0)
    for p in mine.places[rng.choice(len(mine.places), 5, replace=False)]:
        times, image = mine.times_from(p), theirs.times_from(carried(p))
        points = carried(mine.evader_grid.points) - theirs.evader_grid.at(0, 0)
        column, row = np.rint(points / theirs.evader_grid.spacing).astype(int).reshape(-1, 2).T
        np.testing.assert_allclose(image[row, column], scale * times.ravel(), rtol=1e-9)


def play(table, world, pursuer, evader, rng, seconds):
    """How long sight holds in the plane against an evader that tries to lower the bound [s]."""
    index = build_edge_index(world)
    p, e, now = np.array(pursuer), np.array(evader), 0.0
    promised = table.time(p, e)
    heading = rng.uniform(0, 2 * np.pi)
    while now < min(promised, seconds):
        place, left = table.best_step(p, e)
        assert now + left >= min(promised, seconds) - 1e-9, "the bound has fallen"
        pace = RATIO * table.step
        angles = heading + np.append(0.0, rng.uniform(-np.pi, np.pi, 3))
        ends = [e + pace * np.array([np.cos(a), np.sin(a)]) for a in angles] + [e]
        ends = [x for x in ends if point_is_free(index, *x) and segment_is_clear(index, *e, *x)]
        worth = [table.time(place, x) for x in ends]
        to = ends[int(np.argmin(worth))]
        if (to != e).any():
            heading = math.atan2(*(to - e)[::-1])
        lost, _ = first_loss(index, p, place, e, to)
        assert not np.isfinite(lost), f"lost after {now:.2f} s of {promised:.2f} s"
        p, e, now = place, to, now + table.step
    return now


def test_the_certified_pursuer_keeps_its_word():
    world = draw_arena(Arena(obstacles=3, shortest=0.8, longest=1.2), 7)
    table = solve(world, 0.12, "lower")
    rng = np.random.default_rng(5)
    index = build_edge_index(world)
    games = 0
    while games < 10:
        p, e = rng.uniform(0, 4, (2, 2))
        if not (point_is_free(index, *p) and point_is_free(index, *e)):
            continue
        if table.time(p, e) > 1.0:
            play(table, world, p, e, rng, 12.0)
            games += 1


def test_lower_is_at_most_middle_but_for_steps():
    world = draw_arena(Arena(), 3)
    middle, lower = solve(world, 0.16), solve(world, 0.16, "lower")
    assert lower.share_for_ever < middle.share_for_ever
    rng = np.random.default_rng(0)
    index = build_edge_index(world)
    pairs = rng.uniform(0, 4, (2000, 2, 2))
    above = 0
    for p, e in pairs:
        if point_is_free(index, *p) and point_is_free(index, *e):
            above += lower.time(p, e) > middle.time(p, e) + 3 * middle.step
    assert above <= 2


def test_robots_with_bodies_stay_in_their_regions():
    world = make_world(SQUARE, [[(1.5, 1.4), (2.7, 1.4), (2.7, 2.5), (1.5, 2.5)]])
    pursuing, evading = shrink_world(world, 0.16), shrink_world(world, 0.1)
    table = solve(world, 0.2, pursuer_regions=pursuing, evader_regions=evading)
    assert 0 < table.share_for_ever < 1
    inside = build_edge_index(*pursuing)
    assert all(point_is_free(inside, *place) for place in table.places)
    with pytest.raises(InvalidInput, match="pursuer"):
        table.time([0.05, 2.0], [2.0, 2.0])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"evader_speed": 1.0}, r"`speed_ratio` must lie in \(0, 1\); got 1"),
        ({"evader_speed": -0.1}, "`evader_speed` must be positive"),
        ({"grid": 0.0}, "`grid` must be positive"),
        ({"grid": math.nan}, "`grid` must be a finite number"),
        ({"grid": 1e-3}, "`grid` must be coarser"),
        ({"grid": 0.05, "memory": 1e6}, "`grid` must be coarser, so that the table takes at most"),
        ({"bound": "best"}, "`bound` must be one of middle, lower"),
    ],
)
def test_nonsense_is_refused(changes, message):
    options = {"grid": 0.2} | changes
    with pytest.raises(InvalidInput, match=message):
        solve(make_world(SQUARE), **options)


def test_a_grid_that_leaves_no_place_is_refused():
    narrow = make_world([(0, 0), (5, 0), (5, 0.4), (0, 0.4)])
    with pytest.raises(InvalidInput, match="`grid` must leave the pursuer a place"):
        solve(narrow, 3.0)
