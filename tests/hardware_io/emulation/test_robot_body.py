"""The wheels of robots that stand in move as their equation says."""

import numpy as np
import pytest

from sightfield.hardware_io.emulation.robot_body import RobotBody, StandInWheels

BODY = RobotBody(track_width=0.2, time_constant=0.05, friction=0.08)


def wheels(*starts):
    return StandInWheels(np.array(starts, dtype=float), BODY)


def drive(robots, targets, duration, dt=0.001):
    for _ in range(round(duration / dt)):
        robots.step(np.asarray(targets, dtype=float), dt)


def test_speeds_rise_to_what_is_asked_for_and_a_braked_wheel_rests_when_it_should():
    robots = wheels([0, 0, 0])
    drive(robots, [[0.3, 0.0]], 0.05)
    assert robots.speeds == pytest.approx(0.3 * (1 - np.exp(-1)), rel=1e-6)
    drive(robots, [[0.3, 0.0]], 0.6)
    assert robots.speeds == pytest.approx(0.3, rel=1e-4)
    rest = BODY.stopping_time(0.3)
    drive(robots, [[0.0, 0.0]], rest - 0.002)
    assert (robots.speeds > 0).all()
    drive(robots, [[0.0, 0.0]], 0.004)
    assert (robots.speeds == 0).all()


def test_a_turn_goes_about_its_centre_and_encoders_count_it():
    robots = wheels([1, 2, 0.5], [0, 0, 0])
    drive(robots, [[0.2, 1.0], [0.0, -2.0]], 1.0)
    # By the closed form of a first-order lag, both wheels of a robot alike.
    share = 1.0 - 0.05 * (1 - np.exp(-20.0))
    assert robots.poses[:, 2] == pytest.approx([0.5 + share, -2 * share], abs=2e-4)
    assert robots.poses[1, :2] == pytest.approx([0, 0], abs=1e-9)
    # The speeds keep their ratio, so that the way is an arc of radius 0.2 m.
    centre = np.array([1 - 0.2 * np.sin(0.5), 2 + 0.2 * np.cos(0.5)])
    assert np.hypot(*(robots.poses[0, :2] - centre)) == pytest.approx(0.2, abs=1e-5)
    ways = robots.counts() / BODY.counts_per_metre
    assert ways[0] == pytest.approx([0.1 * share, 0.3 * share], abs=5e-4)
    # Carrying moves the robot and not its wheels.
    robots.poses[0] = (9, 9, 0)
    assert robots.odometry[0, 2] == pytest.approx(share, abs=2e-4)


def test_a_command_that_is_too_fast_keeps_its_curve():
    robots = wheels([0, 0, 0])
    drive(robots, [[1.0, 5.0]], 1.0)
    assert robots.speeds[0] == pytest.approx([0.2, 0.6], rel=1e-4)


def test_encoders_tell_what_they_are_set_to():
    robots = wheels([0, 0, 0], [0, 0, 0])
    robots.sense[0] = (0, -1)
    drive(robots, [[0.3, 0.0], [0.3, 0.0]], 0.5)
    counts = robots.counts()
    assert counts[0, 0] == 0
    assert counts[0, 1] == pytest.approx(-counts[1, 1], abs=1)
    assert counts[1, 1] > 300
    # A robot's odometry believes them: with the right one reversed and the left one dead it turns.
    way = counts[1, 1] / BODY.counts_per_metre
    assert robots.odometry[0, 2] == pytest.approx(-way / 0.2, abs=5e-3)
    assert robots.odometry[1, :2] == pytest.approx(robots.poses[1, :2])
    assert robots.poses[0] == pytest.approx(robots.poses[1])
