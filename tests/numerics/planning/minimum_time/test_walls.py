"""The programme among walls: detours as seeds, and paths that keep the whole cart off them."""

import math

import pytest
import shapely

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.planning.goal import THESIS_TOLERANCE, Goal
from sightfield.systems.numerics.planning.minimum_time.planner import plan_by_casadi
from sightfield.systems.numerics.planning.minimum_time.seeds import detours
from sightfield.systems.numerics.planning.trailer import Trailer

CART = Trailer()
WALL = [(2.4, 0.0), (2.6, 0.0), (2.6, 6.0), (2.4, 6.0)]


@pytest.fixture(scope="module")
def walled_world():
    """A square of 14 with a wall from y = 0 to y = 6 in it."""
    return make_world([(-4, -4), (10, -4), (10, 10), (-4, 10)], [WALL])


def test_there_is_one_detour_on_either_side_of_a_wall(walled_world):
    routes = detours(walled_world, 0.25, (0.5, 3.5), (4.5, 3.5))
    over, under = routes
    assert over[:, 1].max() > 6
    assert under[:, 1].min() < 0
    assert shapely.LineString(over).length < shapely.LineString(under).length
    for route in routes:
        line = shapely.LineString(route)
        assert line.distance(shapely.Polygon(WALL)) >= 0.25


def test_there_is_no_detour_through_a_closed_door():
    rooms = make_world(
        [(0, 0), (10, 0), (10, 4), (0, 4)], [[(4, 0.05), (6, 0.05), (6, 3.95), (4, 3.95)]]
    )
    assert detours(rooms, 0.25, (1, 2), (9, 2)) == []


def test_the_whole_cart_goes_round_a_wall(walled_world, depth_in_walls):
    start, goal = (0.0, 2.0, 0.0, 0.0), Goal(state=(5.0, 5.0, 0.0, 0.0), tolerance=THESIS_TOLERANCE)
    open_field = plan_by_casadi(CART, start, goal)
    plan = plan_by_casadi(CART, start, goal, obstacles=walled_world)
    assert plan.converged
    assert plan.time > open_field.time + 1
    assert depth_in_walls(walled_world, plan.path) <= 1.1e-3
    # Over the top, where the whole cart has to rise above the wall.
    assert plan.path.states[:, 1].max() > 6.25


def test_ends_inside_a_wall_are_refused(walled_world):
    clear, blocked = (0.0, 2.0, 0.0, 0.0), (2.5, 3.0, 0.0, 0.0)
    with pytest.raises(InvalidInput, match="`start` must keep the vehicle clear"):
        plan_by_casadi(CART, blocked, Goal(state=clear), obstacles=walled_world)
    with pytest.raises(InvalidInput, match="`goal` must keep the vehicle clear"):
        plan_by_casadi(CART, clear, Goal(state=blocked), obstacles=walled_world)


def test_between_its_nodes_a_path_keeps_clear_too(depth_in_walls):
    world = make_world([(0, 0), (12, 0), (12, 12), (0, 12)], [[(5, 2), (6, 2), (6, 9), (5, 9)]])
    goal = Goal(state=(8.0, 8.0, -1.0, 0.0), tolerance=THESIS_TOLERANCE)
    plan = plan_by_casadi(CART, (3.0, 8.0, 1.0, 0.3), goal, obstacles=world)
    assert plan.converged
    assert plan.time == pytest.approx(5.789, abs=5e-3)
    assert depth_in_walls(world, plan.path) <= 1e-4


def test_a_turn_along_an_outer_wall_keeps_clear_between_far_nodes(depth_in_walls):
    """Chords of the turn at the hall's end were clear; its arcs were 11 mm in the wall."""
    hall = make_world([(0, 0), (40, 0), (40, 6), (0, 6)])
    cart = Trailer(length=2.0, speed=2.0)
    goal = Goal(state=(25.0, 4.5, math.pi, 0.0), tolerance=(0.2, 0.2, 0.1, 0.1))
    plan = plan_by_casadi(cart, (3.0, 1.5, 0.0, 0.0), goal, obstacles=hall)
    assert plan.converged
    assert depth_in_walls(hall, plan.path, cart) <= 1e-4


def test_a_passage_of_eleven_tenths_of_the_width_is_driven_through(gap_world, depth_in_walls):
    """By the spline alone it was 4 mm in the wall, and could not be pushed off it."""
    goal = Goal(state=(7.0, 5.0, 0.5, 0.0), tolerance=THESIS_TOLERANCE)
    plan = plan_by_casadi(CART, (1.5, 1.5, 0.8, 0.0), goal, obstacles=gap_world)
    assert plan.converged
    assert depth_in_walls(gap_world, plan.path) <= 1e-4
    assert 7.0 < plan.time < 7.1


def test_detours_lead_through_a_tight_passage_only_if_asked(gap_world):
    ends = (1.5, 1.5), (7.0, 5.0)
    # The straight line between the ends passes the gap, but 2 cm from a corner.
    assert detours(gap_world, 0.25, *ends) == []
    (route,) = detours(gap_world, 0.25, *ends, extra=1.02)
    corners = shapely.MultiPoint([(4, 3), (4.4, 3), (4, 3.55), (4.4, 3.55)])
    assert shapely.LineString(route).distance(corners) >= 0.25


def test_goals_and_carts_of_other_types_are_refused():
    with pytest.raises(InvalidInput, match="`goal` must be of type Goal; got tuple"):
        plan_by_casadi(CART, (0.0, 0.0, 0.0, 0.0), (1.0, 2.0, 0.0, 0.0))
    with pytest.raises(InvalidInput, match="`trailer` must be of type Trailer; got NoneType"):
        plan_by_casadi(None, (0.0, 0.0, 0.0, 0.0), Goal(state=(1.0, 2.0, 0.0, 0.0)))
