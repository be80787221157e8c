"""Solved visibility games, and what is looked up in them, are as they were recorded."""

import itertools

import numpy as np
import pytest

from sightfield.systems.numerics.geometry.edge_index import build_edge_index, point_is_free
from sightfield.systems.numerics.geometry.segment_sight import segment_is_clear
from sightfield.systems.numerics.geometry.world import make_world, shrink_world
from sightfield.systems.numerics.tracking.visibility_game.board import make_board
from sightfield.systems.numerics.tracking.visibility_game.bottleneck import (
    COMMITMENT,
    bottleneck,
    committed_velocities,
    promised_steps,
    with_helpers,
)
from sightfield.systems.numerics.tracking.visibility_game.evasion import optimal_velocities
from sightfield.systems.numerics.tracking.visibility_game.guaranteed_times import (
    solve_visibility_game,
)
from sightfield.systems.numerics.tracking.visibility_game.pursuit import (
    guarantee_velocities,
    nodes_of,
    pair_worths,
    time_of_team,
    velocity_after,
    who_minds_whom,
)
from sightfield.systems.numerics.tracking.visibility_game.regain import (
    steps_to_guard,
    way_to_guard,
)
from sightfield.systems.numerics.tracking.visibility_game.responsibilities import (
    AGES,
    NOBODY,
    hardest,
    make_team_board,
    prospects,
    responsibilities,
    shared_certificate,
    team_velocities,
    watchers,
)
from sightfield.systems.numerics.tracking.visibility_game.two_evaders import solve_two_evaders

# Tables hold whole numbers, of which none may differ.
EXACTLY = {"relative": 1e-9}


def turned(points):
    """Points of a plan, in a frame in which no wall lies along an axis."""
    cosine, sine = np.cos(0.37), np.sin(0.37)
    return np.array(points) @ [[cosine, sine], [-sine, cosine]] + [0.71, -0.43]


# A room with a reflex corner, and the same with a triangle, and a wall thinner than a step.
ROOM = turned([(0, 0), (3.1, 0.1), (3.0, 1.3), (2.05, 1.27), (2.02, 2.4), (0.9, 2.55), (0.05, 2.3)])
EMPTY = make_world(ROOM)
WORLD = make_world(
    ROOM,
    [
        turned([(0.8, 0.7), (1.5, 0.85), (1.05, 1.6)]),
        turned([(2.2, 0.45), (2.25, 0.44), (2.3, 0.95), (2.27, 0.96)]),
    ],
)
INDEX = build_edge_index(WORLD)
REGIONS = {
    "pursuer_regions": shrink_world(WORLD, 0.07),
    "evader_regions": shrink_world(WORLD, 0.04),
}
SPEEDS = {"pursuer_speed": 0.8, "evader_speed": 0.37}
PERIOD = 0.11

GAMES = {
    "middle": {"grid": 0.17},
    "middle in range": {"grid": 0.23, "sight_range": 1.31, "horizon": 3.1, **REGIONS},
    "lower": {"grid": 0.37, "bound": "lower", "horizon": 30.0, "evader_speed": 0.25},
    "lower in range": {
        "grid": 0.42,
        "bound": "lower",
        "sight_range": 1.83,
        "turning_time": 0.13,
        **REGIONS,
    },
    "upper": {"grid": 0.43, "bound": "upper", **REGIONS},
}


@pytest.fixture(scope="module")
def solved():
    """A function of a game's name, which solves it once."""
    found, worlds = {}, dict.fromkeys(GAMES, WORLD) | {"lower": EMPTY}

    def solve(name):
        if name not in found:
            found[name] = solve_visibility_game(worlds[name], **SPEEDS | GAMES[name])
        return found[name]

    return solve


@pytest.fixture(scope="module")
def doubled():
    """The game of two evaders, by the middle bound."""
    return solve_two_evaders(WORLD, **SPEEDS, grid=0.3, horizon=20.0)


def places(rng, count, margin=0.09):
    """Random places where robots have room, shape (count, 2) [m]."""
    inside = [build_edge_index(part) for part in shrink_world(WORLD, margin)]
    low, high = WORLD.bounds[:2], WORLD.bounds[2:]
    drawn = (rng.uniform(low, high) for _ in itertools.count())
    free = (each for each in drawn if any(point_is_free(part, *each) for part in inside))
    return np.array(list(itertools.islice(free, count)))


def teams(seed, pursuers, evaders):
    """Positions of two teams, and who sees whom."""
    rng = np.random.default_rng(seed)
    p, e = places(rng, pursuers), places(rng, evaders)
    seen = np.array([[bool(segment_is_clear(INDEX, *a, *b)) for b in e] for a in p])
    return p.ravel(), e.ravel(), seen


@pytest.mark.parametrize("name", GAMES)
def test_a_solved_game_is_as_recorded(name, solved, as_recorded):
    table = solved(name)
    as_recorded(table, "table", **EXACTLY)
    told = "pairs", "nbytes", "horizon", "share_for_ever", "watched"
    as_recorded({each: getattr(table, each) for each in told}, "told")


@pytest.mark.parametrize("name", GAMES)
def test_what_is_looked_up_is_as_recorded(name, solved, as_recorded):
    table, rng = solved(name), np.random.default_rng(4)
    spots = places(rng, 120)
    spots[:20] = table.places[rng.choice(np.flatnonzero(table.sighted), 20)]
    nearby = places(rng, 120)
    rows, columns = np.nonzero(table.evader_nodes)
    free = build_edge_index(*shrink_world(WORLD, 0.041))
    nodes = table.evader_grid.at(rows, columns)
    nodes = nodes[[bool(point_is_free(free, *each)) for each in nodes]]
    nearby[:40] = nodes[rng.integers(len(nodes), size=40)]
    as_recorded([table.times_from(spots[k]) for k in (0, 30, 31)], "times", **EXACTLY)
    step = table.hiding_step if name == "upper" else table.best_step
    moves = [step(p, e) for p, e in zip(spots, nearby, strict=True)]
    as_recorded(np.array([[*place, time] for place, time in moves]), "steps")
    as_recorded(np.array([table.time(p, e) for p, e in zip(spots, nearby, strict=True)]), "time")
    if name == "upper":
        return
    way = np.array([0.6, 0.8])
    allowed = [
        table.best_step(p, e, lambda place, p=p: (place - p) @ way > -0.05)
        for p, e in zip(spots, nearby, strict=True)
    ]
    as_recorded(np.array([[*place, time] for place, time in allowed]), "allowed")


@pytest.mark.parametrize(
    ("bound", "moves", "evader_speed", "grid"),
    [
        ("middle", 9, 0.21, 0.4),
        ("middle", 21, 0.61, 0.4),
        ("lower", 9, 0.29, 0.6),
        ("lower", 21, 0.61, 0.5),
    ],
)
def test_a_game_of_two_evaders_is_as_recorded(bound, moves, evader_speed, grid, as_recorded):
    world = EMPTY if (bound, moves) == ("lower", 9) else WORLD
    table = solve_two_evaders(
        world,
        pursuer_speed=0.8,
        evader_speed=evader_speed,
        grid=grid,
        bound=bound,
        evader_moves=moves,
        horizon=7.3,
        **REGIONS,
    )
    as_recorded(table, "table", **EXACTLY)
    as_recorded([table.nbytes, table.triples_in_sight, table.share_for_ever], "told")
    rng = np.random.default_rng(5)
    spots = places(rng, 90).reshape(3, 30, 2)
    spots[0, :10] = table.places[rng.integers(len(table.places), size=10)]
    moves = [table.best_step(*each) for each in zip(*spots, strict=True)]
    as_recorded(np.array([[*place, time] for place, time in moves]), "steps")
    as_recorded([table.times_from(p, e) for p, e, _ in zip(*spots[:, :3], strict=True)], "times")


@pytest.mark.parametrize(("pursuers", "evaders"), [(1, 1), (3, 2), (2, 4)])
def test_pursuit_by_a_game_is_as_recorded(pursuers, evaders, solved, as_recorded):
    board, found = make_board(solved("middle")), {}
    as_recorded(board.distances, "distances", **EXACTLY)
    for seed in range(60):
        p, e, seen = teams(seed, pursuers, evaders)
        rng = np.random.default_rng([seed, 1])
        game = board, p, e, seen, rng.integers(-1, evaders, pursuers).astype(float)
        field = 0.5 * rng.normal(size=2 * pursuers)
        own = p[:2], e[:2], field[:2], 0.8
        hidden = np.array(~seen)
        for name, value in {
            "minded": who_minds_whom(board, p, nodes_of(board, e), seen, game[-1]),
            "time": time_of_team(*game),
            "velocities": guarantee_velocities(*game, field, 0.8, PERIOD),
            "at once": guarantee_velocities(*game, field, 0.8, 0.0),
            "alone": velocity_after(board, *own, PERIOD),
            "slowly": velocity_after(board, *own, 2.1),
            "worths": pair_worths(board, p, e, seen),
            "steps": steps_to_guard(board, p, e, hidden),
            "way": way_to_guard(board, *p[:2], *e[:2]),
        }.items():
            found.setdefault(name, []).append(np.ravel(value))
    as_recorded({name: np.array(values, dtype=float) for name, values in found.items()}, "found")


def test_what_certified_pursuers_do_is_as_recorded(solved, as_recorded):
    board, found = make_board(solved("lower")), []
    for seed in range(60):
        p, e, seen = teams(seed, 2, 3)
        rng = np.random.default_rng([seed, 2])
        field, own = 0.4 * rng.normal(size=4), rng.integers(-1, 3, 2)
        commitments = np.zeros((2, COMMITMENT))
        steps = promised_steps(board, p, e, seen)
        for turn in range(4):
            if turn == 2:
                own = np.array([own[0], 1])
            velocity = committed_velocities(board, p, e, seen, own, field, commitments, 3, PERIOD)
            p = p + PERIOD * velocity
            found.append(np.concatenate([steps.ravel(), velocity, commitments.ravel()]))
    as_recorded(np.array(found))


def test_matchings_and_helpers_are_as_recorded(as_recorded):
    rng, found = np.random.default_rng(7), []
    for n, m in ((2, 3), (4, 2), (4, 4), (6, 3)):
        for _ in range(25):
            worth = rng.uniform(0.5, 20.0, (n, m)) * (rng.random((n, m)) < 0.6)
            steps = np.where(rng.random((n, m)) < 0.3, np.inf, rng.uniform(1, 9, (n, m)))
            matched = bottleneck(worth)
            found.append([*matched, *with_helpers(matched, worth, steps)])
    as_recorded([each for row in found for each in row])


@pytest.mark.parametrize("with_distance", [False, True])
def test_evasion_by_a_game_is_as_recorded(with_distance, solved, as_recorded):
    board, found = make_board(solved("middle")), []
    for seed in range(80):
        p, e, seen = teams(seed, 2, 3)
        rng = np.random.default_rng([seed, 3])
        angle = rng.uniform(-np.pi, np.pi, 3)
        promised = np.where(rng.random(3) < 0.5, np.inf, rng.uniform(0, 15, 3))
        margin = rng.uniform(-0.2, 1.2, 3)
        form = np.column_stack([0.37 * np.cos(angle), 0.37 * np.sin(angle), promised, margin])
        found.append(
            optimal_velocities(board, INDEX, p, e, seen.astype(float), form, with_distance)
        )
    as_recorded(np.array(found))


def test_shares_of_evaders_are_as_recorded(solved, doubled, as_recorded):
    board, found = make_team_board(solved("middle"), doubled), {}
    for seed in range(60):
        p, e, seen = teams(seed, 2, 4)
        rng = np.random.default_rng([seed, 4])
        one, two = prospects(board, p, e, seen)
        held = rng.integers(NOBODY, 2, 4)
        owners = responsibilities(one, two, seen, held, board.steps[1])
        watching = watchers(one, two, seen, owners)
        field = 0.5 * rng.normal(size=4)
        game = board, p, e, owners, watching, field, 0.8
        for name, value in {
            "one": np.where(one < AGES, one, np.inf),
            "two": np.where(two < AGES, two, np.inf),
            "owners": owners,
            "watching": watching,
            "certificate": shared_certificate(one, two, watching),
            "hardest": hardest(one, watching),
            "velocities": team_velocities(*game, PERIOD),
            "at once": team_velocities(*game, 0.0),
        }.items():
            found.setdefault(name, []).append(np.ravel(value))
    as_recorded({name: np.array(values, dtype=float) for name, values in found.items()})


@pytest.mark.parametrize(("n", "m"), [(2, 3), (3, 5), (4, 9)])
def test_shares_of_random_prospects_are_as_recorded(n, m, as_recorded):
    rng, found = np.random.default_rng([n, m]), []
    for _ in range(20):
        seen = rng.random((n, m)) < 0.75
        one = np.where(rng.random((n, m)) < 0.3, AGES, rng.uniform(1, 30, (n, m))) * seen
        two = np.minimum(one[:, :, None], one[:, None, :]) * rng.uniform(0.1, 1, (n, m, m))
        two = np.minimum(two, two.transpose(0, 2, 1))
        held = rng.integers(NOBODY, n, m)
        owners = responsibilities(one, two, seen, held, 0.4)
        watching = watchers(one, two, seen, owners)
        found.append([*owners, *watching, *hardest(one, watching)])
        found[-1].append(shared_certificate(one, two, watching))
    as_recorded(np.array(found, dtype=float))
