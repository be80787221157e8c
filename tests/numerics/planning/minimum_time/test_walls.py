"""The cart among walls: what it covers, ways round, and paths that keep clear."""

import math

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.planning.footprint import (
    TRAILER,
    covering_discs,
    deepest_overlap,
    discs_from_text,
)
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


def test_the_discs_cover_the_centre_lines_of_a_bent_cart():
    discs = covering_discs(Trailer(hitch_offset=0.2))
    state = np.array([1.0, 2.0, 0.4, 0.9])
    covered = shapely.union_all(
        [shapely.Point(*discs.centre(k, state)).buffer(discs.radii[k]) for k in range(len(discs))]
    )
    hitch = state[:2] - 0.2 * np.array([math.cos(0.4), math.sin(0.4)])
    axle = hitch - np.array([math.cos(0.4 - 0.9), math.sin(0.4 - 0.9)])
    nose = state[:2] + 0.5 * np.array([math.cos(0.4), math.sin(0.4)])
    strip = shapely.LineString([nose, hitch, axle]).buffer(0.42 * 0.5, cap_style="flat")
    assert strip.difference(covered).area < 1e-4


def test_the_last_trailer_disc_is_on_its_axle():
    discs = covering_discs(CART)
    first = discs.bodies.index(TRAILER)
    assert discs.centre(first, np.array([0.0, 0.0, 0.3, 0.3])) == pytest.approx((-1.0, 0.0))


def test_discs_are_ahead_of_the_axles_of_their_bodies():
    cart = Trailer(length=2.0, hitch_offset=0.5)
    discs = discs_from_text(cart, "Tractor 0.7 0.4, trailer -0.3 0.6")
    assert discs.radii == (0.4, 0.6)
    state = np.array([1.0, 2.0, math.pi / 2, math.pi / 2])
    np.testing.assert_allclose(discs.centre(0, state), (1.0, 2.7), atol=1e-12)
    # The trailer, at a right angle, heads along x from two behind the hitch.
    np.testing.assert_allclose(discs.centre(1, state), (-1.3, 1.5), atol=1e-12)


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


def test_overlap_is_the_depth_in_a_wall(walled_world):
    discs = covering_discs(CART)
    states = np.array([[1.0, 3.0, 0.0, 0.0], [1.8, 3.0, 0.0, 0.0]])
    assert deepest_overlap(walled_world, discs, states) == pytest.approx(0.15, abs=1e-9)


def test_the_whole_cart_goes_round_a_wall(walled_world):
    start, goal = (0.0, 2.0, 0.0, 0.0), Goal(state=(5.0, 5.0, 0.0, 0.0), tolerance=THESIS_TOLERANCE)
    open_field = plan_by_casadi(CART, start, goal)
    plan = plan_by_casadi(CART, start, goal, obstacles=walled_world)
    assert plan.converged
    assert plan.time > open_field.time + 1
    discs = covering_discs(CART)
    assert deepest_overlap(walled_world, discs, plan.path.states, between=20) <= 1.1e-3
    # Over the top, where the whole cart has to rise above the wall.
    assert plan.path.states[:, 1].max() > 6.25


def test_ends_inside_a_wall_are_refused(walled_world):
    clear, blocked = (0.0, 2.0, 0.0, 0.0), (2.5, 3.0, 0.0, 0.0)
    with pytest.raises(InvalidInput, match="`start` must keep the vehicle clear"):
        plan_by_casadi(CART, blocked, Goal(state=clear), obstacles=walled_world)
    with pytest.raises(InvalidInput, match="`goal` must keep the vehicle clear"):
        plan_by_casadi(CART, clear, Goal(state=blocked), obstacles=walled_world)


def test_between_its_nodes_a_path_keeps_clear_too():
    world = make_world([(0, 0), (12, 0), (12, 12), (0, 12)], [[(5, 2), (6, 2), (6, 9), (5, 9)]])
    goal = Goal(state=(8.0, 8.0, -1.0, 0.0), tolerance=THESIS_TOLERANCE)
    plan = plan_by_casadi(CART, (3.0, 8.0, 1.0, 0.3), goal, obstacles=world)
    assert plan.converged
    assert plan.time == pytest.approx(5.789, abs=5e-3)
    discs = covering_discs(CART)
    assert deepest_overlap(world, discs, plan.path.states, between=20) <= 1e-4


def test_goals_and_carts_of_other_types_are_refused():
    with pytest.raises(InvalidInput, match="`goal` must be of type Goal; got tuple"):
        plan_by_casadi(CART, (0.0, 0.0, 0.0, 0.0), (1.0, 2.0, 0.0, 0.0))
    with pytest.raises(InvalidInput, match="`trailer` must be of type Trailer; got NoneType"):
        plan_by_casadi(None, (0.0, 0.0, 0.0, 0.0), Goal(state=(1.0, 2.0, 0.0, 0.0)))
