"""Paths driven down a value function."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.planning.from_table.planner import plan_by_value_function
from sightfield.systems.numerics.planning.goal import THESIS_TOLERANCE, Goal
from sightfield.systems.numerics.planning.trailer import Trailer
from sightfield.systems.numerics.planning.value_function.grid import grid_around
from sightfield.systems.numerics.planning.value_function.rollout import drive

GOAL = Goal(state=(4.0, 4.0, 0.0, 0.0), tolerance=THESIS_TOLERANCE)
START = (1.0, 1.0, 0.0, 0.0)


@pytest.fixture(scope="module")
def plan():
    return plan_by_value_function(Trailer(), START, GOAL)


def test_the_thesis_case_is_driven_into_the_box(plan):
    assert plan.converged
    assert plan.status == "arrived"
    assert GOAL.miss(plan.path.states[-1]) == (0, 0, 0, 0)
    # The optimum into the box is 4.3476.
    assert 4.3475 < plan.time < 4.3476 * 1.001
    assert plan.notes["time_to_go"] == pytest.approx(4.3476, rel=0.03)


def test_the_path_obeys_the_equations_and_the_bounds(plan):
    path = plan.path
    assert np.abs(path.controls[:, 1]).max() <= 1
    assert (path.controls[:, 0] == 1).all()
    state = np.array(START)
    for control, step in zip(path.controls, np.diff(path.times), strict=True):
        state = drive(Trailer(), state, *control, step)
    np.testing.assert_allclose(state, path.states[-1], atol=1e-9)


def test_a_table_serves_another_goal(solved):
    goal = Goal(state=(-20.0, 30.0, 2.5, 0.0), tolerance=THESIS_TOLERANCE)
    x, y, theta, _ = goal.state
    start = (x - 3 * math.cos(theta), y - 3 * math.sin(theta), theta, 0.0)
    plan = plan_by_value_function(Trailer(), start, goal, value=solved())
    assert plan.status == "arrived"
    assert plan.time == pytest.approx(2.8, abs=0.1)


def test_reverse_backs_straight_into_the_goal(solved):
    goal = Goal(state=(0.0, 0.0, 0.0, 0.0), tolerance=THESIS_TOLERANCE)
    value = solved(reverse=True)
    plan = plan_by_value_function(Trailer(reverse=True), (1.0, 0.0, 0.0, 0.0), goal, value=value)
    assert plan.status == "arrived"
    assert plan.time == pytest.approx(0.8, abs=0.1)
    assert (plan.path.controls[:, 0] == -1).all()


def test_a_start_at_the_goal_takes_no_time(solved):
    goal = Goal(state=(0.0, 0.0, 0.0, 0.0), tolerance=THESIS_TOLERANCE)
    plan = plan_by_value_function(Trailer(), (0.1, 0.0, 0.0, 0.0), goal, value=solved())
    assert plan.time == 0
    assert plan.path.states.shape == (1, 4)


def test_off_the_table_is_unreachable(solved):
    goal = Goal(state=(0.0, 0.0, 0.0, 0.0), tolerance=THESIS_TOLERANCE)
    plan = plan_by_value_function(Trailer(), (9.0, 0.0, 0.0, 0.0), goal, value=solved())
    assert plan.status == "unreachable on this grid"
    assert plan.time == math.inf
    assert plan.path is None
    assert not plan.converged


def test_a_point_is_planned_for_as_a_wider_box():
    goal = Goal(state=(0.0, 0.0, 0.0, 0.0))
    plan = plan_by_value_function(Trailer(), (-3.0, 0.0, 0.0, 0.0), goal, step=0.4)
    assert not plan.converged
    assert "wider box" in plan.status
    assert "wider box" in plan.notes["warnings"][0]


def test_the_grid_grows_to_hold_the_start():
    grid = grid_around(Trailer(), (-9.0, 2.0, 0.0, 0.0), GOAL, 0.4)
    x_min, y_min, x_max, y_max = grid.bounds
    assert x_min <= -12
    assert x_min + x_max == pytest.approx(8)
    assert (y_min, y_max) == pytest.approx((-2, 10))


def test_a_table_for_something_else_is_refused(solved):
    with pytest.raises(InvalidInput, match="`value` must be for the same trailer"):
        plan_by_value_function(Trailer(reverse=True), START, GOAL, value=solved())
    with pytest.raises(InvalidInput, match="`value` must be for the same beta and tolerance"):
        plan_by_value_function(Trailer(), START, Goal(state=(0, 0, 0, 0)), value=solved())


@pytest.mark.parametrize("start", [(0, 0, 0), (math.nan, 0, 0, 0), (0, 0, 0, 2.0)])
def test_bad_starts_are_refused(start):
    with pytest.raises(InvalidInput, match="`start` must"):
        plan_by_value_function(Trailer(jackknife=1.5), start, GOAL)
