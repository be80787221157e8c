"""Accelerations, turns and jumps, by closed forms."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.harvest.audit.harvest_log import HarvestLog, Machine, Site
from sightfield.systems.numerics.harvest.audit.motion import hitch_errors, motion_faults, motion_of

TIME = np.arange(0.0, 30.1, 0.5)


def along(stations, radius, start=(3.0, -4.0, 2.9)):
    """Poses on a circle to the left, or a straight where the radius is infinite."""
    x, y, theta = start
    turned = stations / radius
    chord = stations * np.sinc(turned / 2 / np.pi)
    return np.column_stack(
        [
            x + chord * np.cos(theta + turned / 2),
            y + chord * np.sin(theta + turned / 2),
            theta + turned,
        ]
    )


def log_of(combine=None, tractor=None, trailer=None, speed=None, time=TIME):
    def team(poses):
        return np.zeros((len(time), 0, 3)) if poses is None else poses[:, None]

    combines, tractors = team(combine), team(tractor)
    return HarvestLog(
        time,
        combines,
        np.zeros(combines.shape[:2]) if speed is None else speed[:, None],
        tractors,
        tractors if trailer is None else team(trailer),
        np.zeros(combines.shape[:2]),
        np.zeros(tractors.shape[:2]),
        np.zeros(combines.shape[:2]),
        np.zeros(len(time)),
    )


def site_of(log, **limits):
    square = np.array([[-1.0, -1.0], [1, -1], [1, 1], [-1, 1]])
    machine = Machine(front=square, rear=square, **limits)
    count = log.combine_pose.shape[1], log.tractor_pose.shape[1]
    return Site((machine,) * count[0], (machine,) * count[1], (), 0.0)


def kinds(log, **limits):
    return {fault.kind for fault in motion_faults(log, site_of(log, **limits))[1]}


@pytest.mark.parametrize("radius", [math.inf, 12.0, -20.0])
@pytest.mark.parametrize("gear", [1, -1])
def test_constant_acceleration_and_lateral_acceleration_are_read_from_poses(radius, gear):
    acceleration = 0.04
    stations = gear * (0.5 * TIME + acceleration * TIME**2 / 2)
    poses = along(stations, radius)
    # Logged headings are wrapped.
    poses[:, 2] = np.remainder(poses[:, 2] + np.pi, 2 * np.pi) - np.pi
    motion = motion_of(poses, TIME)
    middle = (TIME[1:] + TIME[:-1]) / 2
    assert motion.speed == pytest.approx(gear * (0.5 + acceleration * middle), abs=1e-9)
    assert motion.along_acceleration[1:-1] == pytest.approx(gear * acceleration, abs=1e-9)
    assert motion.across_acceleration == pytest.approx(motion.speed**2 / radius, abs=1e-9)
    assert motion.across == pytest.approx(0.0, abs=1e-9)


def test_unevenly_spaced_samples_give_the_same_acceleration():
    time = np.cumsum(np.random.default_rng(4).uniform(0.05, 0.5, 80))
    stations = 0.3 * time + 0.7 * time**2 / 2
    motion = motion_of(along(stations, math.inf), time)
    assert motion.along_acceleration[1:-1] == pytest.approx(0.7, abs=1e-6)


def test_a_machine_within_its_limits_has_no_faults_and_one_beyond_has():
    speed = np.interp(TIME, [2, 6, 20, 24], [0, 4 * 0.45, 4 * 0.45, 0])
    stations = np.concatenate([[0], np.cumsum((speed[1:] + speed[:-1]) / 2 * 0.5)])
    log = log_of(along(stations, 7.0), speed=speed)
    assert kinds(log, acceleration=0.45, turning_radius=7.0) == set()
    assert kinds(log, acceleration=0.38) == {"acceleration along"}
    assert kinds(log, lateral_acceleration=0.45) == set()
    assert kinds(log, lateral_acceleration=0.39) == {"acceleration across"}
    assert kinds(log, turning_radius=8.5) == {"turn"}


def test_changing_gear_in_a_bend_is_no_tighter_turn():
    # A fishtail with a cusp amid two samples: steering stays to its side of the way.
    speed = 1.0 - 0.5 * TIME[:9]
    stations = TIME[:9] - 0.25 * (TIME[:9] - 0.1) ** 2
    driven = np.abs(np.diff(np.concatenate([[0.0], stations])))
    assert speed[0] > 0 > speed[-1]
    poses = [along(stations[:1], 6.0)[0]]
    fine = np.linspace(0, 4, 4001)
    way = np.diff(fine - 0.25 * (fine - 0.1) ** 2)
    x, y, theta = poses[0]
    found = [poses[0]]
    for k, step in enumerate(way, start=1):
        theta += abs(step) / 6.0
        x, y = x + step * math.cos(theta), y + step * math.sin(theta)
        if k % 500 == 0:
            found.append((x, y, theta))
    log = log_of(np.array(found), speed=1 - 0.5 * (TIME[:9] - 0.1), time=TIME[:9])
    assert driven.max() > 0
    assert kinds(log, turning_radius=6.0, acceleration=0.5) == set()


def test_turning_on_the_spot_is_too_tight():
    poses = np.column_stack([np.zeros((len(TIME), 2)), 0.1 * TIME])
    assert kinds(log_of(poses), turning_radius=4.0) == {"turn"}
    assert kinds(log_of(poses)) == set()


def test_a_speed_that_is_not_that_of_the_poses_is_seen():
    poses, speed = along(1.5 * TIME, math.inf), np.full(len(TIME), 1.5)
    assert kinds(log_of(poses, speed=speed)) == set()
    assert kinds(log_of(poses, speed=-speed)) == set()
    assert kinds(log_of(poses, speed=0.5 * speed)) == {"speed differs from poses"}


@pytest.mark.parametrize(
    ("shift", "kind"),
    [((0.0, 1.4, 0.0), "pose jumps"), ((0.0, 0.0, 1.0), "turn rate"), ((30, 0, 0), "speed")],
)
def test_a_machine_that_teleports_has_jumped(shift, kind):
    poses = along(1.5 * TIME, math.inf, (0.0, 0.0, 0.0))
    poses[20:] += shift
    log = log_of(poses, speed=np.full(len(TIME), 1.5))
    faults = [each for each in motion_faults(log, site_of(log))[1] if each.kind == kind]
    assert len(faults) == 1
    assert faults[0].begin <= TIME[19] < faults[0].end


def test_a_machine_that_slides_aside_is_seen():
    poses = along(2.0 * TIME, math.inf, (0.0, 0.0, 0.7))
    poses[:, 2] += 0.35
    log = log_of(poses, speed=np.full(len(TIME), 2.0))
    assert kinds(log) == {"moves sideways"}


def test_a_bend_into_the_opposite_one_is_no_slide():
    """The heading is the same before and after the step; the way across is a dt^2 / 4."""
    across, speed = 2.0, 3.5
    radius = speed**2 / across
    before = along(speed * (TIME[:11] - TIME[10] - 0.25), radius, (0.0, 0.0, 0.4))
    after = along(speed * (TIME[11:21] - TIME[10] - 0.25), -radius, (0.0, 0.0, 0.4))
    log = log_of(tractor=np.concatenate([before, after]), time=TIME[:21])
    motion = motion_of(log.tractor_pose[:, 0], log.time)
    assert np.abs(motion.across).max() == pytest.approx(across * 0.5**2 / 4, rel=0.01)
    assert kinds(log, lateral_acceleration=1.01 * across) == set()
    assert "moves sideways" in kinds(log, lateral_acceleration=0.8 * across)


def test_a_trailer_is_held_by_its_hitch_wherever_that_is():
    theta = np.linspace(0.3, 5.0, 40)
    heading = theta - 0.8 * np.sin(np.linspace(0, 9, 40))
    tractor = np.column_stack([7 * np.sin(theta), -7 * np.cos(theta), theta])
    offset, length = 0.9, 5.5
    trailer = np.column_stack(
        [
            tractor[:, 0] - offset * np.cos(theta) - length * np.cos(heading),
            tractor[:, 1] - offset * np.sin(theta) - length * np.sin(heading),
            heading,
        ]
    )
    assert hitch_errors(tractor, trailer) == pytest.approx(0.0, abs=1e-9)
    trailer[17, 0] += 0.6
    errors = hitch_errors(tractor, trailer)
    assert errors[17] == pytest.approx(0.6, abs=0.02)
    assert np.delete(errors, 17).max() < 0.02
