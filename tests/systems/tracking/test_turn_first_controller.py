"""Drives that keep promises go straight and arrive in time; the others as they always did."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.tracking.mobile_agents import drive_step, heading_commands
from sightfield.systems.numerics.tracking.visibility_game.bounds import turning_time
from sightfield.systems.tracking.heading_controller import TurnFirstController

TOP_SPEED, TURN_RATE, PERIOD, GAIN = 0.3, 2.5, 0.05, 3.0


def command(poses, velocities, committed, deflection=0.0):
    count = len(poses)
    system = TurnFirstController(count, gain=GAIN, top_speed=TOP_SPEED, period=PERIOD)
    context = system.CreateDefaultContext()
    values = {
        "pose": poses,
        "velocity": velocities,
        "deflection": np.full(count, deflection),
    }
    if committed is not None:
        values["right_of_way"] = committed
    for name, value in values.items():
        system.GetInputPort(name).FixValue(context, np.ravel(value).astype(float))
    return np.asarray(system.GetOutputPort("command").Eval(context))


@pytest.mark.parametrize("heading", [0.3, 1.2, -2.6, 3.0, -1.37, 0.4 + math.pi / 2])
def test_from_any_heading_it_is_there_in_the_time_to_turn_and_drive(heading):
    pose, goal = (
        np.array([0.2, -0.1, heading]),
        np.array([0.2, -0.1]) + 0.45 * np.array([math.cos(0.4), math.sin(0.4)]),
    )
    start, direction = pose[:2].copy(), np.array([math.cos(0.4), math.sin(0.4)])
    turning = round(turning_time(TURN_RATE, PERIOD) / PERIOD)
    periods = turning + round(0.45 / (TOP_SPEED * PERIOD))
    for left in range(periods, 0, -1):
        wish = (goal - pose[:2]) / (PERIOD * left)
        assert np.hypot(*wish) <= TOP_SPEED * (1 + 1e-9)
        given = command(pose[None], wish, [1])
        pose = drive_step(pose, given, np.array([TOP_SPEED, TURN_RATE]), PERIOD)
        # On the straight way, and never behind one that turns all the time that there is.
        gone = pose[:2] - start
        assert abs(gone[0] * direction[1] - gone[1] * direction[0]) <= 1e-7
        part = (periods - left + 1 - turning) / (periods - turning)
        assert gone @ direction >= 0.45 * part - 1e-9
    assert pose[:2] == pytest.approx(goal, abs=1e-7)


def test_the_time_to_turn_is_that_of_a_right_angle_in_whole_periods():
    assert turning_time(3.0, 0.05) == pytest.approx(0.55)
    # Exactly ten periods.
    assert turning_time(math.pi, 0.05) == pytest.approx(0.5)
    assert turning_time(100.0, 0.05) == pytest.approx(0.05)
    with pytest.raises(InvalidInput, match="`top_turn_rate` must be positive"):
        turning_time(0.0, 0.05)


def test_who_is_not_committed_or_is_deflected_drives_as_it_turns():
    poses = np.array([[0.0, 0.0, 0.5], [1.0, 1.0, -2.0]])
    velocities = np.array([0.2, 0.1, -0.1, 0.25])
    usual = heading_commands(poses.ravel(), velocities, GAIN)
    assert command(poses, velocities, [0, 0]) == pytest.approx(usual)
    assert command(poses, velocities, None) == pytest.approx(usual)
    assert command(poses, velocities, [1, 1], deflection=0.01) == pytest.approx(usual)
    mixed = command(poses, velocities, [0, 1])
    assert mixed[:2] == pytest.approx(usual[:2])
    assert mixed[2] == 0.0
    assert abs(mixed[3]) > 2 * abs(usual[3])


@pytest.mark.parametrize("options", [{"count": 0}, {"gain": 0.0}, {"top_speed": -1}, {"period": 0}])
def test_nonsense_is_refused(options):
    with pytest.raises(InvalidInput):
        TurnFirstController(**({"count": 1, "top_speed": 0.3, "period": 0.05} | options))
