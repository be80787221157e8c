"""One pursuer and two evaders: against a slow solution, the game of one, and free evaders."""

import itertools
import math

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.edge_index import build_edge_index, point_is_free
from sightfield.systems.numerics.geometry.random_arena import Arena, draw_arena
from sightfield.systems.numerics.geometry.segment_sight import are_clear, segment_is_clear
from sightfield.systems.numerics.geometry.sight_loss import first_loss
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.tracking.visibility_game.bounds import MOVES
from sightfield.systems.numerics.tracking.visibility_game.guaranteed_times import (
    solve_visibility_game,
)
from sightfield.systems.numerics.tracking.visibility_game.plane_steps import steps_from
from sightfield.systems.numerics.tracking.visibility_game.planes import ALL, FOR_EVER
from sightfield.systems.numerics.tracking.visibility_game.triples import (
    keeps_two_by_table,
    steps_of_two,
    worst_reply_of_two,
)
from sightfield.systems.numerics.tracking.visibility_game.two_evaders import (
    EVADER_MOVES,
    solve_two_evaders,
)

RATIO = 0.3
SQUARE = [(0, 0), (4, 0), (4, 4), (0, 4)]
# A box in the middle of a small room.
BOX = make_world([(0, 0), (2, 0), (2, 2), (0, 2)], [[(0.71, 0.63), (1.3, 0.63), (1.1, 1.29)]])
# A wall thinner than a step of the evader, in a room that is not convex.
THIN_WALL = make_world(
    [
        *[(0, 0), (2.1, 0), (2.1, 1.0), (1.2, 1.3), (1.2, 2.0), (0.62, 2.0)],
        *[(0.62, 1.1), (0.6, 1.1), (0.6, 2.0), (0, 2.0)],
    ]
)


def solve(world, grid, bound="middle", **more):
    speeds = {"pursuer_speed": 1.0, "evader_speed": RATIO}
    return solve_two_evaders(world, grid=grid, bound=bound, **(speeds | more))


def reachable(index, nodes, offsets, spacing):
    """Which nodes can be reached from which in a step, as a matrix."""
    apart = np.rint((nodes[None, :] - nodes[:, None]) / spacing).astype(int)
    near = (apart[:, :, None, :] == offsets[None, None, :, ::-1]).all(axis=-1).any(axis=-1)
    a, b = np.nonzero(near)
    near[a, b] = are_clear(index, nodes[a], nodes[b])
    return near


def solve_slowly(world, table, evader_moves, seen_at_walls):
    """Steps that every triple of nodes is worth, by whole sweeps over a dense table."""
    index = build_edge_index(world)
    places, points = table.places, table.evader_grid.points[table.evader_numbers >= 0]
    pursuer_ways = reachable(index, places, MOVES.offsets, table.pursuer_grid.spacing)
    offsets = EVADER_MOVES[evader_moves].offsets
    evader_ways = reachable(index, points, offsets, table.evader_grid.spacing)
    a, b = np.divmod(np.arange(len(places) * len(points)), len(points))
    seen = are_clear(index, places[a], points[b]).reshape(len(places), len(points))
    reach = np.hypot(*offsets.T).max()
    seen &= seen_at_walls(index, places, points, table.evader_grid.spacing, reach)
    both = seen[:, :, None] & seen[:, None, :]
    value = np.where(both, np.uint8(FOR_EVER), np.uint8(0))
    while True:
        replies = np.empty_like(value)
        for e1, e2 in itertools.product(range(len(points)), repeat=2):
            pairs = value[:, evader_ways[e1]][:, :, evader_ways[e2]]
            replies[:, e1, e2] = pairs.reshape(len(places), -1).min(axis=1)
        best = np.stack([replies[near].max(axis=0) for near in pursuer_ways])
        more = np.where(best >= table.roads.horizon, FOR_EVER, best + np.uint8(1))
        lowered = np.where(both, more, 0).astype(np.uint8)
        if (lowered == value).all():
            return value
        value = lowered


@pytest.mark.parametrize("world", [BOX, THIN_WALL], ids=["triangle", "thin wall"])
@pytest.mark.parametrize("moves", [9, 21])
def test_equals_a_slow_solution_to_the_step(world, moves, seen_at_walls):
    # Evaders so fast that their grid is coarse.
    speed = 0.8 if moves == 21 else 0.45
    table = solve(world, 0.3, evader_speed=speed, evader_moves=moves)
    expected = solve_slowly(world, table, moves, seen_at_walls)
    for p in range(len(table.places)):
        first, last = table.triples.seen_starts[p : p + 2]
        seen = table.triples.seen[first:last]
        steps = np.zeros(expected.shape[1:], dtype=int)
        steps[np.ix_(seen, seen)] = steps_of_two(table.triples, table.roads, p)
        np.testing.assert_array_equal(steps, expected[p])
    kept = (expected == FOR_EVER).sum() / (expected > 0).sum()
    assert table.share_for_ever == pytest.approx(kept)
    assert table.triples_in_sight == (expected > 0).sum()
    assert len(np.unique(expected)) > 2


def test_two_are_never_kept_longer_than_one_of_them():
    # Of the same moves on the same grids, to the step.
    world = draw_arena(Arena(obstacles=3, shortest=0.8, longest=1.2), 7)
    table = solve(world, 0.4, evader_moves=21)
    alone = solve_visibility_game(world, pursuer_speed=1.0, evader_speed=RATIO, grid=0.4)
    numbers = table.evader_numbers
    assert (alone.evader_nodes == (numbers >= 0)).all()
    shorter, pairs_kept = 0, 0
    for p in range(0, len(table.places), 3):
        one = steps_from(alone.planes, alone.rules, p)[: numbers.shape[0], : numbers.shape[1]]
        first, last = table.triples.seen_starts[p : p + 2]
        seen = table.triples.seen[first:last]
        one = one[numbers >= 0][seen]
        assert (one > 0).all()
        least = np.minimum(one[:, None], one[None, :])
        both = steps_of_two(table.triples, table.roads, p)
        assert (both <= least).all()
        # Two evaders that are one are kept as long as one, in places; others less.
        assert (np.diag(both) <= one).all()
        shorter += (both < least).sum()
        pairs_kept += (both == least).sum()
    assert shorter > 0
    assert pairs_kept > 0


def test_two_are_never_certified_for_longer_than_one_of_them_can_be_kept():
    world = draw_arena(Arena(obstacles=3, shortest=0.8, longest=1.2), 7)
    table = solve(world, 0.64, "lower", evader_moves=21)
    most = solve_visibility_game(
        world, pursuer_speed=1.0, evader_speed=RATIO, grid=0.3, bound="upper"
    )
    index, rng = build_edge_index(world), np.random.default_rng(3)
    promised, hidden = 0, 0
    for p, *evaders in rng.uniform(0, 4, (600, 3, 2)):
        if all(point_is_free(index, *x) for x in (p, *evaders)):
            least = min(most.time(p, e) for e in evaders)
            time = table.time(p, *evaders)
            assert time <= least
            promised += time > 0
            hidden += math.isfinite(least) and time > 0
    assert promised > 15
    assert hidden > 0


@pytest.mark.parametrize("bound", ["middle", "lower"])
def test_a_world_without_corners_is_kept_for_ever(bound):
    table = solve(make_world(SQUARE), 0.6, bound)
    assert table.share_for_ever == 1.0
    assert table.time([1.0, 1.0], [3.9, 0.1], [0.2, 3.7]) == math.inf
    assert np.isinf(table.times_from([1.0, 1.0], [3.9, 0.1])[table.evader_numbers >= 0]).all()


@pytest.mark.parametrize("world", [BOX, THIN_WALL], ids=["triangle", "thin wall"])
def test_the_certified_bound_is_the_best_over_moves_that_keep_sight_of_both(world):
    # An evader so fast that its grid is coarse.
    table = solve(world, 0.3, "lower", evader_speed=0.6)
    triples, roads = table.triples, table.roads
    barred, values = 0, set()
    for p in range(0, len(table.places), 5):
        seen = triples.seen[triples.seen_starts[p] : triples.seen_starts[p + 1]]
        around = roads.neighbours[roads.neighbour_starts[p] : roads.neighbour_starts[p + 1]]
        care = slice(roads.care_starts[p], roads.care_starts[p + 1])
        moves = dict(zip(roads.care_nodes[care], roads.care_moves[care], strict=True))
        steps = steps_of_two(triples, roads, p)
        for (i, e1), (j, e2) in itertools.product(list(enumerate(seen))[::3], repeat=2):
            left = int(moves.get(e1, ALL)) & int(moves.get(e2, ALL))
            kept = [q for k, q in enumerate(around) if left >> k & 1]
            best = max((worst_reply_of_two(triples, q, e1, e2) for q in kept), default=0)
            assert steps[i, j] == (FOR_EVER if best >= roads.horizon else best + 1)
            allowed = [keeps_two_by_table(roads, p, q, e1, e2) for q in around]
            assert allowed == [q in kept for q in around]
            barred += len(kept) < len(around)
            values.add(steps[i, j])
        for e in set(seen) - set(moves):
            assert keeps_two_by_table(roads, p, p, e, e)
    assert barred > 100
    assert len(values) > 2


@pytest.mark.parametrize("bound", ["middle", "lower"])
@pytest.mark.parametrize("matrix", [[[-1, 0], [0, 1]], [[0, -1], [1, 0]], [[2, 0], [0, 2]]])
def test_no_frame_is_special(bound, matrix):
    world = draw_arena(Arena(obstacles=2, shortest=0.8, longest=1.2), 4)
    scale = 2.0 if matrix[0][0] == 2 else 1.0

    def carried(points):
        return np.asarray(points) @ np.array(matrix, dtype=float).T + np.array([3.0, -7.0])

    other = make_world(carried(world.boundary), [carried(ring) for ring in world.obstacles])
    grid = 0.4 if bound == "middle" else 0.6
    mine, theirs = solve(world, grid, bound), solve(other, grid * scale, bound)
    assert theirs.triples_in_sight == pytest.approx(mine.triples_in_sight, rel=1e-3)
    rng = np.random.default_rng(0)
    points = mine.evader_grid.points[mine.evader_numbers >= 0]
    compared = 0
    while compared < 60:
        p = mine.places[rng.integers(len(mine.places))]
        e1, e2 = points[rng.integers(len(points), size=2)]
        q = theirs.nearest_place(carried(p))
        n1, n2 = (mine.evader_numbers[mine.evader_grid.nearest(e[None])][0] for e in (e1, e2))
        m1, m2 = (
            theirs.evader_numbers[theirs.evader_grid.nearest(carried(e)[None])][0] for e in (e1, e2)
        )
        steps = worst_reply_of_two(mine.triples, mine.nearest_place(p), n1, n2)
        assert worst_reply_of_two(theirs.triples, q, m1, m2) == steps
        # In either order.
        assert worst_reply_of_two(theirs.triples, q, m2, m1) == steps
        compared += steps > 0


def ends_of(index, e, heading, pace, rng):
    """Where an evader may be a step from now: on, anywhere, or where it is."""
    angles = heading + np.append(0.0, rng.uniform(-np.pi, np.pi, 3))
    ends = [e + pace * np.array([np.cos(a), np.sin(a)]) for a in angles] + [e]
    return [x for x in ends if point_is_free(index, *x) and segment_is_clear(index, *e, *x)]


def test_the_certified_pursuer_keeps_its_word():
    world = draw_arena(Arena(obstacles=3, shortest=0.8, longest=1.2), 7)
    table = solve(world, 0.36, "lower")
    index, rng = build_edge_index(world), np.random.default_rng(5)
    games, steps = 0, 0
    while games < 15:
        p, *evaders = rng.uniform(0, 4, (3, 2))
        if not all(point_is_free(index, *x) for x in (p, *evaders)):
            continue
        promised, now = table.time(p, *evaders), 0.0
        if promised < 1.0:
            continue
        games += 1
        headings = rng.uniform(0, 2 * np.pi, 2)
        while now < min(promised, 8.0):
            place, left = table.best_step(p, *evaders)
            assert now + left >= min(promised, 8.0) - 1e-9, "the bound has fallen"
            pace = RATIO * table.step
            choices = [
                ends_of(index, e, h, pace, rng) for e, h in zip(evaders, headings, strict=True)
            ]
            # They know where it goes, and play together.
            to = min(itertools.product(*choices), key=lambda ends: table.time(place, *ends))
            for k in range(2):
                lost, _ = first_loss(index, p, place, evaders[k], to[k])
                assert not np.isfinite(lost), f"lost after {now:.2f} s of {promised:.2f} s"
                way = to[k] - evaders[k]
                headings[k] = math.atan2(way[1], way[0]) if way.any() else headings[k]
            p, evaders, now = place, list(to), now + table.step
            steps += 1
    assert steps > 40


def test_the_middle_bound_plays_from_places_between_nodes():
    table = solve(BOX, 0.2)
    p, e1, e2 = [0.31, 0.33], [1.71, 0.22], [0.22, 1.73]
    place, seconds = table.best_step(p, e1, e2)
    assert np.hypot(*(place - p)) < 3.0 * 0.2
    assert seconds > 0.0
    # Behind the box.
    assert table.time(p, [1.5, 1.4], e2) == 0.0
    times = table.times_from(p, e1)
    assert np.nanmin(times) == 0.0
    assert np.isnan(times).any()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"evader_speed": 1.0}, r"`speed_ratio` must lie in \(0, 1\); got 1"),
        ({"evader_speed": 0.0}, "`evader_speed` must be positive"),
        ({"grid": -0.2}, "`grid` must be positive"),
        ({"grid": 1e-3}, "`grid` must be coarser for so large a world"),
        ({"grid": 0.02}, "`grid` must be coarser, so that the table of two evaders takes at most"),
        ({"grid": 0.3, "memory": 1e6}, "`grid` must be coarser, so that the table of two"),
        ({"bound": "best"}, "`bound` must be one of middle, lower"),
        ({"evader_moves": 5}, "`evader_moves` must be one of 9, 21"),
        ({"grid": 9.0}, "`grid` must leave the pursuer a place"),
    ],
)
def test_nonsense_is_refused(changes, message):
    options = {"grid": 0.5} | changes
    with pytest.raises(InvalidInput, match=message):
        solve(draw_arena(Arena(), 1), **options)


def test_players_in_walls_are_refused():
    table = solve(BOX, 0.2)
    with pytest.raises(InvalidInput, match="`pursuer` must be where the robot has room"):
        table.time([1.0, 0.8], [0.2, 0.2], [0.3, 0.3])
    with pytest.raises(InvalidInput, match="`evader_2` must be where the robot has room"):
        table.time([0.2, 0.2], [0.3, 0.3], [5.0, 5.0])
    with pytest.raises(InvalidInput, match="`evader_1` must be a finite point"):
        table.time([0.2, 0.2], [0.3, math.nan], [0.3, 0.3])
