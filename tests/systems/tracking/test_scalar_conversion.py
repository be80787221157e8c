"""Plants and controllers work on Drake's other scalars, and say the same there."""

import numpy as np
import pytest
from pydrake.autodiffutils import InitializeAutoDiff
from pydrake.symbolic import Expression, Variable
from pydrake.systems.framework import InputPortIndex, OutputPortIndex
from pydrake.systems.primitives import FirstOrderTaylorApproximation, Linearize

from sightfield.systems.tracking.agent_team import AgentTeam, DifferentialDriveTeam
from sightfield.systems.tracking.heading_controller import HeadingController

POINTS = np.array([[0.5, 1.0], [-1.0, 2.0]])
POSES = np.array([[0.5, 1.0, 0.3], [-1.0, 2.0, -2.0]])
LIMITS = {"top_speed": 0.5, "top_turn_rate": 2.0}

PLANTS = [
    pytest.param(lambda step: AgentTeam(POINTS, top_speed=0.5, time_step=step), id="points"),
    pytest.param(lambda step: DifferentialDriveTeam(POSES, time_step=step, **LIMITS), id="drives"),
]


@pytest.mark.parametrize("make", PLANTS)
@pytest.mark.parametrize("step", [0.0, 0.1])
@pytest.mark.parametrize("scale", [0.2, 5.0], ids=["within limits", "beyond limits"])
def test_plants_move_alike_on_every_scalar(make, step, scale):
    plant = make(step)
    command = scale * np.array([0.3, 0.1, -0.2, 0.4])
    expected = _next(plant, command)
    on_autodiff = _next(plant.ToAutoDiffXd(), InitializeAutoDiff(command).ravel())
    np.testing.assert_allclose([value.value() for value in on_autodiff], expected)
    # Not a conversion that forgets the derivatives: some input moves some state.
    assert any(np.abs(value.derivatives()).sum() > 0 for value in on_autodiff)
    inputs = [Variable(f"u{i}") for i in range(4)]
    on_symbols = _next(plant.ToSymbolic(), np.array([Expression(each) for each in inputs]))
    values = dict(zip(inputs, command, strict=True))
    np.testing.assert_allclose([value.Evaluate(values) for value in on_symbols], expected)


def _next(plant, command):
    """Rates of a continuous plant, or the next state of a discrete one."""
    context = plant.CreateDefaultContext()
    plant.get_input_port(0).FixValue(context, command)
    if plant.IsDifferentialEquationSystem():
        return plant.EvalTimeDerivatives(context).CopyToVector()
    return plant.EvalUniquePeriodicDiscreteUpdate(context).get_vector().CopyToVector()


def test_drives_linearise_to_the_textbook_unicycle():
    plant = DifferentialDriveTeam([[0.0, 0.0, 0.3]], **LIMITS)
    context = plant.CreateDefaultContext()
    plant.get_input_port(0).FixValue(context, [0.2, 0.1])
    # No equilibrium: the robot moves.
    affine = FirstOrderTaylorApproximation(
        plant, context, plant.GetInputPort("command").get_index(), OutputPortIndex(0)
    )
    c, s = np.cos(0.3), np.sin(0.3)
    np.testing.assert_allclose(affine.A(), [[0, 0, -0.2 * s], [0, 0, 0.2 * c], [0, 0, 0]])
    np.testing.assert_allclose(affine.B(), [[c, 0], [s, 0], [0, 1]])


def test_points_at_rest_linearise_to_integrators():
    plant = AgentTeam(POINTS, top_speed=0.5)
    context = plant.CreateDefaultContext()
    plant.get_input_port(0).FixValue(context, np.zeros(4))
    linear = Linearize(plant, context, InputPortIndex(0), OutputPortIndex(0))
    np.testing.assert_array_equal(linear.A(), np.zeros((4, 4)))
    np.testing.assert_array_equal(linear.B(), np.eye(4))


def test_the_heading_controller_commands_alike_on_every_scalar():
    controller = HeadingController(2, gain=3.0)
    velocity = np.array([0.3, 0.1, -0.2, 0.4])
    expected = _command(controller, POSES.ravel(), velocity)
    on_autodiff = _command(
        controller.ToAutoDiffXd(), POSES.ravel(), InitializeAutoDiff(velocity).ravel()
    )
    np.testing.assert_allclose([value.value() for value in on_autodiff], expected)
    on_symbols = _command(
        controller.ToSymbolic(),
        np.array([Expression(value) for value in POSES.ravel()]),
        np.array([Expression(value) for value in velocity]),
    )
    np.testing.assert_allclose([value.Evaluate() for value in on_symbols], expected)


def _command(controller, pose, velocity):
    context = controller.CreateDefaultContext()
    controller.GetInputPort("pose").FixValue(context, pose)
    controller.GetInputPort("velocity").FixValue(context, velocity)
    return controller.GetOutputPort("command").Eval(context)
