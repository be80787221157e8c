"""Carts on cut ground: trailers, steering, lanes, reach and routes."""

import math

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.harvest.field.coverage import plan_coverage
from sightfield.systems.numerics.harvest.field.field import Field
from sightfield.systems.numerics.harvest.machines.alongside import is_alongside
from sightfield.systems.numerics.harvest.machines.cart import Cart, hitch_of
from sightfield.systems.numerics.harvest.machines.team import pack_paths
from sightfield.systems.numerics.harvest.routes.clearance import (
    combines_to_halt,
    crop_under,
    distance_to_combine,
    outline,
    outline_at,
)
from sightfield.systems.numerics.harvest.routes.ground import Traffic, ground_of
from sightfield.systems.numerics.harvest.routes.lane import STEP, lanes_beside
from sightfield.systems.numerics.harvest.routes.planner import RoutePlanner
from sightfield.systems.numerics.harvest.routes.route import staying_at
from sightfield.systems.numerics.harvest.routes.steering import drive, nearest_way, steer
from sightfield.systems.numerics.harvest.routes.way import way_of_poses

CART = Cart()
SIZE = np.array([4.5, 1.8, 8.0])


@pytest.fixture(scope="module")
def coverage():
    return plan_coverage(Field.rectangle(140.0, 100.0), 9.0, 6.0, 2)


@pytest.fixture(scope="module")
def ground(coverage):
    return ground_of(coverage.field, coverage.crop_cells(1.0))


@pytest.fixture(scope="module")
def traffic(coverage):
    packed = pack_paths(coverage.paths, 0.8)
    none = np.zeros(2)
    return Traffic(packed.starts, packed.stations, packed.poses, none, none, 0.0, 1.5, SIZE)


def test_a_trailer_on_a_straight_swings_in_behind_its_tractor():
    poses = np.column_stack([np.linspace(0.0, 30.0, 61), np.zeros(61), np.zeros(61)])
    way = way_of_poses(poses, 1.0, CART, "test")
    exact = 2 * np.arctan(math.tan(0.5) * np.exp(-way.distances / CART.length))
    assert way.states[:, 3] == pytest.approx(exact, abs=2e-3)


def test_driving_back_control_by_control_retraces_the_way():
    hitch, state = hitch_of(CART), np.array([1.0, 2.0, 0.3, 0.2])
    states, controls = [state], [(6.0, 1.0), (3.0, -0.5), (6.0, 0.0), (5.0, 0.9)] * 5
    for v, omega in controls:
        states.append(drive(states[-1], v, omega, hitch, 0.25, 4))
    state = states[-1]
    for (v, omega), before in zip(reversed(controls), reversed(states[:-1]), strict=True):
        state = drive(state, -v, -omega, hitch, 0.25, 4)
        assert state == pytest.approx(before, abs=1e-3)


def test_steering_brings_a_cart_onto_a_circle():
    angles = np.linspace(0.0, 1.5 * math.pi, 400)
    line = np.column_stack([20 * np.sin(angles), 20 - 20 * np.cos(angles), angles])
    step = 20 * angles[1]
    state, way = np.array([0.0, -1.5, 0.2, 0.0]), 0.0
    for _ in range(50):
        way = nearest_way(line, step, state[0], state[1], way, 4.0)
        omega = steer(line, step, state, way, 5.0, CART.turning_radius, 0.25)
        assert abs(omega) <= 5.0 / CART.turning_radius + 1e-12
        state = drive(state, 5.0, omega, hitch_of(CART), 0.25, 4)
    assert math.hypot(state[0], state[1] - 20.0) == pytest.approx(20.0, abs=0.05)


def test_lanes_keep_their_distance_and_bend_gently(coverage):
    reach = 4.5 + 1.5 + 1.25
    room = coverage.field.ground
    for path in coverage.paths:
        lanes = lanes_beside(path, room, 9.0, reach, CART.turning_radius)
        assert len(lanes) > 2
        # On straights, which the first loop mostly is, the auger reaches the lane.
        first = lanes[0]
        apart = [
            first.pose_at(s)[:2] - p[:2]
            for s, p in zip(first.slots, path.pose_at(first.stations), strict=True)
        ]
        assert np.median(np.hypot(*np.array(apart).T)) == pytest.approx(reach, abs=0.05)
        for lane in (each for each in lanes if each.begin < path.length):
            turn = np.abs(np.diff(lane.points[:, 2]))
            assert turn.max() <= 1.05 * STEP / CART.turning_radius
            assert (np.diff(lane.slots) >= 0).all()
            poses = path.pose_at(lane.stations)
            beside = np.array([lane.pose_at(slot) for slot in lane.slots])
            gaps = np.hypot(*(beside - poses)[:, :2].T)
            # Combines come in from the edge across their own lanes.
            assert gaps[40:].min() >= reach - 1.2
            line = shapely.LineString(lane.points[:, :2])
            assert shapely.contains(room, line)


def test_an_auger_reaches_a_cart_that_is_beside_and_parallel():
    pose = (10.0, 5.0, math.pi / 2)
    # The box's middle is 0.85 trailer lengths behind the tractor's axle.
    beside = np.array([10.0 - 8.0, 5.0 + 0.85 * CART.length, math.pi / 2, 0.0])

    def reached(state, stands=False):
        return is_alongside(pose, state, CART.length, 0.0, 8.0, stands)

    assert reached(beside)
    assert not reached(beside + np.array([0.0, 4.0, 0.0, 0.0]))
    assert not reached(beside + np.array([-1.5, 0.0, 0.0, 0.0]))
    assert not reached(beside + np.array([16.0, 0.0, 0.0, 0.0]))
    assert reached(beside + np.array([0.0, 4.0, 0.0, 0.0]), stands=True)


def test_distance_to_a_combine_is_that_to_its_header_and_body():
    pose = (0.0, 0.0, 0.0)
    assert distance_to_combine(0.0, 6.5, pose, SIZE) == pytest.approx(2.0)
    assert distance_to_combine(-12.0, 0.0, pose, SIZE) == pytest.approx(4.0)
    assert distance_to_combine(-5.0, 3.0, pose, SIZE) == pytest.approx(1.2)
    assert distance_to_combine(0.5, -4.0, pose, SIZE) == 0.0


def test_a_combine_halts_before_a_cart_and_not_beside_one(coverage, traffic):
    x, y, theta = coverage.paths[0].pose_at(30.0)
    at = traffic._replace(progress=np.array([30.0, 0.0]))
    ahead = np.array([[x + 8.2 * math.cos(theta), y + 8.2 * math.sin(theta), theta, 0.0]])
    beside = np.array([[x - 8.0 * math.sin(theta), y + 8.0 * math.cos(theta), theta, 0.0]])
    points = outline(CART)
    assert combines_to_halt(at, points, 5.0, 0.0, ahead, 1.0, 0.5)[0] == 1.0
    assert combines_to_halt(at, points, 5.0, 0.0, beside, 1.0, 0.5)[0] == 0.0


def test_crop_is_in_the_way_until_it_is_cut(coverage, ground, traffic):
    points, state = outline(CART), np.array([70.0, 50.0, 0.0, 0.0])
    placed = outline_at(points, 5.0, 0.0, state)
    assert crop_under(ground, traffic, placed, 0.0, 0.0) == len(points)
    done = traffic._replace(progress=np.array([path.length for path in coverage.paths]))
    assert crop_under(ground, done, placed, 0.0, 0.0) == 0
    outside = outline_at(points, 5.0, 0.0, state + np.array([200.0, 0.0, 0.0, 0.0]))
    assert crop_under(ground, done, outside, 0.0, 0.0) == len(points)


def test_a_route_leads_round_standing_crop_to_where_it_should(ground, traffic):
    goal = np.array([70.0, -6.0, 0.0])
    # Beyond the field: the straight way crosses it.
    start = np.array([70.0, 106.0, math.pi, 0.0])
    far = traffic._replace(waits=np.full(2, 1e4))
    route = RoutePlanner(CART, ground).plan(far, start, 0.0, staying_at(goal))
    assert route is not None
    assert route.way.kind == "search"
    states = route.way.states
    assert states[0, :2] == pytest.approx(start[:2], abs=1e-9)
    assert states[-1, :2] == pytest.approx(goal[:2], abs=1e-6)
    assert math.remainder(states[-1, 2] - goal[2], math.tau) == pytest.approx(0.0, abs=1e-6)
    turn = np.abs(np.diff(states[:, 2])) / np.diff(route.way.distances)
    assert turn.max() <= 1.02 / CART.turning_radius
    for state in states:
        placed = outline_at(outline(CART), 5.0, 0.0, state)
        assert crop_under(ground, far, placed, 0.0, 0.0) == 0


def test_a_route_in_the_open_is_the_shortest_car_path(ground, traffic):
    start, goal = np.array([20.0, -6.0, 0.0, 0.0]), np.array([60.0, -6.0, 0.0])
    far = traffic._replace(waits=np.full(2, 1e4), progress=np.array([150.0, 0.0]))
    route = RoutePlanner(CART, ground).plan(far, start, 0.0, staying_at(goal))
    assert route is not None
    assert route.way.kind == "car"
    assert route.way.length == pytest.approx(40.0)
