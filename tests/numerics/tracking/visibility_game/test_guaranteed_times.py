"""The visibility game: against a slow solution, a closed form, and an evader that runs free."""

import functools
import math

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.edge_index import build_edge_index, point_is_free
from sightfield.systems.numerics.geometry.random_arena import Arena, draw_arena
from sightfield.systems.numerics.geometry.segment_sight import are_clear, segment_is_clear
from sightfield.systems.numerics.geometry.sight_loss import first_loss
from sightfield.systems.numerics.geometry.visibility_polygon import visibility_polygon
from sightfield.systems.numerics.geometry.world import make_world, shrink_world
from sightfield.systems.numerics.tracking.corner_game import (
    corner_table,
    escape_time,
    margins,
    to_corner_frame,
)
from sightfield.systems.numerics.tracking.visibility_game.bounds import (
    BOUNDS,
    MOVES,
    turning_margin,
)
from sightfield.systems.numerics.tracking.visibility_game.guaranteed_times import (
    solve_visibility_game,
)
from sightfield.systems.numerics.tracking.visibility_game.plane_steps import steps_from
from sightfield.systems.numerics.tracking.visibility_game.planes import FOR_EVER

RATIO = 0.3
SQUARE = [(0, 0), (4, 0), (4, 4), (0, 4)]
# One reflex corner, where no node lies on its edges.
CORNER = make_world([(0, 0), (4, 0), (4, 4), (2.0317, 4), (2.0317, 2.0243), (0, 2.0243)])


def solve(world, grid, bound="middle", **more):
    speeds = {"pursuer_speed": 1.0, "evader_speed": RATIO}
    return solve_visibility_game(world, grid=grid, bound=bound, **(speeds | more))


@functools.cache
def arena_and_solution(grid, bound):
    """A full arena and its table, solved once for the tests that compare bounds."""
    world = draw_arena(Arena(), 3)
    return world, solve(world, grid, bound)


def solve_slowly(world, table, seen_at_walls, sight_range=math.inf):
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
    seen = are_clear(index, places[a], points[b])
    seen &= np.hypot(*(points[b] - places[a]).T) <= sight_range
    seen = seen.reshape(len(places), len(points)) & seen_at_walls(
        index, places, points, grid.spacing, math.sqrt(5)
    )
    value = np.where(seen, FOR_EVER, 0)
    while True:
        replies = np.stack([value[:, near].min(axis=1) for near in evader_ways], axis=1)
        best = np.stack([replies[near].max(axis=0) for near in pursuer_ways])
        lowered = np.where(seen, np.minimum(best + 1, FOR_EVER), 0)
        if (lowered == value).all():
            return value
        value = lowered


SMALL = pytest.mark.parametrize(
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


@SMALL
@pytest.mark.parametrize("sight_range", [math.inf, 1.13])
def test_equals_a_slow_solution_to_the_step(world, sight_range, seen_at_walls):
    table = solve(world, 0.25, evader_speed=0.4, sight_range=sight_range)
    expected = solve_slowly(world, table, seen_at_walls, sight_range)
    rows, columns = table.evader_grid.rows, table.evader_grid.columns
    for p in range(len(table.places)):
        steps = steps_from(table.planes, table.rules, p)[:rows, :columns]
        np.testing.assert_array_equal(steps[table.evader_nodes], expected[p])
    assert len(np.unique(expected)) > 3
    assert table.share_for_ever == pytest.approx(
        (expected == FOR_EVER).sum() / (expected > 0).sum()
    )
    assert_lasting(table)


def assert_lasting(table):
    """The mean time that a place keeps what it sees is that of its own times."""
    for p in range(0, len(table.places), 5):
        times = table.times_from(table.places[p])[table.evader_nodes]
        total = np.minimum(times, table.horizon).sum()
        assert table.lasting[p] * table.sighted[p] == pytest.approx(total)


@SMALL
def test_upper_equals_a_slow_solution_to_the_step(world):
    table = solve(world, 0.3, "upper", evader_speed=0.6)
    expected = solve_upper_slowly(world, table)
    rows, columns = table.evader_grid.rows, table.evader_grid.columns
    for p in range(len(table.places)):
        steps = steps_from(table.planes, table.rules, p)[:rows, :columns]
        np.testing.assert_array_equal(steps[table.evader_nodes], expected[p])
    assert expected[expected < FOR_EVER].max() > 2
    # What is kept is told of what is in sight of the places themselves.
    index, points = build_edge_index(world), table.evader_grid.points[table.evader_nodes]
    for p in np.flatnonzero(table.sighted)[::7]:
        seen = are_clear(index, np.tile(table.places[p], (len(points), 1)), points)
        assert seen.sum() == table.sighted[p]
        assert table.kept[p] == pytest.approx((expected[p, seen] == FOR_EVER).mean())
        steps = np.where(expected[p, seen] == FOR_EVER, table.rules.horizon, expected[p, seen])
        assert table.lasting[p] == pytest.approx(steps.mean() * table.step)


def solve_upper_slowly(world, table):
    """Steps of the upper bound that every pair of nodes is worth, over a dense table."""
    index = build_edge_index(world)
    places, grid = table.places, table.evader_grid
    points = grid.points[table.evader_nodes]
    views = [shapely.Polygon(visibility_polygon(index, point)) for point in points]
    discs = shapely.points(places)
    seen = np.stack([shapely.distance(view, discs) <= table.slack for view in views], axis=1)
    value = np.where(seen, FOR_EVER, 0)
    apart = np.hypot(*(places[:, None] - places[None, :]).transpose(2, 0, 1))
    answers = apart <= MOVES.longest * table.pursuer_grid.spacing * (1 + 1e-9)
    apart = np.hypot(*(points[:, None] - points[None, :]).transpose(2, 0, 1))
    ways = apart <= MOVES.longest * grid.spacing * (1 + 1e-9)
    a, b = np.nonzero(ways)
    ways[a, b] = are_clear(index, points[a], points[b])
    while True:
        best = np.stack([value[near].max(axis=0) for near in answers])
        left = np.stack([best[:, near].min(axis=1) for near in ways], axis=1)
        lowered = np.where(seen, np.minimum(left + 1, FOR_EVER), 0)
        if (lowered == value).all():
            return value
        value = lowered


def against_the_corner_game(table, every):
    """Pairs in sight: guaranteed time, T* and M1 of the corner game (M1 infinite in the star), and
    how far the pursuer is from the outer walls."""
    (corner,) = corner_table(CORNER)
    points, found = table.evader_grid.points, []
    for p in table.places[table.sighted > 0][::every]:
        times = table.times_from(p)
        for j in range(0, times.shape[0], 3):
            for i in range(0, times.shape[1], 3):
                e = points[j, i]
                if np.isnan(times[j, i]) or not segment_is_clear(table.sight, *p, *e):
                    continue
                *state, _ = to_corner_frame(*p, *e, *corner[:4])
                margin = margins(*state, corner[3], RATIO)[0] if state[1] < 0 else math.inf
                theory = escape_time(*state, corner[3], RATIO, 1.0)
                found.append((times[j, i], theory, margin, min(*p, *(4 - p))))
    return np.array(found).T


def test_middle_comes_near_the_corner_game():
    offsets = []
    for grid, every in ((0.2, 7), (0.1, 29)):
        times, theory, margin, _ = against_the_corner_game(solve(CORNER, grid), every)
        both = np.isfinite(times) & np.isfinite(theory)
        assert abs((times[both] - theory[both]).mean()) < grid
        # Who wins differs beside the barrier alone.
        differ = np.isfinite(times) != np.isfinite(theory)
        assert 0 < differ.mean() < 0.02
        offsets.append(np.abs(margin[differ]).mean())
    assert offsets[1] < 0.75 * offsets[0] < 0.03


@pytest.mark.parametrize("grid", [0.4, 0.25])
def test_lower_is_below_the_corner_game_everywhere(grid):
    times, theory, *_ = against_the_corner_game(solve(CORNER, grid, "lower"), 17)
    assert (times <= theory).all()
    assert np.isinf(times).mean() > 0.8
    lost = np.isfinite(theory)
    assert (theory[lost] - times[lost]).mean() < 1.2


@pytest.mark.parametrize("grid", [0.4, 0.25])
def test_upper_is_above_the_corner_game_everywhere(grid):
    table = solve(CORNER, grid, "upper")
    times, theory, margin, walls = against_the_corner_game(table, 17)
    # Where the pursuer may run into the outer walls, which the corner game has not.
    runs_free = np.isinf(theory) | (theory < walls)
    assert (times >= theory)[runs_free].all()
    assert runs_free.mean() > 0.98
    assert np.abs(margin[np.isfinite(times) != np.isfinite(theory)]).mean() < 0.1 + 0.1 * grid
    both = np.isfinite(times) & np.isfinite(theory)
    assert (times[both] - theory[both]).mean() < 0.4


@pytest.mark.parametrize("bound", BOUNDS)
def test_a_world_without_corners_is_kept_for_ever(bound):
    table = solve(make_world(SQUARE), 0.4, bound)
    assert table.share_for_ever == 1.0
    assert table.time([1.0, 1.0], [3.9, 0.1]) == math.inf


@pytest.fixture(scope="module", params=BOUNDS)
def arena_and_table(request):
    """An arena with two obstacles, and its table by each bound in turn."""
    world = draw_arena(Arena(obstacles=2, shortest=0.8, longest=1.2), 4)
    return world, solve(world, 0.3, request.param), request.param


@pytest.mark.parametrize("transform", ["mirrored", "turned", "moved", "scaled"])
def test_no_frame_is_special(arena_and_table, transform):
    world, mine, bound = arena_and_table
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
    theirs = solve(other, 0.3 * scale, bound)
    assert theirs.pairs == pytest.approx(mine.pairs, rel=1e-3)
    rng = np.random.default_rng(0)
    for p in rng.choice(mine.places[mine.sighted > 0], 5, replace=False):
        times, image = mine.times_from(p), theirs.times_from(carried(p))
        points = carried(mine.evader_grid.points) - theirs.evader_grid.at(0, 0)
        column, row = np.rint(points / theirs.evader_grid.spacing).astype(int).reshape(-1, 2).T
        np.testing.assert_allclose(image[row, column], scale * times.ravel(), rtol=1e-9)


@pytest.mark.parametrize("bound", ["middle", "lower"])
def test_who_is_out_of_range_is_lost(bound):
    world = make_world([(0, 0), (3, 0), (3, 3), (0, 3)])
    table = solve(world, 0.2, bound, sight_range=1.5)
    assert table.time([1.0, 1.0], [1.0, 2.51]) == 0.0
    # The pursuer is faster: whom it sees it keeps, up to what the certified bound keeps off.
    assert table.time([1.0, 1.0], [1.0, 2.3]) == math.inf
    assert table.share_for_ever == 1.0 if bound == "middle" else 0.85 < table.share_for_ever < 1.0
    everything = solve(world, 0.2, bound, sight_range=6.0)
    np.testing.assert_array_equal(everything.planes.tiles, solve(world, 0.2, bound).planes.tiles)


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
        # While the pursuer turns, and while it drives.
        met = e + table.turning_time / table.step * (to - e)
        for start, end, away, near in ((p, p, e, met), (p, place, met, to)):
            lost, _ = first_loss(index, start, end, away, near)
            assert not np.isfinite(lost), f"lost after {now:.2f} s of {promised:.2f} s"
            ways = np.linspace(start, end, 30) - np.linspace(away, near, 30)
            assert np.hypot(*ways.T).max() <= table.sight_range
        p, e, now = place, to, now + table.step
    return now


@pytest.mark.parametrize("turning_time", [0.0, 0.1])
@pytest.mark.parametrize("sight_range", [math.inf, 1.3])
def test_the_certified_pursuer_keeps_its_word(sight_range, turning_time):
    world = draw_arena(Arena(obstacles=3, shortest=0.8, longest=1.2), 7)
    table = solve(world, 0.3, "lower", sight_range=sight_range, turning_time=turning_time)
    assert table.step == pytest.approx(0.15 * math.sqrt(10) + turning_time)
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


def test_who_has_to_turn_promises_less():
    tables = [solve(CORNER, 0.4, "lower", turning_time=time) for time in (0.0, 0.2, 0.6)]
    shares = [table.share_for_ever for table in tables]
    assert shares[0] > shares[1] > shares[2] > 0.5
    # In sight of each other 2 s away from the corner: less than the game without turning.
    times = [table.time([1.0, 1.9], [2.6, 1.6]) for table in tables]
    assert times[0] >= times[1] >= times[2]
    # From the corner game's side: an evader that is faster by the margin wins no later.
    margin = turning_margin(0.4, 1.0, 0.2)
    assert margin == pytest.approx(tables[1].step / tables[0].step)
    faster = solve(CORNER, 0.4, "lower", evader_speed=RATIO * margin)
    assert tables[1].share_for_ever <= faster.share_for_ever


def test_lower_is_at_most_middle_but_for_steps():
    (world, middle), (_, lower) = (arena_and_solution(0.25, each) for each in ("middle", "lower"))
    assert_lasting(lower)
    assert lower.share_for_ever < middle.share_for_ever
    rng = np.random.default_rng(0)
    index = build_edge_index(world)
    pairs = rng.uniform(0, 4, (2000, 2, 2))
    above = 0
    for p, e in pairs:
        if point_is_free(index, *p) and point_is_free(index, *e):
            above += lower.time(p, e) > middle.time(p, e) + 3 * middle.step
    assert above <= 2


def test_lower_is_at_most_upper_everywhere():
    (world, lower), (_, upper) = (arena_and_solution(0.25, each) for each in ("lower", "upper"))
    index, rng = build_edge_index(world), np.random.default_rng(1)
    apart, finite = [], 0
    for p, e in rng.uniform(0, 4, (1800, 2, 2)):
        if point_is_free(index, *p) and point_is_free(index, *e):
            low, high = lower.time(p, e), upper.time(p, e)
            assert low <= high
            finite += math.isfinite(high) and high > 0
            apart.append(high - low if math.isfinite(high) else 0.0)
    assert finite > 60
    assert np.mean(apart) < 1.0


def test_an_evader_by_the_upper_bound_hides_in_time():
    world, table = arena_and_solution(0.25, "upper")
    index, rng = build_edge_index(world), np.random.default_rng(2)
    games = 0
    while games < 8:
        p, e = rng.uniform(0, 4, (2, 2))
        if not (point_is_free(index, *p) and point_is_free(index, *e)):
            continue
        promised = table.time(p, e)
        if not 1.0 < promised < math.inf:
            continue
        now = 0.0
        while segment_is_clear(index, *p, *e):
            place, left = table.hiding_step(p, e)
            assert now + left <= promised + 1e-9, "the bound has risen"
            assert segment_is_clear(index, *e, *place)
            assert np.hypot(*(place - e)) <= RATIO * table.step * (1 + 1e-9)
            # The pursuer knows where the evader goes, and takes what the bound makes most of.
            angles = rng.uniform(0, 2 * np.pi, 12)
            ends = p + table.step * np.column_stack([np.cos(angles), np.sin(angles)])
            ends = [x for x in ends if point_is_free(index, *x) and segment_is_clear(index, *p, *x)]
            p, e = max([p, *ends], key=lambda x: table.time(x, place)), place
            now += table.step
        assert now <= promised + 1e-9
        games += 1


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
        ({"sight_range": 0.0}, "`sight_range` must be positive; got 0"),
        ({"sight_range": math.nan}, "`sight_range` must be positive; got nan"),
        # Many nodes for one of the players alone.
        ({"evader_speed": 1e-4}, "`grid` must be coarser for so large a world"),
        ({"bound": "upper", "sight_range": 2.0}, "`sight_range` must be infinite for the upper"),
        ({"bound": "lower", "turning_time": -0.1}, "`turning_time` must be zero or positive"),
        ({"turning_time": 0.1}, "`turning_time` must be zero but for the lower bound; got 0.1"),
        ({"bound": "best"}, "`bound` must be one of lower, middle, upper"),
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


# Two rooms and a door of 0.12 m between them, too narrow for all moves of a coarse grid.
ROOMS = make_world(
    [
        *[(0, 0), (2, 0), (2, 0.94), (2.2, 0.94), (2.2, 0), (4, 0), (4, 2)],
        *[(2.2, 2), (2.2, 1.06), (2, 1.06), (2, 2), (0, 2)],
    ]
)


@pytest.mark.parametrize("bound", ["middle", "lower"])
def test_a_grid_coarser_than_a_door_is_refused(bound):
    with pytest.raises(InvalidInput, match=r"`grid` must be finer than the passages; got 0\.8"):
        solve(ROOMS, 0.8, bound)
    # Who is in the same room has a long way to the door.
    assert 3.0 < solve(ROOMS, 0.2, bound).time([1.0, 1.0], [0.5, 1.0]) < 10.0


def test_rooms_without_a_door_need_not_hang_together():
    # Robots that are too large for the door.
    parts = shrink_world(ROOMS, 0.1)
    assert len(parts) == 2
    table = solve(ROOMS, 0.25, pursuer_regions=parts, evader_regions=parts)
    assert 0 < table.share_for_ever < 1


def test_a_start_without_a_node_is_refused():
    # A nook that no node lies in: the nearest ones are behind its walls.
    nook = [(2.02, 1), (2.02, 2.6), (2.05, 2.6), (2.05, 1)]
    world = make_world([(0, 0), (4, 0), (4, 1), *nook[::-1], (0, 1)])
    table = solve(world, 0.4)
    with pytest.raises(InvalidInput, match=r"`grid` must have a node near \[2.03, 2.5\]; got 0.4"):
        table.time([2.03, 2.5], [2.03, 0.5])
    # As has an evader.
    with pytest.raises(InvalidInput, match="`evader` must be where the robot has room"):
        table.time([2.03, 0.5], [2.03, 2.5])
