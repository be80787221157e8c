"""Plans by extremals."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.planning.dubins import dubins_paths
from sightfield.systems.numerics.planning.extremals.planner import plan_by_extremals
from sightfield.systems.numerics.planning.extremals.primitives import plan_by_primitives
from sightfield.systems.numerics.planning.goal import Goal
from sightfield.systems.numerics.planning.minimum_time.planner import plan_by_casadi
from sightfield.systems.numerics.planning.trailer import Trailer

STARTS = st.tuples(st.floats(-4, 4), st.floats(-4, 4), st.floats(-3.1, 3.1), st.floats(-1.2, 1.2))
ORIGIN = (0.0, 0.0, 0.0, 0.0)
CIRCLE = (-1.961, -0.439, 0.029, 0.128)
MIDDLE = (-1.157, 0.153, 1.667, 0.982)


def planned(start, goal=(4.0, 4.0, 0.0, 0.0), tolerance=0.0, trailer=None):
    question = Goal(state=goal, tolerance=(0, 0, 0, tolerance))
    return plan_by_extremals(trailer or Trailer(), start, question)


@pytest.mark.parametrize(
    ("tolerance", "known"),
    [
        (math.inf, 4.46243),
        (0.5, 4.592),
        (0.251, 5.100),
        (0.1255, 5.492),
        (0.05, 5.780),
        (0.01, 5.948),
        (0.0, 5.9914),
    ],
)
def test_the_thesis_case_takes_the_known_times(tolerance, known):
    plan = planned((1, 1, 0, 0), tolerance=tolerance)
    assert plan.converged
    assert plan.time == pytest.approx(known, abs=6e-4)
    assert plan.notes["pontryagin_holds"]
    assert max(plan.goal.miss(plan.path.states[-1])) < 1e-9


def test_the_thesis_case_turns_left_along_a_singular_arc_right_and_left():
    letters = [arc[0] for arc in planned((1, 1, 0, 0)).notes["arcs"].split(", ")]
    assert letters == ["L", "M", "R", "L"]


@pytest.mark.parametrize(
    "start", [(1, 1, 0, 0), (2, 4, 0, 0), (0, 0, 0, 0), (-8, 0, 0, 0), (3, 1, 2.5, 0.8)]
)
def test_the_controls_drive_what_the_path_says(start, assert_plan_obeys):
    # Turn rates along the singular arc are held from sample to sample.
    assert_plan_obeys(Trailer(), start, planned(start), tolerance=3e-6)


# Figure 3.10: goals four up, and so many times four along.
@pytest.mark.parametrize("ratio", [0.5, 1.0, 1.5, 2.0, 2.5, 3.0])
def test_casadi_finds_the_same_time(ratio):
    goal = Goal(state=(4 * ratio, 4.0, 0.0, 0.0))
    ours = plan_by_extremals(Trailer(), ORIGIN, goal)
    theirs = plan_by_casadi(Trailer(), ORIGIN, goal)
    assert ours.converged
    assert theirs.converged
    assert ours.time == pytest.approx(theirs.time, abs=1e-4)


@settings(max_examples=50)
@given(start=STARTS, tolerance=st.sampled_from([0.0, 0.1, 0.4, math.inf]))
def test_every_plan_ends_at_its_goal_and_beats_no_lower_bound(start, tolerance):
    plan = planned(start, ORIGIN, tolerance)
    assert plan.converged
    assert plan.residual < 1e-9
    assert max(plan.goal.miss(plan.path.states[-1])) < 1e-8
    assert plan.time >= dubins_paths(start[:3], ORIGIN[:3], 1.0)[0].length - 1e-9


@settings(max_examples=50)
@given(start=STARTS)
def test_primitives_are_never_quicker(start):
    goal = Goal(state=ORIGIN, tolerance=(0, 0, 0, 0.251))
    extremal = plan_by_extremals(Trailer(), start, goal)
    primitive = plan_by_primitives(Trailer(), start, goal)
    assert extremal.time <= primitive.time + 1e-9


@settings(max_examples=50)
@given(start=STARTS)
def test_the_mirrored_question_takes_the_same_time(start):
    x, y, theta, beta = start
    left = planned(start, ORIGIN)
    right = planned((x, -y, -theta, -beta), ORIGIN)
    assert left.time == pytest.approx(right.time, abs=1e-6)


@settings(max_examples=20)
@given(x=st.floats(-9, 9), y=st.floats(-9, 9), turn=st.floats(-3, 3))
def test_the_question_may_be_moved_turned_and_scaled(x, y, turn):
    trailer = Trailer(speed=3.0, turn_rate=1.5, length=2.0)
    east, north = math.cos(turn), math.sin(turn)
    goal = (x + 6 * (east - north), y + 6 * (north + east), turn, 0.0)
    plan = planned((x, y, turn, 0), goal, trailer=trailer)
    assert plan.time * 1.5 == pytest.approx(planned((1, 1, 0, 0)).time, abs=1e-7)
    assert plan.path.states[-1] == pytest.approx(goal, abs=1e-7)
    assert plan.path.states[0] == pytest.approx((x, y, turn, 0))


@pytest.mark.parametrize(
    ("start", "arcs", "longest"),
    [
        # A whole circle, and more, turns the trailer about.
        pytest.param(CIRCLE, 3, math.tau, id="circle"),
        pytest.param(MIDDLE, 5, math.pi, id="singular arc between four turns"),
    ],
)
def test_words_that_few_starts_have_are_found(start, arcs, longest):
    goal = Goal(state=ORIGIN)
    plan = plan_by_extremals(Trailer(), start, goal)
    durations = [float(arc[1:]) for arc in plan.notes["arcs"].split(", ")]
    assert len(durations) >= arcs
    assert max(durations) > longest
    assert plan.time <= plan_by_casadi(Trailer(), start, goal).time + 1e-4


def test_time_grows_as_the_tolerance_shrinks():
    times = [planned((0, 2, 1.0, 0.3), tolerance=width).time for width in (1.0, 0.3, 0.1, 0.0)]
    assert np.all(np.diff(times) >= 0)
    assert times[-1] > times[0]


def test_a_start_at_the_goal_is_a_plan_of_no_time():
    plan = planned(ORIGIN, ORIGIN)
    assert plan.converged
    assert plan.time == 0


@pytest.mark.parametrize("trailer", [Trailer(length=2.0), Trailer(hitch_offset=0.3)])
def test_other_trailers_are_declined(trailer):
    plan = planned((1, 1, 0, 0), trailer=trailer)
    assert plan.status.startswith("not applicable")
    assert not plan.converged


def test_the_jackknife_limit_is_kept_or_the_plan_declined():
    limited = planned((1, 1, 0, 0), trailer=Trailer(jackknife=0.2))
    assert not limited.converged
    assert limited.time == math.inf


def test_a_trailer_that_may_reverse_is_told_that_it_does_not():
    plan = planned((1, 1, 0, 0), trailer=Trailer(reverse=True))
    assert "forwards only" in plan.status
    assert plan.time == pytest.approx(5.99137, abs=1e-5)


def test_a_start_without_four_numbers_is_refused():
    with pytest.raises(InvalidInput, match="start"):
        planned((1, 1, 0))


def test_a_first_turn_against_the_shortest_car_path_is_found():
    goal = Goal(state=ORIGIN, tolerance=(0, 0, 0, 0.251))
    plan = plan_by_extremals(Trailer(), (-2.081, 0.981, -0.897, 0.563), goal)
    assert plan.notes["arcs"].startswith("R")
    assert dubins_paths((-2.081, 0.981, -0.897), ORIGIN[:3], 1.0)[0].word == "LSL"
    assert plan.time == pytest.approx(2.5988, abs=3e-3)
