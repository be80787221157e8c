"""Grids, kept tables, and the small steps of the policy and of descents, one by one."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.planning.arc_words.quickest import ArcWord
from sightfield.systems.numerics.planning.arc_words.shortened import end_of
from sightfield.systems.numerics.planning.arc_words.words import endings_of, words_of
from sightfield.systems.numerics.planning.goal import Goal
from sightfield.systems.numerics.planning.trailer import Trailer
from sightfield.systems.numerics.planning.value_function import (
    known_words,
    near_field,
    policy,
    solve,
    value_function,
)
from sightfield.systems.numerics.planning.value_function.grid import (
    StateGrid,
    grid_around,
    is_mirrored,
)
from sightfield.systems.numerics.planning.value_function.policy import Following
from sightfield.systems.numerics.planning.value_function.solve import carried_over
from sightfield.systems.numerics.planning.value_function.sweeps import FAR
from sightfield.systems.numerics.planning.value_function.value_function import ValueFunction

CART = Trailer(speed=1.7, turn_rate=0.9, length=1.3, hitch_offset=0.25, jackknife=1.2)
GRID = StateGrid(
    x_min=-2.0, y_min=-3.0, step=0.7, x_count=11, y_count=12, theta_count=12, beta_count=10
)


def table_of(seed=81, walls=None, **options):
    """A table of random times, some of them unreachable."""
    rng = np.random.default_rng(seed)
    times = (2 + 0.8 * rng.random(GRID.shape)).astype(np.float32)
    times[rng.random(times.shape) < 0.02] = np.inf
    goal = Goal(state=(0.5, -0.3, 0.5, 0.1), tolerance=(0.9, 1.0, 0.6, 0.7))
    return ValueFunction(
        table=times,
        grid=GRID,
        trailer=CART,
        goal=goal,
        scheme="cubic",
        sweeps=3,
        residual=0.1,
        converged=True,
        walls=walls,
        **options,
    )


@pytest.mark.parametrize("step", [1.0, 0.7, 0.5, 0.2, 0.1])
def test_grids_of_a_step_are_as_recorded(step, as_recorded):
    cart, goal = Trailer(speed=3.0, turn_rate=1.5), Goal(state=(1.0, 2.0, 0.4, 0.1))
    as_recorded(
        [
            StateGrid.of_step(step, (1.0, -2.0), radius=1.3),
            StateGrid.covering((-2.0, -1.0, 7.7, 3.3), step, radius=1.3),
            StateGrid.covering((0.0, 0.0, 0.1, 0.1), step),
            *(grid_around(cart, start, goal, step) for start in ((2, 3, 0, 0), (30, -17, 0, 0))),
        ]
    )
    grid = StateGrid.of_step(step)
    assert StateGrid.thesis() == StateGrid.of_step(0.2)
    assert StateGrid.fine((1.0, 2.0), radius=3.0) == StateGrid.of_step(0.1, (1, 2), radius=3)
    about = (0.0, 0.0)
    assert StateGrid.fine() == StateGrid.of_step(0.1, about, radius=1.0) == StateGrid.of_step(0.1)
    assert grid.cell == (grid.step, grid.step, grid.theta_step, grid.beta_step)
    assert grid.theta_step == pytest.approx(2 * math.pi / grid.theta_count)


def test_grids_out_of_range_are_refused():
    values = {"x_min": 0, "y_min": 0, "step": 1, "x_count": 8, "y_count": 8}
    values |= {"theta_count": 8, "beta_count": 8}
    StateGrid(**values)
    for name in ("x_count", "y_count", "theta_count", "beta_count"):
        for wrong in (7, 8.0):
            with pytest.raises(InvalidInput, match=name):
                StateGrid(**{**values, name: wrong})
    for bounds in ((0, 0, 0, 1), (0, 0, 1, 0), (0, 0, math.inf, 1), (0, 0, -1, -1)):
        with pytest.raises(InvalidInput, match="bounds"):
            StateGrid.covering(bounds, 0.5)
    for step in (0.0, 1.01):
        with pytest.raises(InvalidInput, match="grid"):
            StateGrid.of_step(step)
    with pytest.raises(InvalidInput, match="radius"):
        StateGrid.of_step(0.5, radius=0.0)
    with pytest.raises(InvalidInput, match="centre"):
        StateGrid.of_step(0.5, (0.0, math.nan))


def test_a_grid_holds_its_edge():
    x_min, y_min, x_max, y_max = GRID.bounds
    assert (x_max, y_max) == pytest.approx((5.0, 4.7))
    for x in (x_min, x_max):
        assert GRID.holds(x, 0.0)
        assert not GRID.holds(x + math.copysign(1e-9, x), 0.0)
    for y in (y_min, y_max):
        assert GRID.holds(0.0, y)
        assert not GRID.holds(0.0, y + math.copysign(1e-9, y))


@pytest.mark.parametrize(
    ("state", "mirrored"),
    [
        ((0.3, 0.5, 0.0, 0.0), True),
        ((0.3, 0.5, math.pi, math.pi), True),
        ((0.3, 0.6, 0.0, 0.0), False),
        ((0.3, 0.5, 1e-3, 0.0), False),
        ((0.3, 0.5, 0.0, 1e-3), False),
        ((1.0, 9.0, math.pi / 2, 0.0), True),
        ((1.1, 0.5, -math.pi / 2, 0.0), False),
    ],
)
def test_which_boxes_have_mirror_images(state, mirrored):
    grid = replace(GRID, x_min=-2.5, y_min=0.5 - 5.5 * 0.7)
    assert is_mirrored(grid, Goal(state=state)) is mirrored


def test_kept_tables_are_used_again(monkeypatch):
    monkeypatch.setattr(solve, "_tables", {})
    solved = []

    def stub(trailer, goal, grid, progress):
        solved.append(grid)
        return replace(table_of(), goal=goal, grid=grid)

    def asked(start, goal, trailer=CART):
        return solve.open_field_table(trailer, start, goal, 0.5, None, stub)

    radius = CART.radius
    goal = Goal(state=(1.0, 2.0, 0.5, 0.1), tolerance=(0.9, 1.0, 0.6, 0.7))

    def away(ahead, aside, goal=goal):
        return goal.from_frame([ahead * radius, aside * radius, 0.0, 0.0]).tolist()

    first = asked(away(-2.9, 2.9), goal)
    assert first.placement == pytest.approx((1.0, 2.0, 0.5))
    assert first.goal.state == (0.0, 0.0, 0.0, 0.1)
    shapes = [solved[-1].shape[2:]]
    for place in ((3.1, 1.0), (1.0, -4.6), (6.8, 0.0), (10.1, 10.1), (15.0 - 1e-9, 0.0)):
        asked(away(*place), goal)
        shapes.append(solved[-1].shape[2:])
    assert shapes == [(25, 25), (25, 31), (41, 25), (25, 53), (73, 73), (25, 73)]
    # The first is the oldest but for its use.
    other = replace(goal, state=(-4.0, 5.0, 2.5, 0.1))
    again = asked(away(-2.0, -2.0, other), other)
    assert again.placement == pytest.approx((-4.0, 5.0, 2.5))
    assert len(solved) == 6
    assert asked(away(15.1, 0.0), goal) is None
    assert asked(away(0.0, 15.1), goal) is None
    for entry in range(2):
        free = tuple(math.inf if k == entry else 0.5 for k in range(4))
        assert asked(away(1.0, 1.0), replace(goal, tolerance=free)) is None
    # Eight are kept, the most recently used.
    for beta in (0.2, 0.3, 0.4):
        asked(away(1.0, 1.0), replace(goal, state=(1.0, 2.0, 0.5, beta)))
    assert len(solved) == 9
    asked(away(-1.0, 1.0), goal)
    assert len(solved) == 9
    asked(away(3.1, 1.0), goal)
    assert len(solved) == 10


def test_a_tolerance_below_a_cell_is_widened():
    least = tuple(0.99 * cell for cell in GRID.cell)
    goal = Goal(state=(0.0, 0.0, 0.0, 0.0), tolerance=least)
    assert solve.widened(goal, GRID) == (goal, ())
    for k in range(4):
        small = tuple(width * (0.999 if n == k else 1.0) for n, width in enumerate(least))
        wide, (warning,) = solve.widened(replace(goal, tolerance=small), GRID)
        assert wide.tolerance == tuple(
            GRID.cell[n] if n == k else width for n, width in enumerate(least)
        )
        assert f"{GRID.cell[k]:.4g}" in warning
    for wrong in (Goal(state=(9, 0, 0, 0)), Goal(state=(0, 9, 0, 0))):
        with pytest.raises(InvalidInput, match="goal"):
            solve.widened(wrong, GRID)
    for tolerance in ((math.inf, 1, 1, 1), (1, math.inf, 1, 1)):
        with pytest.raises(InvalidInput, match="tolerance"):
            solve.widened(replace(goal, tolerance=tolerance), GRID)


@pytest.mark.parametrize("count", [8, 9])
def test_rows_of_negative_headings_are_mirror_images(count):
    rng = np.random.default_rng(82)
    table = rng.random((count, 10, 5, 6)).astype(np.float32)
    before = table.copy()
    near_field._reflect(table)
    for t in range(count):
        for b in range(10):
            image = table[-t % count, -b % 10, ::-1]
            np.testing.assert_array_equal(table[t, b], image)
        if 0 < 2 * t < count:
            np.testing.assert_array_equal(table[t], before[t])
    assert (table[0] <= before[0]).all()


def test_words_with_the_same_controls_are_alike():
    cart = Trailer(reverse=True)
    words = words_of(cart, 2, 1.3, 0.4)

    def controls(number):
        found = []
        while number:
            last = int(words.last[number])
            found += [] if found[-1:] == [last] else [last]
            number = int(words.roots[number])
        return tuple(found)

    for last in endings_of(cart, words, 2.0, 3.0, 0.2)[:2]:
        parts = near_field.alike(words, last)
        kinds = [{controls(number) for number in part.numbers} for part in parts]
        assert all(len(kind) == 1 for kind in kinds)
        assert len(set.union(*kinds)) == len(parts)
        assert sorted(np.concatenate([part.numbers for part in parts])) == last.numbers.tolist()
        for part in parts:
            chosen = np.searchsorted(last.numbers, part.numbers)
            np.testing.assert_array_equal(part.lengths, last.lengths[chosen])
            np.testing.assert_array_equal(part.words.ends, words.ends[part.numbers])


def place_of(turn_rate=0.9):
    return known_words._Place(-2.0, -3.0, 0.7, turn_rate)


def in_halves(state):
    return np.array([*state[:3], math.sin(state[3] / 2), math.cos(state[3] / 2)])


def test_guesses_are_means_of_the_nodes_around():
    """Linear in each direction; where the nodes differ by much, the least and a little."""
    table = table_of().table
    rng = np.random.default_rng(83)
    kinds = set()
    for state in rng.uniform([-2.0, -3.0, -7, -3], [5.0, 4.7, 7, 3], (300, 4)):
        cells = np.array(
            [
                state[2] % math.tau / math.tau * 12,
                state[3] % math.tau / math.tau * 10,
                (state[1] + 3.0) / 0.7,
                (state[0] + 2.0) / 0.7,
            ]
        )
        low = np.floor(cells).astype(int)
        part = cells - low
        nodes, weights = [], []
        for corner in np.ndindex(2, 2, 2, 2):
            at = (low + corner) % [12, 10, 1000, 1000]
            nodes.append(float(table[tuple(at)]))
            weights.append(np.prod(np.where(corner, part, 1 - part)))
        jump = not (max(nodes) - min(nodes)) * 0.9 <= 1.5
        kinds.add(jump)
        for over in (0, 1):
            found = known_words._guess(table, place_of(), in_halves(state), over)
            if jump:
                expected = min(nodes) * 0.9 + 0.3 if over else math.inf
            else:
                expected = float(np.dot(nodes, weights)) * 0.9
            assert found == pytest.approx(expected, rel=1e-5)
    assert kinds == {True, False}
    for x, y in ((-2.01, 0.0), (5.01, 0.0), (0.0, -3.01), (0.0, 4.71)):
        assert known_words._guess(table, place_of(), in_halves((x, y, 0, 0)), 1) == math.inf
    corner = in_halves((-2.0 + 10 * 0.7, -3.0 + 11 * 0.7, math.tau / 12, 2 * math.tau / 10))
    low = known_words._guess(table, place_of(), corner, 1)
    assert low <= float(table[1, 2, 11, 10]) * 0.9 + 0.3 + 1e-6


def test_nodes_around_are_those_of_the_cell_with_linear_weights():
    table = table_of().table
    rng = np.random.default_rng(84)
    nodes = np.sort(rng.choice(table.size, table.size // 2, replace=False))
    rows, weights = np.empty(16, dtype=np.int64), np.empty(16)
    axes = GRID.axes()
    for state in rng.uniform([-2.0, -3.0, -7, -3], [5.0, 4.7, 7, 3], (60, 4)):
        found = known_words._nodes_around(table, nodes, place_of(), in_halves(state), rows, weights)
        gaps = [(state[0] - axes[0]) / 0.7, (state[1] - axes[1]) / 0.7]
        for axis, angle, step in ((axes[2], state[2], 12), (axes[3], state[3], 10)):
            turned = np.remainder(angle - axis + math.pi, math.tau) - math.pi
            gaps.append(turned / math.tau * step)
        x, y, theta, beta = (np.maximum(1 - np.abs(gap), 0.0) for gap in gaps)
        expected = (theta[:, None, None, None] * beta[:, None, None] * y[:, None] * x).ravel()[
            nodes
        ]
        assert found == (expected > 0).sum()
        np.testing.assert_allclose(expected[rows[:found]], weights[:found], atol=1e-9)
        for k in range(found):
            known_words._heaviest_to(k, found, rows, weights)
        np.testing.assert_array_equal(weights[:found], np.sort(weights[:found])[::-1])
        np.testing.assert_allclose(expected[rows[:found]], weights[:found], atol=1e-9)


@pytest.mark.parametrize("over_jumps", [0, 1])
@pytest.mark.parametrize("jackknife", [1.2, math.pi])
def test_descents_on_a_slope_are_as_recorded(over_jumps, jackknife, as_recorded):
    """Times that grow with the distance, with a ridge."""
    x, y, thetas, betas = GRID.axes()
    far = np.hypot(x - 3.5, y[:, None] + 1.0)
    table = (far + 0.4 * np.sin(thetas)[:, None, None, None] + 0.2).astype(np.float32)
    table = np.broadcast_to(table, GRID.shape).copy()
    table += 0.1 * np.cos(betas)[None, :, None, None].astype(np.float32)
    table[:, :, 6, 3:9] += 4.0
    cart = replace(CART, speed=1.0, turn_rate=1.0, jackknife=jackknife, reverse=jackknife > 3)
    aim = known_words.aim_of(cart, Goal(state=(3.5, -1.0, 0.0, 0.1), tolerance=(0.5,) * 4))
    way, times, work = np.empty((128, 2)), np.empty(128), np.empty((3, 5))
    told = []
    rng = np.random.default_rng(85)
    for start in rng.uniform([-1.5, -2.5, -3, -1], [4.5, 4.2, 3, 1], (9, 4)):
        for first, only in ((-1, -1), (0, -1), (2, -1), (1, 2)):
            count = known_words._descend(
                table, place_of(1.0), start, first, only, over_jumps, aim, way, times, work
            )
            told.append([count])
            if count >= 0:
                told[-1] += [*way[:count].ravel(), *times[:count], *work[0]]
    as_recorded([np.array(each) for each in told], relative=1e-5)


def test_orders_of_controls_are_told_once():
    known = np.empty(8, dtype=np.int64)
    words = [
        [(1, 0), (1, 1)],
        [(1, 1), (1, 0)],
        [(-1, 0), (1, 1)],
        [(1, 0.3), (1, 1)],
        [(1, 0), (1, 1), (1, -1)],
    ]
    for number, word in enumerate(words):
        controls = np.array(word, dtype=float)
        assert not known_words._is_told(controls, len(word), known, number)
        assert known_words._is_told(controls, len(word), known, number + 1)
    assert known_words._is_told(np.array(words[4], float), 2, known, 5)


def test_controls_that_hold_the_limit_are_there_where_such_exist():
    for length, limit, count in (
        (1.0, math.pi, 3),
        (0.78, 0.9, 3),
        (0.79, 0.9, 5),
        (2.0, 0.9, 5),
        (1.3, 1.1, 5),
    ):
        cart = Trailer(length=length, jackknife=limit)
        assert len(known_words.word_controls(cart)) == count
    both = known_words.word_controls(Trailer(length=2.0, jackknife=0.9, reverse=True))
    held = math.sin(0.9) / 2.0
    np.testing.assert_allclose(both[6:], [(-1, -held), (-1, held), (1, -held), (1, held)])


def test_the_aim_is_a_little_narrower_than_the_box():
    goal = Goal(state=(1.0, 2.0, 0.5, 0.3), tolerance=(0.9, 1.2, math.pi, 0.5))
    aim = known_words.aim_of(CART, goal, gain=0.01, steps=7)
    radius = CART.radius
    np.testing.assert_allclose(
        aim.widths, [0.9 / radius - 1e-5, 1.2 / radius - 1e-5, math.inf, 0.5 - 1e-5]
    )
    assert (aim.beta, aim.gain, aim.steps, aim.jackknife) == (0.3, 0.01, 7, 1.2)
    assert aim.cart == (1.3 / radius, 0.25 / radius)
    usual = known_words.aim_of(CART, goal)
    assert (usual.gain, usual.steps) == (1e-5, 30)


WORD = ArcWord(np.array([[1.7, 0.9], [1.7, 0.0], [1.7, -0.9]]), np.array([0.3, 0.5, 0.4]))


@pytest.mark.parametrize(
    ("period", "mean"),
    [
        (0.2, [1.7, 0.9]),
        (0.3, [1.7, 0.9]),
        (0.5, [1.7, 0.54]),
        (1.0, [1.7, (0.27 - 0.18) / 1.0]),
        (1.5, [1.7 * 0.8, (0.27 - 0.36) / 1.5]),
    ],
)
def test_where_a_switch_falls_within_a_period_the_mean_is_held(period, mean):
    np.testing.assert_allclose(policy._mean_control(WORD, period), mean, atol=1e-12)


@pytest.mark.parametrize(("delay", "count"), [(0.0, 0), (0.1, 1), (0.2, 1), (0.35, 2), (0.6, 3)])
def test_a_state_is_carried_over_a_delay_by_what_was_given(delay, count):
    """Controls of the last periods act, the oldest of them for what is left of its period."""
    given = np.array([[1.0, 0.3], [1.2, -0.4], [1.4, 0.5]])
    state = np.array([1.0, 2.0, 0.3, 0.4])
    durations = np.full(count, 0.2)
    if count:
        durations[0] = delay - 0.2 * (count - 1)
    for known in (given, given[-1:]):
        held = np.vstack([np.zeros((3, 2)), known])[-count or 4 :]
        expected = end_of(CART, state, ArcWord(held[-count:] if count else held[:0], durations))
        found = policy._carried_on(CART, state, known, 0.2, delay)
        np.testing.assert_allclose(found, expected if count else state, atol=1e-12)


@pytest.mark.parametrize(
    ("delay", "arcs"),
    [
        (0.0, [(2, 0.2)]),
        (0.1, [(1, 0.1), (2, 0.1)]),
        (0.2, [(1, 0.2)]),
        (0.3, [(0, 0.1), (1, 0.1)]),
    ],
)
def test_a_measurement_is_weighed_against_what_was_expected(delay, arcs):
    given = np.array([[1.0, 0.3], [1.2, -0.4], [1.4, 0.5]])
    estimate = np.array([1.0, 2.0, 3.1, 0.4])
    word = ArcWord(given[[k for k, _ in arcs]], np.array([held for _, held in arcs]))
    expected = end_of(CART, estimate, word)
    measured = expected + np.array([0.1, -0.2, 0.3 - math.tau, 0.05])
    before = Following(None, given, estimate)
    found = policy._estimate(CART, before, measured, 0.2, delay, 0.3)
    np.testing.assert_allclose(found, expected + 0.3 * np.array([0.1, -0.2, 0.3, 0.05]))
    np.testing.assert_array_equal(
        policy._estimate(CART, before, measured, 0.2, delay, 1.0), measured
    )
    first = Following(None, given, None)
    np.testing.assert_array_equal(
        policy._estimate(CART, first, measured, 0.2, delay, 0.3), measured
    )


def test_a_path_is_late_that_takes_a_third_longer_and_half_a_turn():
    value = table_of()
    edge = 1.3 * 4.0 + 0.5 / 0.9
    assert not policy.is_late(value, 4.0, edge)
    assert policy.is_late(value, 4.0, edge * (1 + 1e-12))


def test_an_inner_goal_is_drawn_in_by_a_share():
    goal = Goal(state=(1, 2, 0, 0), tolerance=(1.0, 2.0, 0.5, math.inf))
    assert policy._inner(goal, 0.0) is goal
    assert policy._inner(goal, 0.25).tolerance == (0.75, 1.5, 0.375, math.inf)


def test_mirror_images_are_looked_up_on_one_side():
    grid = replace(GRID, y_min=-5.5 * 0.7)
    goal = Goal(state=(0.5, 0.0, 0.0, 0.0))
    states = np.random.default_rng(86).uniform(-2, 2, (50, 4))
    states[:10, 1] = 0.0
    states[:5, 2] = 0.0
    images = states * [1, -1, -1, -1]
    one, turned = value_function._on_one_side(grid, goal, states)
    other, back = value_function._on_one_side(grid, goal, images)
    np.testing.assert_allclose(one, other, atol=1e-12)
    assert (turned ^ back).all()
    same, none = value_function._on_one_side(GRID, replace(goal, state=(0.5, 0.1, 0, 0)), states)
    np.testing.assert_array_equal(same, states)
    assert not none.any()


def test_beyond_a_limit_and_in_the_box_times_are_settled():
    value = table_of()
    out = value._settled(
        np.array(
            [
                [2.0, 1.0, 0.5, 1.2],
                [2.0, 1.0, 0.5, 1.21],
                [2.0, 1.0, 0.5, -1.21],
                [0.5, -0.3, 0.5, 0.1],
            ]
        ),
        np.array([3.0, 3.0, 3.0, 3.0]),
    )
    np.testing.assert_array_equal(out, [3.0, math.inf, math.inf, 0.0])
    lost = value._settled(np.array([[0.5, -0.3, 0.5, 0.1]]), np.array([math.inf]))
    assert lost[0] == math.inf
    for wrong in (1.0, [1.0, 2.0, 3.0], [0.0, 0.0, 0.0, math.nan]):
        with pytest.raises(InvalidInput, match="states"):
            value.to_table(wrong)
    moved = value.moved(3.0, -2.0, 1.4)
    np.testing.assert_allclose(moved.to_table([3.0, -2.0, 1.4, 0.1]), value.goal.state, atol=1e-12)
    with pytest.raises(InvalidInput, match="goal"):
        value.moved(3.0, math.inf, 1.4)


@pytest.mark.parametrize("step", [0.3, 0.55, 0.9])
def test_a_table_carried_over_to_its_own_grid_is_itself(step):
    """Nodes are found again whatever a sum of steps was rounded to; else far ones would spread."""
    grid = StateGrid.covering((-4.8, -3.5, 2.1, 4.4), step, radius=1.3)
    rng = np.random.default_rng(5)
    table = rng.uniform(0.0, 9.0, grid.shape).astype(np.float32)
    table[rng.random(table.shape) < 0.3] = np.inf
    found = carried_over(SimpleNamespace(table=table, grid=grid), grid)
    np.testing.assert_array_equal(np.where(found < FAR, found, np.inf), table)
