"""The tractor-trailer moves as its equations say, on every scalar."""

import math

import numpy as np
import pytest
from pydrake.autodiffutils import InitializeAutoDiff
from pydrake.symbolic import Expression, Variable
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import InputPortIndex, OutputPortIndex
from pydrake.systems.primitives import FirstOrderTaylorApproximation, Linearize

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.planning.trailer import Trailer
from sightfield.systems.planning import TractorTrailer

CART = Trailer(speed=1.5, turn_rate=0.8, length=2.0, hitch_offset=0.3, reverse=True)
STATE = (0.5, -1.0, 0.4, -0.7)


def drive(plant, control, duration):
    """State after a control held for a while from the initial state."""
    simulator = Simulator(plant)
    plant.GetInputPort("control").FixValue(simulator.get_mutable_context(), control)
    simulator.get_mutable_integrator().set_target_accuracy(1e-10)
    simulator.AdvanceTo(duration)
    return plant.GetOutputPort("state").Eval(simulator.get_context())


@pytest.mark.parametrize("reverse", [False, True])
@pytest.mark.parametrize("scale", [0.3, 5.0, -0.3, -5.0])
def test_the_cart_moves_alike_on_every_scalar(reverse, scale):
    trailer = Trailer(speed=1.5, turn_rate=0.8, length=2.0, hitch_offset=0.3, reverse=reverse)
    plant = TractorTrailer(trailer, STATE)
    control = scale * np.array([1.0, -0.5])
    expected = rates(plant, control)
    on_autodiff = rates(plant.ToAutoDiffXd(), InitializeAutoDiff(control).ravel())
    np.testing.assert_allclose([value.value() for value in on_autodiff], expected)
    variables = [Variable("v"), Variable("omega")]
    on_symbols = rates(plant.ToSymbolic(), np.array([Expression(each) for each in variables]))
    values = dict(zip(variables, control, strict=True))
    np.testing.assert_allclose([value.Evaluate(values) for value in on_symbols], expected)


def rates(plant, control):
    context = plant.CreateDefaultContext()
    plant.get_input_port(0).FixValue(context, control)
    return plant.EvalTimeDerivatives(context).CopyToVector()


def test_the_trailer_pose_is_alike_on_every_scalar():
    plant = TractorTrailer(CART, STATE)
    theta, phi = STATE[2], STATE[2] - STATE[3]
    expected = [
        STATE[0] - 0.3 * math.cos(theta) - 2.0 * math.cos(phi),
        STATE[1] - 0.3 * math.sin(theta) - 2.0 * math.sin(phi),
        phi,
    ]
    for each, value in [
        (plant, float),
        (plant.ToAutoDiffXd(), lambda number: number.value()),
        (plant.ToSymbolic(), lambda number: number.Evaluate()),
    ]:
        pose = each.GetOutputPort("trailer_pose").Eval(each.CreateDefaultContext())
        np.testing.assert_allclose([value(number) for number in pose], expected)


def test_the_cart_linearises_to_the_closed_form():
    plant = TractorTrailer(CART, STATE)
    context = plant.CreateDefaultContext()
    v, omega = 0.9, 0.5
    plant.get_input_port(0).FixValue(context, [v, omega])
    affine = FirstOrderTaylorApproximation(
        plant, context, plant.GetInputPort("control").get_index(), OutputPortIndex(0)
    )
    c, s = math.cos(STATE[2]), math.sin(STATE[2])
    cb, sb = math.cos(STATE[3]), math.sin(STATE[3])
    slope = -(v * cb + 0.3 * omega * sb) / 2.0
    np.testing.assert_allclose(
        affine.A(), [[0, 0, -v * s, 0], [0, 0, v * c, 0], [0, 0, 0, 0], [0, 0, 0, slope]]
    )
    np.testing.assert_allclose(
        affine.B(), [[c, 0], [s, 0], [0, 1], [-sb / 2.0, 1 + 0.3 * cb / 2.0]]
    )


def test_at_rest_the_cart_linearises_to_its_input_directions():
    plant = TractorTrailer(CART, STATE)
    context = plant.CreateDefaultContext()
    plant.get_input_port(0).FixValue(context, [0.0, 0.0])
    linear = Linearize(plant, context, InputPortIndex(0), OutputPortIndex(0))
    c, s = math.cos(STATE[2]), math.sin(STATE[2])
    cb, sb = math.cos(STATE[3]), math.sin(STATE[3])
    np.testing.assert_array_equal(linear.A(), np.zeros((4, 4)))
    np.testing.assert_allclose(
        linear.B(), [[c, 0], [s, 0], [0, 1], [-sb / 2.0, 1 + 0.3 * cb / 2.0]]
    )


@pytest.mark.parametrize("v", [1.2, -1.2], ids=["forward", "reverse"])
def test_on_a_straight_the_tangent_of_half_beta_decays_with_the_way_driven(v):
    plant = TractorTrailer(CART, (1.0, 2.0, 0.3, 0.8))
    x, y, theta, beta = drive(plant, [v, 0.0], 1.0)
    np.testing.assert_allclose(
        [x, y, theta], [1 + v * math.cos(0.3), 2 + v * math.sin(0.3), 0.3], atol=1e-8
    )
    assert math.tan(beta / 2) == pytest.approx(math.tan(0.4) * math.exp(-v / 2.0), rel=1e-7)


def test_on_a_circle_beta_tends_to_where_the_trailer_follows_a_circle_too():
    plant = TractorTrailer(Trailer(speed=1.0, turn_rate=1.0, length=1.5))
    x, y, theta, beta = drive(plant, [1.0, 0.4], 60.0)
    np.testing.assert_allclose(
        [x, y, theta], [math.sin(24) / 0.4, (1 - math.cos(24)) / 0.4, 24], atol=1e-6
    )
    assert math.sin(beta) == pytest.approx(1.5 * 0.4, abs=1e-7)


def test_the_trailer_moves_along_its_own_heading():
    plant = TractorTrailer(CART, STATE)
    context = plant.CreateDefaultContext()
    plant.get_input_port(0).FixValue(context, [1.1, 0.6])
    state = np.array(STATE)
    step = 1e-6 * plant.EvalTimeDerivatives(context).CopyToVector()

    def pose(at):
        context.SetContinuousState(at)
        return plant.GetOutputPort("trailer_pose").Eval(context)

    moved = (pose(state + step) - pose(state - step))[:2] / 2e-6
    heading = pose(state)[2]
    assert moved @ [-math.sin(heading), math.cos(heading)] == pytest.approx(0, abs=1e-8)
    assert moved @ [math.cos(heading), math.sin(heading)] > 0.5


def test_a_cart_that_cannot_reverse_stands_still_when_told_to():
    plant = TractorTrailer(Trailer(), STATE)
    np.testing.assert_allclose(drive(plant, [-1.0, 0.0], 1.0), STATE)


def test_angles_count_turns():
    theta = drive(TractorTrailer(Trailer()), [1.0, 9.0], 10.0)[2]
    assert theta == pytest.approx(10.0, abs=1e-8)


@pytest.mark.parametrize("state", [(0, 0, 0), (0, 0, math.nan, 0), (0, 0, 0, math.inf)])
def test_bad_initial_states_are_refused(state):
    with pytest.raises(InvalidInput, match="initial_state"):
        TractorTrailer(Trailer(), state)
