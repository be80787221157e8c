"""The closed loop as a plant: every scalar, Drake's linearisation, refusals."""

import numpy as np
import pytest
from pydrake.autodiffutils import InitializeAutoDiff
from pydrake.symbolic import Variable
from pydrake.systems.primitives import Linearize

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.standoff.loop import CONTROLLERS, StandoffLoop, equilibria
from sightfield.systems.standoff import StandoffClosedLoop


@pytest.mark.parametrize("controller", CONTROLLERS)
def test_the_plant_moves_alike_on_every_scalar(controller):
    loop = StandoffLoop(controller=controller, kd=1.7)
    plant = StandoffClosedLoop(loop, 0.1)
    context = plant.CreateDefaultContext()
    state = context.get_continuous_state_vector().CopyToVector()
    expected = plant.EvalTimeDerivatives(context).CopyToVector()
    assert state[0] == 0.1
    assert expected[0] == pytest.approx(loop.rate(0.1))

    automatic = plant.ToAutoDiffXd()
    context = automatic.CreateDefaultContext()
    context.SetContinuousState(InitializeAutoDiff(state).ravel())
    rates = automatic.EvalTimeDerivatives(context).CopyToVector()
    np.testing.assert_allclose([each.value() for each in rates], expected)
    step = 1e-6
    slope = (loop.rate(0.1 + step) - loop.rate(0.1 - step)) / (2 * step)
    if not loop.integrates:
        assert rates[0].derivatives()[0] == pytest.approx(slope, rel=1e-6)

    symbolic = plant.ToSymbolic()
    names = [Variable(f"x{k}") for k in range(len(state))]
    context = symbolic.CreateDefaultContext()
    context.SetContinuousState(names)
    values = dict(zip(names, state, strict=True))
    rates = symbolic.EvalTimeDerivatives(context).CopyToVector()
    np.testing.assert_allclose([each.Evaluate(values) for each in rates], expected)


@pytest.mark.parametrize("controller", CONTROLLERS)
@pytest.mark.parametrize("kd", [0.5, 1.0, 2.0])
def test_linearised_by_drake_it_has_the_poles_in_closed_form(controller, kd):
    loop = StandoffLoop(controller=controller, kd=kd)
    for each in equilibria(loop):
        plant = StandoffClosedLoop(loop, each.y)
        linear = Linearize(plant, plant.CreateDefaultContext())
        poles = sorted(np.linalg.eigvals(linear.A()), key=abs)
        np.testing.assert_allclose(poles, each.poles, atol=1e-6)


def test_a_rate_at_the_start_is_for_loops_with_an_integral():
    plant = StandoffClosedLoop(StandoffLoop(controller="PID"), 0.1, 0.0)
    context = plant.CreateDefaultContext()
    assert plant.get_state_output_port().Eval(context).tolist() == [0.1, 0.0]
    with pytest.raises(InvalidInput, match="`start_rate` must be left out for P and PD"):
        StandoffClosedLoop(StandoffLoop(controller="PD"), 0.1, 0.0)


def test_a_start_on_the_singularity_is_refused():
    with pytest.raises(InvalidInput, match="`start` must not lie on the singularity"):
        StandoffClosedLoop(StandoffLoop(controller="PID"), 2.7598 / 2.124)
