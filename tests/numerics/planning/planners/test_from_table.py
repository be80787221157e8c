"""Paths driven down a value function, and among walls, where CasADi agrees."""

import math
from functools import cache

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.planning.footprint import covering_discs, path_overlap
from sightfield.systems.numerics.planning.goal import THESIS_TOLERANCE, Goal
from sightfield.systems.numerics.planning.minimum_time.planner import plan_by_casadi
from sightfield.systems.numerics.planning.planners.from_table import (
    grid_within,
    plan_by_value_function,
    plan_from_table,
)
from sightfield.systems.numerics.planning.trailer import Trailer
from sightfield.systems.numerics.planning.value_function import near_field
from sightfield.systems.numerics.planning.value_function.grid import StateGrid, grid_around
from sightfield.systems.numerics.planning.value_function.obstacles import make_walls
from sightfield.systems.numerics.planning.value_function.policy import drive
from sightfield.systems.numerics.planning.value_function.value_function import ValueFunction

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
    value = solved(reverse=True, polish=0)
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


CART = Trailer()


@cache
def among_walls(world, start, goal):
    """What the programme says of a field; two tests ask."""
    return plan_by_casadi(CART, start, goal, obstacles=world)


@pytest.fixture(scope="module", params=["free_wall", "headland", "standing_rows"])
def walled(request):
    """A field, with what both planners say of it."""
    world, start, goal = request.getfixturevalue(request.param)
    value = plan_by_value_function(CART, start, goal, obstacles=world)
    return world, goal, value, among_walls(world, start, goal)


def test_casadi_agrees_with_the_table_within_two_percent(walled):
    _, _, value, casadi = walled
    assert casadi.converged
    assert value.notes["time_to_go"] == pytest.approx(casadi.time, rel=0.02)


def test_the_policys_one_way_leads_to_the_same_optimum_or_a_little_less(walled):
    _, _, value, casadi = walled
    assert value.converged
    assert casadi.time * (1 - 1e-3) < value.time < casadi.time * (1 + 1e-4)


def test_the_whole_cart_keeps_clear_and_arrives(walled, depth_in_walls):
    world, goal, value, casadi = walled
    for plan in (value, casadi):
        assert depth_in_walls(world, plan.path) < 1e-3
        assert max(goal.miss(plan.path.states[-1])) < 1e-6


@pytest.mark.parametrize("field", ["free_wall", "standing_rows"])
def test_a_wall_costs_time(request, field):
    world, start, goal = request.getfixturevalue(field)
    there = plan_by_casadi(CART, start, goal)
    assert among_walls(world, start, goal).time > there.time + 0.5


@pytest.mark.parametrize("planner", [plan_by_value_function, plan_by_casadi])
def test_ends_in_a_wall_are_refused(standing_rows, planner):
    world, clear, _ = standing_rows
    blocked = (6.0, 4.0, 0.0, 0.0)
    with pytest.raises(InvalidInput, match="`start` must keep the vehicle clear of walls"):
        planner(CART, blocked, Goal(state=clear), obstacles=world)
    with pytest.raises(InvalidInput, match="`goal` must keep the vehicle clear of walls"):
        planner(CART, clear, Goal(state=blocked), obstacles=world)


@pytest.mark.parametrize("planner", [plan_by_value_function, plan_by_casadi])
def test_a_goal_behind_a_closed_door_is_stated_unreachable(planner):
    # The gaps at the ends of the wall are narrower than the cart.
    door = [(5.8, 0.2), (6.2, 0.2), (6.2, 4.8), (5.8, 4.8)]
    rooms = make_world([(0, 0), (12, 0), (12, 5), (0, 5)], [door])
    goal = Goal(state=(9.0, 2.5, 0.0, 0.0), tolerance=THESIS_TOLERANCE)
    plan = planner(CART, (3.0, 2.5, 0.0, 0.0), goal, obstacles=rooms)
    assert plan.status == "unreachable"
    assert plan.time == math.inf
    assert plan.path is None


def test_a_goal_that_the_cart_cannot_turn_to_is_stated_unreachable():
    # Wide enough for the axle, but not for a turn.
    lane = make_world([(0, 0), (12, 0), (12, 2), (0, 2)])
    goal = Goal(state=(4.0, 1.0, math.pi, 0.0), tolerance=THESIS_TOLERANCE)
    plan = plan_by_value_function(CART, (8.0, 1.0, 0.0, 0.0), goal, obstacles=lane)
    assert plan.status == "unreachable on this grid"
    assert plan.time == math.inf


def test_the_grid_covers_the_world_with_a_node_at_the_goal(headland):
    world, _, goal = headland
    grid = grid_within(world, CART, goal, 0.3)
    low_x, low_y, high_x, high_y = grid.bounds
    assert low_x <= 0
    assert low_y <= 0
    assert high_x >= 12
    assert high_y >= 5
    for at, low in zip(goal.state[:2], (low_x, low_y), strict=True):
        cells = (at - low) / grid.step
        assert cells == pytest.approx(round(cells), abs=1e-9)


def test_where_the_table_knows_no_way_a_finer_grid_is_proposed():
    world = make_world([(0, 0), (4, 0), (4, 4), (0, 4)])
    goal = Goal(state=(2.0, 2.0, 0.0, 0.0), tolerance=(0.4, 0.4, 0.8, 0.8))
    grid = StateGrid(
        x_min=0.0, y_min=0.0, step=0.4, x_count=11, y_count=11, theta_count=8, beta_count=8
    )
    nowhere = ValueFunction(
        table=np.full(grid.shape, np.inf, dtype=np.float32),
        grid=grid,
        trailer=Trailer(),
        goal=goal,
        scheme="linear",
        sweeps=1,
        residual=0.0,
        converged=True,
        walls=make_walls(world, covering_discs(CART), grid),
    )
    plan = plan_from_table(nowhere, (1.0, 2.0, 0.0, 0.0), goal, world, covering_discs(Trailer()))
    assert plan.status == "unreachable on this grid"
    assert "half the step, 0.2 turning radii" in plan.notes["warnings"][-1]


def test_a_way_with_other_cusps_than_the_tables_is_found_among_walls(monkeypatch):
    """The table's path takes 5.54 s; the programme from 20 random words 5.214 s at best."""
    # A table without words as long as it might know suffices.
    monkeypatch.setattr(near_field, "LONGEST", 2.0)
    triangle = [(2.56364021, 3.78786624), (3.38616635, 3.80770599), (2.94124506, 3.51604824)]
    world = make_world(
        [(0, 0), (8.74178321, 0), (8.74178321, 7.07401945), (0, 7.07401945)], [triangle]
    )
    cart = Trailer(reverse=True)
    place = (1.877764167, 3.837969489, -0.736165749, 0.0)
    goal = Goal(state=place, tolerance=THESIS_TOLERANCE)
    start = (3.632287415, 6.276712829, 0.882814505, -0.693626153)
    plan = plan_by_value_function(cart, start, goal, obstacles=world)
    assert plan.converged
    assert plan.notes["way"] == "found by a small programme, then polished"
    assert plan.time < 5.214 < 0.95 * plan.notes["driven"]
    assert path_overlap(world, covering_discs(cart), plan.path, cart) <= 1e-3
