"""The way down a table, in the open and among walls."""

import math
from dataclasses import replace

import numpy as np
import pytest

from sightfield.systems.numerics.planning.arc_words.quickest import ArcWord, word_path
from sightfield.systems.numerics.planning.arc_words.shortened import after, end_of
from sightfield.systems.numerics.planning.footprint import (
    covering_discs,
    deepest_overlap,
    path_overlap,
)
from sightfield.systems.numerics.planning.goal import THESIS_TOLERANCE, Goal
from sightfield.systems.numerics.planning.minimum_time.planner import plan_by_casadi
from sightfield.systems.numerics.planning.plan import driven_path
from sightfield.systems.numerics.planning.planners.from_table import grid_within
from sightfield.systems.numerics.planning.planners.polished import plan_polished
from sightfield.systems.numerics.planning.trailer import Trailer
from sightfield.systems.numerics.planning.value_function.descents import descents
from sightfield.systems.numerics.planning.value_function.grid import StateGrid
from sightfield.systems.numerics.planning.value_function.obstacles import (
    make_walls,
    room_along,
    room_of,
)
from sightfield.systems.numerics.planning.value_function.policy import (
    AT_REST,
    HELD,
    attained_times,
    best_word,
    follow,
    next_word,
    other_ways,
    roll_out,
)
from sightfield.systems.numerics.planning.value_function.solve import solve_value_function

GOAL = Goal(state=(0.0, 0.0, 0.0, 0.0), tolerance=THESIS_TOLERANCE)


def random_starts(count, seed):
    rng = np.random.default_rng(seed)
    return rng.uniform([-4, -4, -np.pi, -1.5], [4, 4, np.pi, 1.5], (count, 4))


def test_it_arrives_as_soon_as_what_is_polished(solved):
    value = solved().moved(1.0, -2.0, 0.7)
    goal = Goal(state=(1.0, -2.0, 0.7, 0.0), tolerance=THESIS_TOLERANCE)
    for start in goal.from_frame(random_starts(6, 31)):
        driven = roll_out(value, start)
        assert driven.arrived
        assert goal.contains(driven.path.states[-1])
        best = plan_polished(Trailer(), start, goal, value=value).time
        assert driven.path.times[-1] <= best * 1.002
        pieces = [
            (*control, time)
            for control, time in zip(
                driven.path.controls.tolist(), np.diff(driven.path.times), strict=True
            )
        ]
        end = driven_path(Trailer(), start, pieces, 0.02).states[-1]
        assert max(goal.miss(end)) < 1e-6


def test_attained_times_are_those_of_paths_and_not_errors_of_the_table(solved):
    """Whatever the table promises, a path takes as long; and none is quicker, by polishing."""
    value, starts = solved(polish=8), random_starts(6, 47)
    times = attained_times(value, starts.reshape(2, 3, 4))
    assert times.shape == (2, 3)
    driven = [roll_out(value, each).path.times[-1] for each in starts]
    assert times.ravel() == pytest.approx(driven, rel=1e-9)
    best = np.array([plan_polished(Trailer(), each, GOAL, value=value).time for each in starts])
    assert np.abs(times.ravel() / best - 1).max() < 1e-3
    promised = value.interpolated(starts)
    assert np.median(np.abs(promised / best - 1)) > 1e-3


def test_attained_times_are_zero_in_the_box_and_infinite_where_no_way_is_known(solved):
    value = solved()
    assert attained_times(value, (0.1, -0.1, 0.2, 0.0)) == 0
    blank = replace(value, table=np.full_like(value.table, np.inf), trailer=Trailer(jackknife=0.1))
    assert attained_times(blank, (0.0, 3.0, 0.0, 0.0)) == math.inf


@pytest.mark.parametrize("planner", ["roll-out", "polished"])
def test_a_channel_that_descents_miss_is_taken(solved, planner):
    """The box can just be entered by a left, a straight and a right: 2.2 s, and not 7.9 round."""
    value, start = solved(), (-1.73587115, -0.87310687, -0.51699414, -0.14721871)
    if planner == "polished":
        time = plan_polished(Trailer(), start, GOAL, value=value).time
    else:
        time = roll_out(value, start).path.times[-1]
    assert time == pytest.approx(2.16415, abs=1e-4)
    # No descent of the table finds it.
    assert descents(value, start)[0].time > 7


def test_a_coarse_table_serves_nearly_as_well(solved):
    """The table chooses the word; how long it takes is no matter of the table's errors."""
    one, other = (solved(step, wide=True, polish=None) for step in (0.4, 0.2))
    times = np.array(
        [
            [roll_out(value, start).path.times[-1] for value in (one, other)]
            for start in random_starts(12, 32)
        ]
    )
    assert np.median(np.abs(times[:, 0] / times[:, 1] - 1)) < 1e-4


def test_the_jackknife_limit_is_kept():
    cart = Trailer(jackknife=0.9)
    value = solve_value_function(
        cart, Goal(state=GOAL.state, tolerance=(0.4, 0.4, 0.55, 0.55)), StateGrid.of_step(0.4)
    )
    for start in random_starts(8, 33) * [1, 1, 1, 0.5]:
        driven = roll_out(value, start)
        if driven.arrived:
            assert np.abs(driven.path.states[:, 3]).max() < 0.9 + 1e-6


def test_a_word_is_kept_while_it_leads_into_the_box(solved):
    value, start = solved(), (-3.0, 1.0, 0.5, 0.2)
    word = best_word(value, start, 0.1)
    later = end_of(value.trailer, start, ArcWord(word.controls[:1], word.durations[:1] / 2))
    left = after(word, word.durations[0] / 2)
    assert next_word(value, later, left, 0.1) is left
    # Pushed aside, it keeps the controls and changes their durations.
    pushed = later + np.array([0.0, 0.08, 0.0, 0.0])
    anew = next_word(value, pushed, left, 0.1)
    assert GOAL.contains(end_of(value.trailer, pushed, anew))
    assert anew.time < left.time + 0.3
    # Put elsewhere, it takes another word.
    elsewhere = np.array([2.0, -2.0, 3.0, 0.0])
    assert GOAL.contains(end_of(value.trailer, elsewhere, next_word(value, elsewhere, left, 0.1)))


def test_at_the_goal_it_stands_and_keeps_standing(solved):
    value = solved()
    there = next_word(value, (0.15, 0.0, 0.0, 0.0), None, 0.1)
    assert not len(there.durations)
    assert not len(next_word(value, (0.19, 0.0, 0.0, 0.0), there, 0.1).durations)
    assert len(next_word(value, (0.21, 0.0, 0.0, 0.0), there, 0.1).durations)


def test_measurements_are_filtered_by_where_the_controls_lead(solved):
    """A step of the measurements is believed by and by; without noise they stay as they are."""
    value = solved()
    for delay in (0.0, 0.05, 0.1):
        options = {"period": 0.05, "delay": delay, "trust": 0.25}
        states, following = [np.array([-3.0, 1.0, 0.5, 0.2])] * 3, AT_REST
        late = round(delay / 0.05)
        for _ in range(30):
            following = follow(value, following, states[-1 - late], **options)
            np.testing.assert_allclose(following.estimate, states[-1 - late], atol=1e-9)
            held = ArcWord(following.control[None], np.array([0.05]))
            states.append(end_of(value.trailer, states[-1], held))
        pushed = states[-1 - late] + np.array([0.0, 0.04, 0.0, math.tau])
        following = follow(value, following, pushed, **options)
        expected = states[-1 - late] + np.array([0.0, 0.01, 0.0, 0.0])
        np.testing.assert_allclose(following.estimate, expected, atol=1e-9)


def test_without_a_promise_there_is_no_word(solved):
    assert best_word(solved(), (90.0, 0.0, 0.0, 0.0)) is None
    assert next_word(solved(), (90.0, 0.0, 0.0, 0.0), None) is None
    asked = follow(solved(), AT_REST, (90.0, 0.0, 0.0, 0.0), period=0.1)
    np.testing.assert_array_equal(asked.control, [0.0, 0.0])


def test_a_late_measurement_is_carried_on_by_the_controls_given(solved):
    """Followed with a delay that is known, the way is the one without a delay."""
    value, period = solved(), 0.07
    start = np.array([-3.0, 1.0, 0.5, 0.2])
    ways = []
    for delay in (0.0, 0.1):
        following, controls = AT_REST, []
        # Samples 0.01 apart; it stands until the first control acts.
        states = [start] * 11
        for step in range(60):
            measured = states[7 * step] if delay else states[-1]
            following = follow(value, following, measured, period=period, delay=delay)
            controls.append(following.control)
            held, state = following.control[None], states[-1]
            words = [ArcWord(held, np.array([0.01 * k])) for k in range(1, 8)]
            states += [end_of(value.trailer, state, word) for word in words]
        ways.append(np.array(controls))
        assert GOAL.contains(states[-1])
    np.testing.assert_allclose(ways[0], ways[1], atol=1e-6)


@pytest.mark.parametrize("reverse", [False, True])
def test_backwards_too(solved, reverse):
    word = best_word(solved(reverse=reverse, polish=0), (1.0, 0.0, 0.0, 0.0))
    if reverse:
        np.testing.assert_allclose(word.controls, [[-1.0, 0.0]])
        assert word.time == pytest.approx(0.8, abs=1e-4)
    else:
        assert word.time > 4


def test_the_margin_is_given_up_rather_than_the_entry(solved):
    """A box that can only just be entered at its edge is, before the cart comes round again."""
    value = solved()
    start = (-2.0, 0.19, 0.0, 0.0)
    assert best_word(value, start, 0.9).time < best_word(value, start).time + 0.5
    narrow = replace(value, trailer=replace(value.trailer, jackknife=0.05))
    word = best_word(narrow, start, 0.5)
    assert word is not None
    assert word.time < 2.5


CART = Trailer()


@pytest.fixture(scope="module")
def rows(standing_rows):
    """A coarse table behind a wall of crop, and where it stands."""
    world, start, goal = standing_rows
    grid = grid_within(world, CART, goal, 0.3)
    return solve_value_function(CART, goal, grid, obstacles=world), world, start


def test_room_is_what_the_polygons_leave(standing_rows):
    world, _, goal = standing_rows
    cart = Trailer(length=1.2, hitch_offset=0.15, speed=1.5, turn_rate=1.25)
    discs = covering_discs(cart)
    walls = make_walls(world, discs, grid_within(world, cart, goal, 0.2), 4)
    start = (2.0, 1.7, 0.6, -0.4)
    turns = np.array([[1.5, 1.25], [1.5, -1.25], [1.5, 0.0]])
    word = ArcWord(turns, np.array([0.5, 0.9, 1.4]))
    room = room_along(walls, cart, start, word)
    rooms, slopes = room(word.durations)
    path = word_path(cart, start, word)
    # A corner, or the middle between walls, is off by less than the raster.
    assert rooms.min() == pytest.approx(-path_overlap(world, discs, path, cart), abs=0.01)
    last = end_of(cart, start, word)
    assert rooms[-1] == pytest.approx(room_of(walls, last), abs=1e-12)
    for k in range(3):
        nudge = 1e-5 * np.eye(3)[k]
        rise = (room(word.durations + nudge)[0] - room(word.durations - nudge)[0]) / 2e-5
        # But where the nearest wall is another, or another disc is the nearest.
        assert np.quantile(np.abs(slopes[:, k] - rise), 0.9) < 1e-4
        assert np.abs(rise).max() > 0.1


@pytest.mark.parametrize("start", [(6.0, 2.6, 0.0, 0.0), (9.0, 4.0, 1.5, 0.3)])
def test_it_drives_as_quickly_as_the_programme_beside_it(rows, depth_in_walls, start):
    value, world, _ = rows
    driven = roll_out(value, start)
    assert driven.arrived
    assert value.goal.contains(driven.path.states[-1])
    assert depth_in_walls(world, driven.path) < 1e-3
    beside = plan_by_casadi(CART, start, value.goal, seeds=[driven.path], obstacles=world)
    assert driven.path.times[-1] <= beside.time * 1.005


def test_it_arrives_by_late_and_noisy_measurements_without_touching(rows):
    value, world, start = rows
    rng, period = np.random.default_rng(5), 0.05
    noise = [0.005, 0.005, math.radians(0.5), math.radians(0.5)]
    states, following, pieces = [np.array(start)] * 2, AT_REST, []
    for _ in range(400):
        measured = states[-2] + noise * rng.normal(size=4)
        options = {"period": period, "delay": period, "margin": 0.1, "trust": 0.3}
        following = follow(value, following, measured, **options)
        if not following.control.any() and value.goal.contains(states[-1]):
            break
        held = ArcWord(following.given[-2:][:1], np.array([period]))
        pieces.append((*held.controls[0], period))
        states.append(end_of(CART, states[-1], held))
    assert value.goal.contains(states[-1])
    path = driven_path(CART, start, pieces, period / 8)
    assert path.states[-1] == pytest.approx(states[-1], abs=1e-6)
    assert deepest_overlap(world, covering_discs(CART), path.states) < 0.0
    assert period * len(states) < 1.05 * roll_out(value, start).path.times[-1] + 0.2


def test_other_ways_among_walls_begin_with_each_control_and_end_in_the_box(standing_rows):
    world, _, goal = standing_rows
    cart = Trailer(turn_rate=0.8)
    value = solve_value_function(cart, goal, grid_within(world, cart, goal, 0.3), obstacles=world)
    start = (6.0, 2.6, 0.4, 0.3)
    ways = other_ways(value, start)
    firsts = set()
    for way in ways:
        assert tuple(way.states[0]) == start
        assert max(value.goal.miss(way.states[-1])) < 1e-6
        held = float(way.times[np.argmax(np.diff(way.controls[:, 1], append=np.nan) != 0) + 1])
        assert held >= min(HELD) / cart.turn_rate - 1e-9
        firsts.add(tuple(way.controls[0].tolist()))
    assert firsts == {(1.0, -0.8), (1.0, 0.0), (1.0, 0.8)}
    times = [float(way.times[-1]) for way in ways]
    # They differ, and are worth a try: one is nearly as quick as the table says.
    assert 0.9 * value.time_to_go(start) < min(times) < 1.3 * value.time_to_go(start)
    assert max(times) > 1.05 * min(times)
