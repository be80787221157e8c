"""The value function among walls steers the whole cart round them, and CasADi agrees."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.planning.among_walls.planner import grid_within, plan_from_table
from sightfield.systems.numerics.planning.from_table.planner import plan_by_value_function
from sightfield.systems.numerics.planning.goal import THESIS_TOLERANCE, Goal
from sightfield.systems.numerics.planning.minimum_time.planner import plan_by_casadi
from sightfield.systems.numerics.planning.trailer import Trailer
from sightfield.systems.numerics.planning.value_function.grid import StateGrid
from sightfield.systems.numerics.planning.value_function.obstacles import make_walls
from sightfield.systems.numerics.planning.value_function.value_function import ValueFunction
from sightfield.systems.numerics.planning.vehicle.footprint import covering_discs

CART = Trailer()


@pytest.fixture(scope="module", params=["free_wall", "headland", "standing_rows"])
def solved(request):
    """A field, with what both planners say of it."""
    world, start, goal = request.getfixturevalue(request.param)
    value = plan_by_value_function(CART, start, goal, obstacles=world)
    return world, goal, value, plan_by_casadi(CART, start, goal, obstacles=world)


def test_casadi_agrees_with_the_table_within_two_percent(solved):
    _, _, value, casadi = solved
    assert casadi.converged
    assert value.notes["time_to_go"] == pytest.approx(casadi.time, rel=0.02)


def test_the_policys_one_way_leads_to_the_same_optimum_or_a_little_less(solved):
    _, _, value, casadi = solved
    assert value.converged
    assert casadi.time * (1 - 1e-3) < value.time < casadi.time * (1 + 1e-4)


def test_the_whole_cart_keeps_clear_and_arrives(solved, depth_in_walls):
    world, goal, value, casadi = solved
    for plan in (value, casadi):
        assert depth_in_walls(world, plan.path) < 1e-3
        assert max(goal.miss(plan.path.states[-1])) < 1e-6


@pytest.mark.parametrize("field", ["free_wall", "standing_rows"])
def test_a_wall_costs_time(request, field):
    world, start, goal = request.getfixturevalue(field)
    there = plan_by_casadi(CART, start, goal)
    assert plan_by_casadi(CART, start, goal, obstacles=world).time > there.time + 0.5


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
