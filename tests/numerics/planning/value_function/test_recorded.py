"""Tables, their parts, and the ways down them are as they were recorded."""

import math
import pickle

import numpy as np
import pytest

from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.planning.arc_words.quickest import ArcWord
from sightfield.systems.numerics.planning.arc_words.words import normalised
from sightfield.systems.numerics.planning.footprint import covering_discs
from sightfield.systems.numerics.planning.goal import Goal
from sightfield.systems.numerics.planning.trailer import Trailer
from sightfield.systems.numerics.planning.value_function import policy
from sightfield.systems.numerics.planning.value_function.descents import descents
from sightfield.systems.numerics.planning.value_function.grid import StateGrid
from sightfield.systems.numerics.planning.value_function.known_words import (
    times_by_words,
    word_by_descents,
    word_of_three_arcs,
)
from sightfield.systems.numerics.planning.value_function.near_field import first_hits, near_words
from sightfield.systems.numerics.planning.value_function.obstacles import (
    make_walls,
    room_along,
    room_of,
    shut_ways,
    with_spare,
)
from sightfield.systems.numerics.planning.value_function.policy import (
    AT_REST,
    best_word,
    follow,
    next_word,
    other_ways,
    roll_out,
)
from sightfield.systems.numerics.planning.value_function.solve import (
    carried_over,
    solve_value_function,
)
from sightfield.systems.numerics.planning.value_function.sweeps import (
    FAR,
    LIMIT,
    make_motions,
    settle_row,
    step_multiples,
    sweep_row,
    sweep_walled_row,
)
from sightfield.systems.numerics.planning.value_function.value_function import (
    look_up,
    look_up_in_reach,
    word_known,
)
from sightfield.systems.numerics.planning.value_function.walled_search import search_path

FORWARD = Trailer(speed=1.7, turn_rate=0.9, length=1.3, hitch_offset=0.25)
REVERSE = Trailer(
    speed=1.2, turn_rate=1.1, length=1.5, hitch_offset=-0.2, reverse=True, jackknife=1.3
)
ROOM = [(-4.0, -3.6), (4.5, -3.9), (4.2, 3.7), (-4.1, 3.4)]
PILLAR = [(0.9, -0.2), (1.4, 0.1), (1.0, 1.3)]

SMALL = {
    # Turned, with a beta of its own.
    "forward": (
        FORWARD,
        Goal(state=(0.5, -0.3, 0.5, 0.1), tolerance=(0.9, 1.0, 0.6, 0.7)),
        StateGrid(
            x_min=-5.0, y_min=-4.6, step=0.8, x_count=13, y_count=12, theta_count=12, beta_count=10
        ),
        None,
    ),
    # Whose nodes are mirror images of nodes.
    "reverse": (
        REVERSE,
        Goal(state=(0.5, 0.0, 0.0, 0.0), tolerance=(0.7, 0.6, 0.6, 0.7)),
        StateGrid(
            x_min=-4.3, y_min=-3.5, step=0.5, x_count=16, y_count=15, theta_count=12, beta_count=10
        ),
        None,
    ),
    "walled": (
        Trailer(speed=1.2, turn_rate=1.5, length=0.8, hitch_offset=0.1, jackknife=1.6),
        Goal(state=(2.6, 1.0, 1.2, 0.1), tolerance=(0.5, 0.45, 0.6, 0.7)),
        StateGrid(
            x_min=-4.0, y_min=-3.8, step=0.4, x_count=21, y_count=19, theta_count=12, beta_count=10
        ),
        (ROOM, PILLAR),
    ),
}


@pytest.fixture(scope="session")
def small(made_once):
    """A function of a name: the table of a case in `SMALL`, from one process for all."""

    def solve(name):
        trailer, goal, grid, walls = SMALL[name]
        world = None if walls is None else make_world(walls[0], [walls[1]])
        discs = None if walls is None else covering_discs(trailer, 0.5)

        def fill(folder):
            value = solve_value_function(trailer, goal, grid, obstacles=world, discs=discs)
            (folder / "value.pickle").write_bytes(pickle.dumps(value))

        folder = made_once(f"small-{name}", fill)
        return pickle.loads((folder / "value.pickle").read_bytes())

    return solve


@pytest.fixture(scope="session")
def states_around():
    """A function of a table, a number and a seed: states on its grid, shape (n, 4)."""

    def draw(value, count, seed):
        x_min, y_min, x_max, y_max = value.grid.bounds
        bent = min(value.trailer.jackknife, 1.2)
        low, high = (x_min, y_min, -math.pi, -bent), (x_max, y_max, math.pi, bent)
        return np.random.default_rng(seed).uniform(low, high, (count, 4))

    return draw


NAMES = pytest.mark.parametrize("name", SMALL)
OPEN = pytest.mark.parametrize("name", ["forward", "reverse"])


def finite(table):
    """A table with infinity for what is far, as it is compared."""
    return np.where(np.asarray(table) < LIMIT, table, np.inf).astype(float)


def plain(word):
    return None if word is None else [word.controls, word.durations]


@NAMES
def test_tables_are_as_recorded(name, small, as_recorded):
    value = small(name)
    as_recorded(finite(value.table), relative=2e-5)
    as_recorded(
        [value.sweeps, value.scheme, value.converged, value.warnings, value.goal], "of the solver"
    )
    as_recorded(value.residual, "residual", relative=1e-2)
    if value.walls is None:
        as_recorded(value.words.nodes, "nodes with words", relative=1e-4)
        as_recorded(value.words.counts, "arcs", relative=1e-3)
        as_recorded(value.words.durations.sum(axis=1), "durations", relative=1e-4)
    else:
        as_recorded(value.walls, "walls")


@NAMES
@pytest.mark.parametrize("cubic", [False, True])
def test_motions_and_one_row_of_a_pass_are_as_recorded(name, cubic, as_recorded):
    trailer, _, grid, walls = SMALL[name]
    multiples = step_multiples(grid, cubic=cubic)
    motions = make_motions(grid, normalised(trailer), trailer.radius, multiples)
    as_recorded(motions, "motions", relative=1e-5)
    rng = np.random.default_rng(51)
    width = grid.x_count + int(np.abs(motions.x_cells).max()) + 3
    angles, t = grid.shape[:2], 5
    table = np.full((*angles, grid.y_count, width), FAR, dtype=np.float32)
    x, y = np.meshgrid(np.arange(grid.x_count), np.arange(grid.y_count))
    for a in range(angles[0]):
        for b in range(angles[1]):
            smooth = 3 + np.sin(0.4 * x + a) + np.cos(0.3 * y - b) + 0.02 * x * y
            table[a, b, :, : grid.x_count] = smooth + 0.1 * rng.random(smooth.shape)
    holes = rng.random(table.shape) < (0.25 if walls else 0.01)
    table[holes] = FAR
    table = table.reshape(*angles, -1)
    best = np.empty(table.shape[1:], dtype=np.float32)
    if walls is None:
        sweep_row(table, t, cubic, *motions[2:], width, best)
    else:
        shut = rng.integers(0, 2**9, table.shape).astype(np.uint32)
        sweep_walled_row(table, t, cubic, shut, *motions[2:], width, best)
    as_recorded(finite(best), relative=1e-5)
    near = (2.5 + 3 * rng.random(grid.shape)).astype(np.float32)
    told = []
    for mirrored in (False, True):
        settled = table.copy()
        change = settle_row(settled, t, best, near, np.float32(3.1), width, mirrored)
        told += [float(min(change, LIMIT)), finite(settled)]
    as_recorded(told, "settled", relative=1e-5)


def test_times_near_the_goal_are_as_recorded(as_recorded):
    trailer, goal, grid, _ = SMALL["forward"]
    cart, scale = normalised(trailer), trailer.radius
    table, words = near_words(grid, cart, goal, scale, mirrored=False)
    as_recorded(finite(table), relative=2e-5)
    as_recorded([len(words.nodes), words.durations.sum(axis=1)], "words", relative=1e-4)


def test_times_near_the_goal_among_walls_are_as_recorded(as_recorded):
    trailer, goal, grid, _ = SMALL["walled"]
    walls = make_walls(make_world(ROOM, [PILLAR]), covering_discs(trailer, 0.5), grid)
    hits = first_hits(grid, normalised(trailer), goal, trailer.radius, walls)
    as_recorded(finite(hits), relative=2e-5)
    multiples = (1, 3, 4)
    shut = shut_ways(grid, normalised(trailer), walls, trailer.radius, multiples)
    bits = [(shut >> np.uint32(k) & 1).sum(axis=(2, 3)) for k in range(9)]
    as_recorded(bits, "shut ways", relative=1e-3)
    back = make_walls(make_world(ROOM, [PILLAR]), covering_discs(REVERSE, 0.4), grid)
    shut = shut_ways(grid, normalised(REVERSE), back, REVERSE.radius, (2,))
    as_recorded([(shut >> np.uint32(k) & 1).sum() for k in range(6)], "reverse", relative=1e-3)


@NAMES
def test_values_between_nodes_are_as_recorded(name, small, states_around, as_recorded):
    value = small(name)
    states = states_around(value, 400, seed=52)
    # Some on nodes and on edges of the grid, and some beyond.
    x, y, thetas, betas = value.grid.axes()
    rng = np.random.default_rng(53)
    on_nodes = np.stack([rng.choice(axis, 60) for axis in (x, y, thetas, betas)], axis=1)
    beyond = states[:20] * [1.6, 1.6, 1.0, 1.0]
    states = np.vstack([states, on_nodes, beyond])
    as_recorded(look_up(value.table, value.grid, states), "cubic", relative=2e-5)
    as_recorded(value.interpolated(states), "settled", relative=2e-5)
    as_recorded(look_up_in_reach(value, states), "in reach", relative=2e-5)


@OPEN
def test_times_and_words_down_a_table_are_as_recorded(name, small, states_around, as_recorded):
    value = small(name)
    known = value.table, value.grid, value.trailer, value.goal, value.words
    states = states_around(value, 25, seed=54)
    times = times_by_words(*known, states)
    as_recorded(times, "by words", relative=1e-4)
    as_recorded(value.looked_up(states[:6]), "looked up", relative=1e-4)
    told = []
    for state in states[6:9]:
        words = [
            word_by_descents(*known, state, thorough=True),
            word_of_three_arcs(value.grid, value.trailer, value.goal, state),
            word_known(value, state),
        ]
        told.append([None if word is None else word.time for word in words])
    as_recorded(told, "words", relative=1e-4)


@NAMES
def test_ways_down_a_table_are_as_recorded(name, small, states_around, as_recorded):
    value = small(name).moved(1.0, 2.0, 0.8) if name == "forward" else small(name)
    told = []
    for state in states_around(value, 4, seed=55):
        for width in (16, 5):
            told.append(
                [
                    [each.time, each.first_turn, each.winding, each.path.states, each.path.controls]
                    for each in descents(value, state, width)
                ]
            )
    as_recorded(told, relative=1e-4)


@OPEN
def test_the_policy_is_as_recorded(name, small, states_around, as_recorded):
    value = small(name)
    told = []
    for state in states_around(value, 1 if name == "reverse" else 3, seed=56):
        for margin in (0.0, 0.3):
            word = best_word(value, state, margin)
            told.append(None if word is None else [word.time, len(word.durations)])
        if word is None:
            continue
        for away in (0.0, 0.02) if name == "reverse" else (0.0, 0.02, 0.6):
            anew = next_word(value, state + away * np.array([1.0, -1.0, 0.5, 0.0]), word, 0.2)
            told.append(None if anew is None else anew.time)
        driven = roll_out(value, state)
        told.append([driven.promised, driven.arrived, driven.path.times[-1]])
    as_recorded(told, relative=1e-3)


def test_searches_among_walls_are_as_recorded(small, as_recorded):
    value = small("walled")
    walls = with_spare(value.walls, 0.02)
    told = []
    for start in ((-2.0, -1.0, 0.3, 0.2), (-1.5, 2.0, -0.5, -0.4), (3.0, -2.0, 2.0, 0.1)):
        found = search_path(value, walls, start, value.goal)
        told.append([found.steps, None if found.path is None else found.path.times[-1]])
        told.append(None if found.path is None else [found.path.states, found.path.controls])
        told.append([room_of(value.walls, start), room_of(walls, start)])
    as_recorded(told, relative=1e-5)
    ways = other_ways(value, (-2.0, -1.0, 0.3, 0.2))
    assert policy._spare(value, np.array([-2.0, -1.0, 0.3, 0.2]), 0.1) == pytest.approx(
        2e-3 * 0.8 + 0.1 * 0.45
    )
    as_recorded([[each.times[-1], each.states[0], each.controls] for each in ways], "other ways")


@pytest.mark.parametrize("fine", [True, False])
def test_room_along_a_word_is_as_recorded(fine, small, as_recorded):
    value = small("walled")
    start = (-2.0, -1.0, 0.3, 0.2)
    arcs = np.array([[1.2, 1.5], [1.2, 0.0], [1.2, -1.5], [-1.2, 0.6]])
    word = ArcWord(arcs, np.array([0.4, 2.3, 0.5, 0.9]))
    room = room_along(value.walls, value.trailer, start, word, fine)
    held = word.durations * np.linspace(0.9, 1.1, len(word.durations))
    rooms, slopes = room(held)
    as_recorded([rooms, slopes], relative=1e-5, absolute=1e-5)
    nudged = held.copy()
    nudged[0] += 1e-5
    np.testing.assert_allclose(slopes[:, 0], (room(nudged)[0] - rooms) / 1e-5, atol=2e-3)
    ahead = room(np.maximum(word.durations - 10.0, -1.0))[0]
    assert np.ptp(ahead) == 0.0


def test_a_cart_that_follows_with_a_delay_is_as_recorded(small, as_recorded):
    value = small("forward")
    state, before, told = np.array([-2.5, -1.0, 0.4, 0.3]), AT_REST, []
    noise = np.random.default_rng(57).normal(0.0, 0.01, (14, 4))
    for k in range(14):
        before = follow(
            value,
            before,
            state + noise[k],
            period=0.17,
            delay=0.4,
            margin=0.1,
            trust=0.4,
        )
        told.append([*before.control, *before.estimate, len(before.given)])
        state = policy.drive(value.trailer, state, *before.control, 0.17)
    as_recorded(told, relative=1e-3, absolute=1e-4)


@pytest.mark.parametrize(("step", "angles"), [(0.3, 16), (1.1, 9)])
def test_a_table_on_another_grid_is_as_recorded(step, angles, small, as_recorded):
    value = small("reverse")
    grid = StateGrid(
        x_min=-4.8,
        y_min=-3.5,
        step=step,
        x_count=14,
        y_count=13,
        theta_count=angles,
        beta_count=angles + 3,
    )
    as_recorded(finite(carried_over(value, grid)), relative=2e-5)


def test_a_warm_start_is_as_recorded(as_recorded):
    grid = StateGrid(
        x_min=-4.3, y_min=-3.5, step=1.0, x_count=8, y_count=8, theta_count=8, beta_count=8
    )
    passes = []
    goal = Goal(state=(0.5, 0.0, 0.0, 0.0), tolerance=(1.0, 1.0, 0.8, 0.8))
    first = solve_value_function(REVERSE, goal, grid, polish=0)
    warm = solve_value_function(
        REVERSE, goal, grid, polish=2, warm_start=first, progress=lambda *told: passes.append(told)
    )
    as_recorded([finite(first.table), finite(warm.table)], relative=2e-5)
    assert [number for number, _ in passes] == list(range(1, warm.sweeps + 1))
    assert passes[-1][1] == warm.residual
    as_recorded([first.sweeps, first.scheme, first.converged, warm.sweeps, warm.scheme], "passes")


def test_a_trailer_alone_is_driven_as_recorded(as_recorded):
    trailer = Trailer(speed=1.2, turn_rate=1.5, length=0.8, hitch_offset=0.1)
    told = [
        policy.drive(trailer, (1.0, 2.0, 0.4, 0.9), v, omega, held)
        for v, omega, held in ((1.2, 0.7, 2.5), (-1.2, 1.5, 3.0), (1.2, 0.0, 0.01))
    ]
    as_recorded(told)
    assert math.isclose(told[2][0], 1.0 + 0.012 * math.cos(0.4))
