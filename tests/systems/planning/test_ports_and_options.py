"""What the planning systems pass on: parameters of the Context, options, and their defaults."""

import inspect

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from sightfield.systems import planning
from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.planning.path_tracking import make_path_tracker, tracking_control
from sightfield.systems.numerics.planning.plan import driven_path
from sightfield.systems.numerics.planning.trailer import Trailer, trailer_pose, trailer_rates
from sightfield.systems.numerics.planning.value_function.policy import Following
from sightfield.systems.planning import PathFollower, TractorTrailer, ValueFunctionFeedback

CART = Trailer(speed=1.5, turn_rate=0.8, length=2.0, hitch_offset=0.3)
STATE = (0.5, -1.0, 0.4, -0.7)


def test_the_cart_moves_by_the_numbers_of_its_context():
    plant = TractorTrailer(CART, STATE)
    context = plant.CreateDefaultContext()
    plant.parameters.set(context, speed=0.9, turn_rate=0.4, length=1.3, hitch_offset=-0.2)
    other = Trailer(speed=0.9, turn_rate=0.4, length=1.3, hitch_offset=-0.2)
    plant.get_control_input_port().FixValue(context, [1.2, -0.7])
    rates = plant.EvalTimeDerivatives(context).CopyToVector()
    np.testing.assert_allclose(rates, trailer_rates(*STATE[2:], 0.9, -0.4, other))
    pose = plant.get_trailer_pose_output_port().Eval(context)
    np.testing.assert_allclose(pose, trailer_pose(*STATE, other))
    np.testing.assert_array_equal(plant.get_state_output_port().Eval(context), STATE)
    sizes = [plant.get_control_input_port().size(), plant.get_trailer_pose_output_port().size()]
    assert sizes == [2, 3]
    still = TractorTrailer(CART)
    np.testing.assert_array_equal(
        still.get_state_output_port().Eval(still.CreateDefaultContext()), np.zeros(4)
    )
    with pytest.raises(InvalidInput, match="initial_state"):
        TractorTrailer(CART, (0.0,) * 5)


@pytest.mark.parametrize("weights", [None, (1.7, 0.6, 2.2, 0.4)])
def test_the_follower_does_what_its_tracker_says(weights):
    path = driven_path(CART, (1.0, 2.0, 0.3, 0.4), [(1.5, 0.4, 2.0), (1.2, -0.5, 1.0)], step=0.1)
    options = {} if weights is None else {"weights": weights}
    follower = PathFollower(CART, path, **options)
    tracker = make_path_tracker(CART, path, weights or (1.0, 1.0, 1.0, 1.0))
    context = follower.CreateDefaultContext()
    state = path.states[8] + [0.1, -0.05, 0.04, 0.03]
    follower.get_state_input_port().FixValue(context, state)
    assert follower.GetOutputPort("progress").Eval(context) == [0.0]
    for progress in (0.0, 0.83, 2.4, 3.1):
        context.SetContinuousState([progress])
        control, rate = tracking_control(tracker, state, progress)
        np.testing.assert_array_equal(follower.get_control_output_port().Eval(context), control)
        assert follower.EvalTimeDerivatives(context).CopyToVector() == [rate]


@pytest.fixture
def asked(monkeypatch):
    """What `follow` is asked by the feedback; it answers with how often it was asked."""
    told = []

    def follow(value, before, measured, **options):
        told.append((value, before, measured.tolist(), options))
        return Following(None, np.array([[float(len(told)), -0.5]]), measured)

    monkeypatch.setattr(planning, "follow", follow)
    return told


def test_the_feedback_is_updated_once_a_period(asked):
    system = ValueFunctionFeedback("a table", period=0.25, delay=0.1, margin=0.2, trust=0.6)
    context = system.CreateDefaultContext()
    system.get_state_input_port().FixValue(context, STATE)
    # Before the first update it is what that will say.
    np.testing.assert_array_equal(system.get_control_output_port().Eval(context), [1.0, -0.5])
    simulator = Simulator(system, context)
    simulator.AdvanceTo(0.6)
    assert len(asked) == 4
    assert [len(before.given) for _, before, *_ in asked] == [0, 0, 1, 1]
    value, _, measured, options = asked[-1]
    assert (value, measured) == ("a table", list(STATE))
    assert options == {"period": 0.25, "delay": 0.1, "margin": 0.2, "trust": 0.6}
    np.testing.assert_array_equal(system.get_control_output_port().Eval(context), [4.0, -0.5])
    system.parameters.set(context, margin=0.5, trust=0.9)
    simulator.AdvanceTo(0.8)
    assert asked[-1][3] == {"period": 0.25, "delay": 0.1, "margin": 0.5, "trust": 0.9}


def test_the_feedbacks_options_may_lie_on_their_limits(asked):
    ValueFunctionFeedback("a table", delay=0.0, margin=0.0, trust=1.0)
    for wrong in ({"margin": -0.01}, {"margin": 1}, {"trust": 1.01}, {"trust": 0}, {"period": 0}):
        with pytest.raises(InvalidInput):
            ValueFunctionFeedback("a table", **wrong)
    known = inspect.signature(ValueFunctionFeedback).parameters
    defaults = {name: each.default for name, each in known.items() if name != "value"}
    assert defaults == {"period": 0.05, "delay": 0.0, "margin": 0.1, "trust": 0.3}
