"""Many states at once go where single ones go."""

import numpy as np
import pytest

from sightfield.systems.numerics.standoff.attraction import attracted_states, separatrix
from sightfield.systems.numerics.standoff.loop import ErrorModel, StandoffLoop, wanted_equilibrium
from sightfield.systems.numerics.standoff.response import respond


@pytest.mark.parametrize("controller", ["PI", "PID"])
def test_states_settle_as_their_motions_do(controller):
    loop = StandoffLoop(controller=controller)
    random = np.random.default_rng(1)
    y, integral = random.uniform(-2.0, 1.28, 15), random.uniform(-2.0, 2.0, 15)
    rest = wanted_equilibrium(loop).y
    settled = [
        abs(respond(loop, start, integral=sum_).end - rest) < 1e-5
        for start, sum_ in zip(y.tolist(), integral.tolist(), strict=True)
    ]
    assert 2 < sum(settled) < 13
    assert attracted_states(loop, y, integral).tolist() == settled


@pytest.mark.parametrize("controller", ["PI", "PID"])
@pytest.mark.parametrize("mirror", [1, -1])
def test_the_border_is_the_separatrix(controller, mirror):
    error = ErrorModel(a=mirror * 1.062, b=-0.7598, c=mirror * 0.137)
    loop = StandoffLoop(controller=controller, reference=mirror * 0.2, error=error)
    border = separatrix(loop)
    near = np.flatnonzero(np.abs(border.points[:, 0] - wanted_equilibrium(loop).y) < 1.0)[5:]
    y, integral = border.points[near].T
    assert not attracted_states(loop, y, integral + mirror * 0.01).any()
    assert attracted_states(loop, y, integral - mirror * 0.01).all()
