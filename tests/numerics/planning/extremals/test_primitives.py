"""The thesis's path of primitives."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.planning.extremals.primitives import plan_by_primitives
from sightfield.systems.numerics.planning.goal import Goal
from sightfield.systems.numerics.planning.trailer import Trailer

STARTS = st.tuples(st.floats(-4, 4), st.floats(-4, 4), st.floats(-3.1, 3.1), st.floats(-1.5, 1.5))


def planned(start, tolerance, goal=(4.0, 4.0, 0.0, 0.0), trailer=None):
    question = Goal(state=goal, tolerance=(0, 0, 0, tolerance))
    return plan_by_primitives(trailer or Trailer(), start, question)


@given(start=STARTS, tolerance=st.floats(0.05, 0.5))
def test_the_path_drives_to_the_goal(start, tolerance):
    plan = planned(start, tolerance)
    assert plan.converged
    assert plan.residual < 1e-9
    assert abs(plan.notes["beta_final"]) <= tolerance + 1e-9


@pytest.mark.parametrize("start", [(1, 1, 0, 0), (0, 3, 2.0, -0.4), (5, 5, -3.0, 1.0)])
def test_the_controls_drive_what_the_path_says(start, assert_plan_obeys):
    assert_plan_obeys(Trailer(), start, planned(start, 0.251))


def test_parallel_start_and_goal_have_equal_arcs():
    first, second = planned((1, 1, 0, 0), 0.251).notes["central_angles"]
    assert first == pytest.approx(second, abs=1e-12)
    assert first < math.pi


def test_with_beta_free_it_is_the_shortest_car_path():
    assert planned((1, 1, 0, 0), math.inf).time == pytest.approx(4.46243, abs=1e-5)


def test_no_central_angle_of_the_thesis_does_better():
    # Equal arcs: 2 (1 - cos g) + s sin g = 3 across, 2 sin g + s cos g + last = 3 along.
    best = math.inf
    for g in np.linspace(0.01, math.pi - 0.01, 20001):
        line = (3 - 2 * (1 - math.cos(g))) / math.sin(g)
        last = 3 - 2 * math.sin(g) - line * math.cos(g)
        if min(line, last) < 0:
            continue
        beta = 2 * math.atan(g / (g + 2))
        beta = 2 * math.atan(math.tan(beta / 2) * math.exp(-line))
        # A right turn moves 1 + tan(beta/2) to its reciprocal plus g/2, inverted.
        beta = 2 * math.atan(1 / (1 / (1 + math.tan(beta / 2)) + g / 2) - 1)
        beta = 2 * math.atan(math.tan(beta / 2) * math.exp(-last))
        if abs(beta) <= 0.251:
            best = min(best, 2 * g + line + last)
    time = planned((1, 1, 0, 0), 0.251).time
    assert best - 1e-3 < time <= best


def test_it_takes_longer_the_nearer_beta_is_to_come():
    times = [planned((1, 1, 0, 0), tolerance).time for tolerance in (math.inf, 0.5, 0.251, 0.05)]
    assert np.all(np.diff(times) > 0)


@settings(max_examples=25)
@given(start=STARTS)
def test_the_mirrored_question_takes_the_same_time(start):
    x, y, theta, beta = start
    left = planned((x, y, theta, beta), 0.2, goal=(0, 0, 0, 0))
    right = planned((x, -y, -theta, -beta), 0.2, goal=(0, 0, 0, 0))
    assert left.time == pytest.approx(right.time, rel=1e-6)


def test_the_question_may_be_moved_turned_and_scaled():
    trailer = Trailer(speed=3.0, turn_rate=1.5, length=2.0)
    turn = 2.0
    east, north = math.cos(turn), math.sin(turn)
    goal = (10 + 6 * (east - north), -5 + 6 * (north + east), turn, 0.0)
    plan = planned((10, -5, turn, 0), 0.251, goal=goal, trailer=trailer)
    assert plan.time * 1.5 == pytest.approx(planned((1, 1, 0, 0), 0.251).time)
    assert plan.path.states[-1, :3] == pytest.approx(goal[:3])


def test_exactly_is_asked_in_vain_but_along_the_goals_own_line():
    assert planned((1, 1, 0, 0), 0.0).status.startswith("not applicable: beta is approached")
    straight = planned((1, 4, 0, 0), 0.0)
    assert straight.time == pytest.approx(3)
    assert straight.path.controls[:, 1] == pytest.approx(0)


@pytest.mark.parametrize("trailer", [Trailer(length=2.0), Trailer(hitch_offset=0.3)])
def test_other_trailers_are_declined(trailer):
    plan = planned((1, 1, 0, 0), 0.2, trailer=trailer)
    assert plan.status.startswith("not applicable")
    assert not plan.converged
    assert plan.path is None


def test_a_jackknife_is_declined():
    plan = planned((1, 1, 0, 0), 0.251, trailer=Trailer(jackknife=0.3))
    assert "jackknife" in plan.status
    assert not plan.converged


def test_a_start_without_four_numbers_is_refused():
    with pytest.raises(InvalidInput, match="start"):
        planned((1, 1, 0), 0.2)
    with pytest.raises(InvalidInput, match="start"):
        planned((1, 1, 0, math.nan), 0.2)
