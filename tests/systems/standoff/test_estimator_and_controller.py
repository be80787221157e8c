"""Estimator and controller as systems: what the functions say, on every scalar."""

import numpy as np
import pytest
from pydrake.autodiffutils import InitializeAutoDiff
from pydrake.symbolic import Expression

from sightfield.systems.numerics.standoff.loop import THESIS_ERROR, StandoffLoop
from sightfield.systems.numerics.standoff.sampled_loop import SampledPid, pid_step
from sightfield.systems.standoff import BiasedRangeEstimator, StandoffPid


def estimate(system, evader, pursuer, noise):
    context = system.CreateDefaultContext()
    for name, value in (
        ("evader_position", evader),
        ("pursuer_position", pursuer),
        ("noise", noise),
    ):
        system.GetInputPort(name).FixValue(context, [value])
    return system.get_estimate_output_port().Eval(context)[0]


def test_the_estimate_is_the_distance_less_its_error_plus_noise():
    estimator = BiasedRangeEstimator(THESIS_ERROR)
    expected = 0.9 - THESIS_ERROR.error(0.9) + 0.01
    assert estimate(estimator, 1.2, 0.3, 0.01) == pytest.approx(expected)
    evader, pursuer = InitializeAutoDiff([1.2, 0.3]).ravel()
    found = estimate(estimator.ToAutoDiffXd(), evader, pursuer, 0.01)
    slope = 1 - (2 * THESIS_ERROR.a * 0.9 + THESIS_ERROR.b)
    assert found.value() == pytest.approx(expected)
    np.testing.assert_allclose(found.derivatives(), [slope, -slope])
    symbols = [Expression(value) for value in (1.2, 0.3, 0.01)]
    assert estimate(estimator.ToSymbolic(), *symbols).Evaluate() == pytest.approx(expected)


def next_state(system, scalar):
    """State after two samples at the same estimate, as numbers of the system's scalar."""
    context = system.CreateDefaultContext()
    for name, value in (("estimate", 0.3), ("feed_forward", 0.05)):
        system.GetInputPort(name).FixValue(context, [scalar(value)])
    for _ in range(2):
        state = system.EvalUniquePeriodicDiscreteUpdate(context)
        context.SetDiscreteState(state)
    return context.get_discrete_state_vector().CopyToVector()


@pytest.mark.parametrize("limit", [0.4, np.inf])
def test_the_controller_samples_alike_on_every_scalar(limit):
    loop, sampled = StandoffLoop(), SampledPid(limit=limit)
    controller = StandoffPid(loop, sampled)
    memory, _ = pid_step((0.0, 0.0, 0.0), 0.3, 0.05, loop, sampled)
    memory, command = pid_step(memory, 0.3, 0.05, loop, sampled)
    expected = [*memory, command]
    np.testing.assert_allclose(next_state(controller, float), expected)
    automatic = next_state(controller.ToAutoDiffXd(), lambda x: InitializeAutoDiff([x])[0, 0])
    np.testing.assert_allclose([each.value() for each in automatic], expected)
    symbolic = next_state(controller.ToSymbolic(), Expression)
    np.testing.assert_allclose([each.Evaluate() for each in symbolic], expected)


def test_the_command_is_zero_until_the_first_sample_and_then_held():
    controller = StandoffPid(StandoffLoop(controller="P"), SampledPid())
    context = controller.CreateDefaultContext()
    controller.GetInputPort("estimate").FixValue(context, [0.3])
    controller.GetInputPort("feed_forward").FixValue(context, [0.0])
    assert controller.get_command_output_port().Eval(context).tolist() == [0.0]
    context.SetDiscreteState(controller.EvalUniquePeriodicDiscreteUpdate(context))
    controller.GetInputPort("estimate").FixValue(context, [0.9])
    assert controller.get_command_output_port().Eval(context).tolist() == [pytest.approx(1.0)]
