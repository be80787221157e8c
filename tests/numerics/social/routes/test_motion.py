"""Following routes, wandering, and keeping apart."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.edge_index import build_edge_index
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.social.routes.infrared import InfraredRing, infrared_ranges
from sightfield.systems.numerics.social.routes.motion import (
    FollowingLaw,
    WanderingLaw,
    deviation,
    drive_towards,
    guarded_commands,
    point_at,
    progress_along,
    wander,
)
from sightfield.systems.numerics.tracking.mobile_agents import drive_step

RING, RADIUS, PERIOD = InfraredRing(), 0.1, 0.05
ROOM = make_world([[0, 0], [4, 0], [4, 4], [0, 4]])
OPEN = build_edge_index(ROOM)
BENT = np.array([[1.0, 1.0], [2.0, 1.0], [2.0, 2.0]])


def test_progress_goes_on_along_a_route_and_never_back():
    now = progress_along(OPEN, BENT, np.array([1.5, 1.1]), 0.0, 0.2)
    assert (now.arc, now.rest, now.in_sight) == (pytest.approx(0.5), pytest.approx(1.5), True)
    np.testing.assert_allclose(now.aim, [1.7, 1.0])
    later = progress_along(OPEN, BENT, np.array([1.2, 1.0]), 0.5, 0.2)
    assert later.arc == pytest.approx(0.5)
    np.testing.assert_allclose(point_at(BENT, 1.25), [2.0, 1.25])


def test_behind_a_corner_a_nearer_point_is_aimed_at_and_out_of_sight_none():
    index = build_edge_index(make_world(ROOM.boundary, [[[1.9, 1.1], [2.1, 1.1], [2, 3]]]))
    route = np.array([[1.0, 1.0], [2.0, 1.0], [2.5, 2.0]])
    beside = progress_along(index, route, np.array([1.8, 1.15]), 0.0, 0.8)
    assert beside.in_sight
    assert beside.aim[1] <= 1.1
    behind = progress_along(index, route, np.array([1.7, 2.0]), 1.8, 0.2)
    assert not behind.in_sight


def test_a_route_of_one_point_has_no_rest():
    now = progress_along(OPEN, BENT[:1], np.array([1.5, 1.1]), 0.0, 0.2)
    assert (now.arc, now.rest) == (0.0, 0.0)
    np.testing.assert_array_equal(now.aim, BENT[0])


def deviate(pose, wish, others, side=0.0):
    poses = np.array([pose, *others], dtype=float)
    felt = infrared_ranges(OPEN.edges, poses, RADIUS, RING)[0]
    walls = infrared_ranges(OPEN.edges, poses[:1], RADIUS, RING)[0]
    law = FollowingLaw()
    return deviation(law, RING, OPEN, poses[0], wish, felt, walls, RADIUS, side)


def test_with_nobody_near_the_wish_is_granted_even_along_a_wall():
    assert deviate([2, 2, 0], 0.3, []) == (0.3, 0.0)
    assert deviate([3.85, 2, math.pi / 2], math.pi / 2, []) == (math.pi / 2, 0.0)


def test_a_robot_ahead_is_passed_on_the_free_side():
    left, side = deviate([2, 2, 0], 0.0, [[2.3, 1.9, 0]])
    assert left is not None
    assert left > 0
    assert side == 1
    right, side = deviate([2, 2, 0], 0.0, [[2.3, 2.1, 0]])
    assert right == pytest.approx(-left)
    assert side == -1


def test_the_chosen_side_is_kept():
    chosen, side = deviate([2, 2, 0], 0.0, [[2.3, 2.0, 0]], side=-1.0)
    assert (chosen < 0, side) == (True, -1)
    chosen, side = deviate([2, 2, 0], 0.0, [[2.3, 2.0, 0]], side=1.0)
    assert (chosen > 0, side) == (True, 1)


def test_no_direction_leads_into_a_wall():
    index = build_edge_index(make_world([[0, 0], [4, 0], [4, 0.3], [0, 0.3]]))
    poses = np.array([[2, 0.15, 0], [2.25, 0.15, 0]])
    felt = infrared_ranges(index.edges, poses, RADIUS, RING)[0]
    walls = infrared_ranges(index.edges, poses[:1], RADIUS, RING)[0]
    inner = build_edge_index(make_world([[0.1, 0.12], [3.9, 0.12], [3.9, 0.18], [0.1, 0.18]]))
    way, _ = deviation(FollowingLaw(), RING, inner, poses[0], 0.0, felt, walls, RADIUS, 0.0)
    assert way is None or abs(way) > math.radians(90)


def test_a_robot_turns_before_it_drives_and_waits_without_a_direction():
    law = FollowingLaw()
    np.testing.assert_allclose(drive_towards(law, 0.0, 0.0), [law.speed, 0])
    speed, rate = drive_towards(law, 0.0, math.radians(120))
    assert (speed, rate) == (0.0, law.turn_rate)
    np.testing.assert_array_equal(drive_towards(law, 1.0, None), [0, 0])


def test_wanderers_go_straight_in_the_open_and_turn_from_the_nearer_side():
    law = WanderingLaw()
    far = np.full((1, 4), RING.reach)
    rest, command = wander(law, RING, np.zeros(1), far, np.array([0.5]), PERIOD)
    np.testing.assert_allclose(command, [[law.speed, 0]])
    near = np.array([[0.05, 0.05, 0.4, 0.4], [0.4, 0.4, 0.05, 0.05]])
    rest, command = wander(law, RING, np.zeros(2), near, np.array([0.5, 0.5]), PERIOD)
    np.testing.assert_allclose(command, [[0, -law.turn_rate], [0, law.turn_rate]])
    assert rest[0] == pytest.approx(-rest[1])
    assert rest[0] < 0


def test_a_turn_takes_its_angle_and_is_prolonged_until_the_way_is_free():
    law = WanderingLaw()
    far, near = np.full((1, 4), RING.reach), np.full((1, 4), 0.05)
    rest, turned = np.array([0.73]), 0.0
    for _ in range(100):
        rest, command = wander(law, RING, rest, far, np.array([0.5]), PERIOD)
        if command[0, 0] > 0:
            break
        turned += command[0, 1] * PERIOD
    assert turned == pytest.approx(0.73)
    rest = np.array([0.73])
    for _ in range(200):
        rest, command = wander(law, RING, rest, near, np.array([0.5]), PERIOD)
        assert command[0, 0] == 0
        assert command[0, 1] > 0


def test_robots_that_only_want_to_crash_never_touch():
    generator = np.random.default_rng(1)
    bearings, half = np.array(RING.bearings), 0.5 * RING.cone
    limits = np.array([0.4, 3.0])
    nearest = math.inf
    for _ in range(20):
        grid = np.array([[0.25 * i, 0.25 * j] for i in range(3) for j in range(2)]) + 1.5
        poses = np.column_stack([grid, generator.uniform(-3, 3, 6)])
        for _ in range(200):
            middle = poses[:, :2].mean(axis=0)
            to = np.arctan2(*(middle - poses[:, :2]).T[::-1])
            error = np.remainder(to - poses[:, 2] + math.pi, 2 * math.pi) - math.pi
            rates = 5 * error + generator.normal(0, 1, 6)
            wanted = np.column_stack([np.full(6, 0.4), np.clip(rates, -3, 3)])
            felt = infrared_ranges(OPEN.edges, poses, RADIUS, RING)
            safe = guarded_commands(wanted, felt, bearings, half, 0.0, PERIOD)
            poses = drive_step(poses.ravel(), safe.ravel(), limits, PERIOD).reshape(-1, 3)
            apart = np.hypot(*(poses[:, None, :2] - poses[None, :, :2]).transpose(2, 0, 1))
            nearest = min(nearest, apart[np.triu_indices(6, 1)].min() - 2 * RADIUS)
    assert -1e-12 < nearest < 0.01


def test_far_from_everything_commands_are_kept_but_never_backwards():
    commands = np.array([[0.2, 1.0], [-0.2, -1.0]])
    felt = np.full((2, 4), RING.reach)
    safe = guarded_commands(commands, felt, np.array(RING.bearings), 0.4, 0.0, PERIOD)
    np.testing.assert_array_equal(safe, [[0.2, 1.0], [0.0, -1.0]])


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: FollowingLaw(speed=0), "`speed` must be positive"),
        (lambda: FollowingLaw(stand_off=-1), "`stand_off` must be zero or positive"),
        (lambda: WanderingLaw(turn_range=0), "`turn_range` must be positive"),
        (lambda: WanderingLaw(greatest_turn=0.1), "`greatest_turn` must be at least least_turn"),
    ],
)
def test_bad_laws_are_named(make, message):
    with pytest.raises(InvalidInput, match=message):
        make()
