"""Robots that a controller of headings drives the way that points were meant to go."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.tracking.agent_team import DifferentialDriveTeam
from sightfield.systems.tracking.heading_controller import HeadingController

GAIN, SPEED = 3.0, 0.8
# Two robots: the velocity is ahead and to the left of one, behind and to the right of the other.
POSES = np.array([[0.5, -1.0, 0.4], [-2.0, 3.0, 2.5]])
ERRORS = np.array([1.1, -2.3])
VELOCITY = SPEED * np.column_stack([np.cos(POSES[:, 2] + ERRORS), np.sin(POSES[:, 2] + ERRORS)])


def drive(time_step, until):
    """Poses after a time under the controller, shape (2, 3)."""
    builder = DiagramBuilder()
    limits = {"top_speed": 1.0, "top_turn_rate": 10.0}
    team = builder.AddSystem(DifferentialDriveTeam(POSES, time_step=time_step, **limits))
    controller = builder.AddSystem(HeadingController(2, gain=GAIN))
    wanted = builder.AddSystem(ConstantVectorSource(VELOCITY.ravel()))
    builder.Connect(wanted.get_output_port(), controller.GetInputPort("velocity"))
    builder.Connect(team.GetOutputPort("pose"), controller.GetInputPort("pose"))
    builder.Connect(controller.GetOutputPort("command"), team.GetInputPort("command"))
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(until)
    context = team.GetMyContextFromRoot(simulator.get_context())
    return team.GetOutputPort("pose").Eval(context).reshape(2, 3)


@pytest.mark.parametrize("scalar", ["double", "AutoDiffXd"])
def test_the_command_is_the_part_ahead_and_the_gain_times_the_error(scalar):
    controller = HeadingController(2, gain=GAIN)
    if scalar == "AutoDiffXd":
        controller = controller.ToAutoDiffXd()
    context = controller.CreateDefaultContext()
    controller.GetInputPort("pose").FixValue(context, POSES.ravel())
    controller.GetInputPort("velocity").FixValue(context, VELOCITY.ravel())
    command = controller.GetOutputPort("command").Eval(context)
    values = [each if scalar == "double" else each.value() for each in command]
    expected = np.column_stack([SPEED * np.cos(ERRORS), GAIN * ERRORS])
    np.testing.assert_allclose(values, expected.ravel())


def test_the_heading_error_decays_exponentially_with_the_gain():
    errors = POSES[:, 2] + ERRORS - drive(0.0, 0.7)[:, 2]
    np.testing.assert_allclose(errors, ERRORS * np.exp(-GAIN * 0.7), rtol=2e-3)


def test_the_heading_error_shrinks_by_the_same_factor_in_every_step():
    errors = POSES[:, 2] + ERRORS - drive(0.05, 0.99)[:, 2]
    np.testing.assert_allclose(errors, ERRORS * (1.0 - GAIN * 0.05) ** 20)


def test_a_robot_that_is_to_go_backwards_reverses_while_it_turns():
    moved = drive(0.01, 0.1)[:, :2] - POSES[:, :2]
    ahead = np.column_stack([np.cos(POSES[:, 2]), np.sin(POSES[:, 2])])
    forwards = np.sum(moved * ahead, axis=1)
    assert forwards[0] > 0.0 > forwards[1]


def test_once_turned_robots_go_with_the_velocity():
    moved = drive(0.01, 5.0)[:, :2] - drive(0.01, 4.0)[:, :2]
    np.testing.assert_allclose(moved, VELOCITY, atol=1e-4)


@pytest.mark.parametrize(
    ("count", "gain", "message"),
    [
        (0, 1.0, "`count` must be a whole number of at least 1; got 0"),
        (1, -1.0, "`gain` must be positive; got -1.0"),
    ],
)
def test_no_robots_and_gains_that_turn_away_are_refused(count, gain, message):
    with pytest.raises(InvalidInput, match=message):
        HeadingController(count, gain=gain)
