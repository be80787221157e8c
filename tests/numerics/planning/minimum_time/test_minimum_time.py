"""Minimum-time paths of the cart by direct transcription: known times, symmetries, bounds."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.planning.arc_words.candidates import drawn_words
from sightfield.systems.numerics.planning.arc_words.quickest import ArcWord, word_path
from sightfield.systems.numerics.planning.arc_words.shortened import end_of
from sightfield.systems.numerics.planning.car_paths import dubins_paths, reeds_shepp_paths
from sightfield.systems.numerics.planning.goal import THESIS_TOLERANCE, Goal
from sightfield.systems.numerics.planning.minimum_time.planner import plan_by_casadi
from sightfield.systems.numerics.planning.minimum_time.problem import Problem, resampled
from sightfield.systems.numerics.planning.trailer import Trailer, trailer_rates

CART = Trailer()
FREE_BETA = (0.0, 0.0, 0.0, math.inf)
ORIGIN = Goal(state=(0.0, 0.0, 0.0, 0.0))
STARTS = st.tuples(
    st.floats(-4, -1), st.floats(-4, 4), st.floats(-math.pi, math.pi), st.floats(-1.2, 1.2)
)


def driven_end(plan, trailer):
    """Where the plan's controls lead by many small steps of the midpoint rule."""
    state = plan.path.states[0]
    for (v, omega), step in zip(plan.path.controls, np.diff(plan.path.times), strict=True):
        for _ in range(40):
            k1 = np.array(trailer_rates(state[2], state[3], v, omega, trailer))
            half = state + step / 80 * k1
            state = state + step / 40 * np.array(trailer_rates(half[2], half[3], v, omega, trailer))
    return state


@pytest.mark.parametrize(
    ("tolerance", "time"),
    [
        (FREE_BETA, 4.46243),
        ((0.0, 0.0, 0.0, 0.251), 5.100),
        (THESIS_TOLERANCE, 4.3476),
        ((0.0, 0.0, 0.0, 0.0), 5.9914),
    ],
    ids=["beta free", "beta within a cell", "box of a cell", "point"],
)
def test_the_thesis_case_takes_the_known_time(tolerance, time):
    goal = Goal(state=(4.0, 4.0, 0.0, 0.0), tolerance=tolerance)
    plan = plan_by_casadi(CART, (1.0, 1.0, 0.0, 0.0), goal)
    assert plan.converged
    assert plan.time == pytest.approx(time, abs=1e-3)
    assert max(goal.miss(plan.path.states[-1])) < 1e-8


@pytest.mark.parametrize("length", [0.04, 5.0])
def test_few_intervals_lead_into_the_goal_for_stiff_and_slow_trailers_too(length):
    cart = Trailer(speed=2.0, turn_rate=0.5, length=4 * length, hitch_offset=0.3 * length)
    goal = Goal(state=(3.0, -2.0, 1.9, 0.0), tolerance=(0.8, 0.8, 0.251, 0.251))
    start = (-12.0, 20.0, 0.4, -0.9)
    plan = plan_by_casadi(cart, start, goal, intervals=12)
    assert plan.converged
    end = end_of(cart, start, ArcWord(plan.path.controls, np.diff(plan.path.times)))
    assert max(goal.miss(end)) < 1e-7


@settings(max_examples=4)
@given(STARTS)
def test_its_controls_drive_the_cart_to_the_goal_within_bounds(start):
    plan = plan_by_casadi(CART, start, ORIGIN)
    assert plan.converged
    assert max(ORIGIN.miss(driven_end(plan, CART))) < 1e-4
    assert np.abs(plan.path.controls[:, 1]).max() <= CART.turn_rate
    assert (plan.path.controls[:, 0] == CART.speed).all()
    assert plan.path.times[-1] == plan.time


@settings(max_examples=4)
@given(STARTS)
def test_no_path_is_shorter_than_dubins_and_with_beta_free_none_is_longer(start):
    bound = dubins_paths(start[:3], (0.0, 0.0, 0.0), 1.0)[0].length
    free = plan_by_casadi(CART, start, Goal(state=ORIGIN.state, tolerance=FREE_BETA))
    point = plan_by_casadi(CART, start, ORIGIN)
    assert free.time == pytest.approx(bound, abs=2e-3)
    assert point.time >= bound - 1e-7


@settings(max_examples=3)
@given(STARTS)
def test_the_mirrored_question_has_the_mirrored_answer(start):
    x, y, theta, beta = start
    plan = plan_by_casadi(CART, start, ORIGIN)
    mirrored = plan_by_casadi(CART, (x, -y, -theta, -beta), ORIGIN)
    assert mirrored.time == pytest.approx(plan.time, abs=1e-5)


@settings(max_examples=3)
@given(STARTS, st.floats(-math.pi, math.pi))
def test_a_turned_question_takes_as_long(start, angle):
    x, y, theta, beta = start
    c, s = math.cos(angle), math.sin(angle)
    turned = (c * x - s * y, s * x + c * y, theta + angle, beta)
    goal = Goal(state=(0.0, 0.0, angle, 0.0))
    time = plan_by_casadi(CART, start, ORIGIN).time
    assert plan_by_casadi(CART, turned, goal).time == pytest.approx(time, abs=1e-5)


def test_a_cart_twice_as_large_and_as_fast_takes_as_long():
    large = Trailer(speed=2.0, length=2.0)
    goal = Goal(state=(8.0, 8.0, 0.0, 0.0))
    plan = plan_by_casadi(large, (2.0, 2.0, 0.0, 0.0), goal)
    assert plan.time == pytest.approx(5.99137, abs=1e-4)


def test_a_hitch_behind_the_axle_is_driven_as_its_equations_say():
    cart = Trailer(hitch_offset=0.3)
    plan = plan_by_casadi(cart, (1.0, 1.0, 0.0, 0.0), Goal(state=(4.0, 4.0, 0.0, 0.0)))
    assert plan.converged
    assert max(plan.goal.miss(driven_end(plan, cart))) < 1e-4


def test_backing_up_makes_a_parallel_shift_shorter():
    goal = Goal(state=(0.0, 1.0, 0.0, 0.0), tolerance=THESIS_TOLERANCE)
    forward = plan_by_casadi(CART, (0.0, 0.0, 0.0, 0.0), goal)
    cart = Trailer(reverse=True)
    both = plan_by_casadi(cart, (0.0, 0.0, 0.0, 0.0), goal)
    assert both.converged
    assert both.time < forward.time
    end = both.path.states[-1]
    bound = reeds_shepp_paths((0.0, 0.0, 0.0), end[:3], 1.0)[0].length
    assert both.time >= bound - 1e-7
    assert np.abs(both.path.controls[:, 0]).max() <= cart.speed


def test_the_jackknife_limit_is_kept_and_costs_time():
    free = plan_by_casadi(CART, (0.0, 1.0, math.pi, 0.0), ORIGIN)
    stiff = Trailer(jackknife=0.5)
    plan = plan_by_casadi(stiff, (0.0, 1.0, math.pi, 0.0), ORIGIN)
    assert np.abs(free.path.states[:, 3]).max() > 0.5
    assert np.abs(plan.path.states[:, 3]).max() <= 0.5 + 1e-8
    assert plan.time > free.time + 0.1


def test_a_cart_at_its_goal_needs_no_time():
    plan = plan_by_casadi(CART, ORIGIN.state, ORIGIN)
    assert plan.converged
    assert plan.time == 0
    assert plan.path.states.shape == (1, 4)


def test_a_given_path_is_a_seed():
    goal = Goal(state=(4.0, 4.0, 0.0, 0.0))
    first = plan_by_casadi(CART, (1.0, 1.0, 0.0, 0.0), goal)
    again = plan_by_casadi(CART, (1.0, 1.0, 0.0, 0.0), goal, seeds=[first.path])
    assert again.notes["seeds"] == 1
    assert again.time == pytest.approx(first.time, abs=1e-4)


def test_a_run_that_is_cut_short_says_so():
    goal = Goal(state=(4.0, 4.0, 0.0, 0.0))
    plan = plan_by_casadi(CART, (1.0, 1.0, 0.0, 0.0), goal, max_iterations=2)
    assert not plan.converged
    assert plan.status == "iteration limit"
    assert plan.path is None
    assert math.isinf(plan.time)


@pytest.mark.parametrize(
    ("trailer", "start", "options", "words"),
    [
        (CART, (0.0, math.nan, 0.0, 0.0), {}, "`start` must be a finite number"),
        (CART, (0.0, 0.0, 0.0), {}, "`start` must be (x, y, theta, beta)"),
        (Trailer(jackknife=0.5), (0.0, 0.0, 0.0, 0.6), {}, "jackknife"),
        (CART, (3.0, 0.0, 0.0, 0.0), {"intervals": 1}, "`intervals` must be at least 2"),
    ],
)
def test_bad_input_is_refused_in_words(trailer, start, options, words):
    with pytest.raises(InvalidInput) as error:
        plan_by_casadi(trailer, start, ORIGIN, **options)
    assert words in str(error.value)


def test_far_guesses_that_arrive_lead_to_paths():
    """Where the time outweighs all else, the first step leaves them far from the goal."""
    cart = Trailer(speed=0.331, turn_rate=0.47, length=2.44, hitch_offset=0.365)
    goal = Goal(state=(6.58, -8.43, 0.319, 0.0), tolerance=(0.141, 0.141, 0.251, 0.251))
    start = (93.8, 18.4, 0.883, -1.39)
    problem = Problem(cart, np.array(start), goal, 100)
    words = drawn_words(cart, start, goal)
    guesses = [resampled(word_path(cart, start, word), 8, 8.0 / cart.turn_rate) for word in words]
    arrived = [problem.solve(guess).is_path for guess in guesses]
    assert np.mean(arrived) > 0.7
