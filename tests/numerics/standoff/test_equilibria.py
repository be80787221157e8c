"""Where the loop rests, with which poles, and where its equation breaks down."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.standoff.loop import (
    CONTROLLERS,
    ErrorModel,
    StandoffLoop,
    equilibria,
    singularities,
    wanted_equilibrium,
)

# The thesis's constants, by hand: s^2 = 1.7598^2 - 4 * 1.062 * 0.337.
ROOT = math.sqrt(1.7598**2 - 4 * 1.062 * 0.337)
NEAR, FAR = (1.7598 - ROOT) / 2.124, (1.7598 + ROOT) / 2.124


def numerical_poles(loop, y):
    """Eigenvalues of the state equation's Jacobian, by complex steps."""
    states = 2 if loop.integrates else 1
    columns = []
    for k in range(states):
        state = np.array([y, 0.0], dtype=complex)
        state[k] += 1e-30j
        columns.append([loop.rate(*state).imag / 1e-30, loop.miss(state[0]).imag / 1e-30][:states])
    poles = np.linalg.eigvals(np.array(columns).T)
    return sorted(poles, key=lambda pole: (round(abs(pole), 9), pole.imag))


@pytest.mark.parametrize("controller", CONTROLLERS)
def test_the_thesis_loop_rests_at_the_roots_of_its_parabola(controller):
    found = [each.y for each in equilibria(StandoffLoop(controller=controller))]
    np.testing.assert_allclose(found, [NEAR, FAR], atol=1e-12)
    assert found == pytest.approx([0.22096384, 1.43609830], abs=1e-8)


@pytest.mark.parametrize("controller", CONTROLLERS)
def test_the_estimate_is_right_where_the_distance_is_wrong(controller):
    loop = StandoffLoop(controller=controller)
    rest = wanted_equilibrium(loop).y
    assert rest - loop.error.error(rest) == pytest.approx(loop.reference, abs=1e-12)
    assert rest - loop.reference == pytest.approx(0.02096384, abs=1e-8)


def test_the_thesis_poles_by_hand():
    poles = {
        controller: [each.poles for each in equilibria(StandoffLoop(controller=controller))]
        for controller in CONTROLLERS
    }
    assert poles["P"][0] == pytest.approx((-10 * ROOT,))
    assert poles["P"][1] == pytest.approx((10 * ROOT,))
    assert poles["PD"][0] == pytest.approx((-10 * ROOT / (1 + ROOT),))
    assert poles["PD"][1] == pytest.approx((10 * ROOT / (1 - ROOT),))
    for pole in poles["PI"][0]:
        assert pole**2 + 10 * ROOT * pole + 5 * ROOT == pytest.approx(0, abs=1e-9)
    for pole in poles["PID"][1]:
        assert (1 - ROOT) * pole**2 - 10 * ROOT * pole - 5 * ROOT == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize("controller", CONTROLLERS)
@pytest.mark.parametrize("kd", [0.4, 1.0, 3.0])
@pytest.mark.parametrize("ki", [0.01, 5.0, 400.0])
@pytest.mark.parametrize("a", [1.062, -0.8])
def test_poles_are_the_eigenvalues_of_the_linearised_loop(controller, kd, ki, a):
    loop = StandoffLoop(controller=controller, ki=ki, kd=kd, error=ErrorModel(a=a))
    for each in equilibria(loop):
        expected = numerical_poles(loop, each.y)
        np.testing.assert_allclose(each.poles, expected, rtol=1e-9, atol=1e-9)
        assert each.stable == all(pole.real < 0 for pole in expected)


def test_strong_derivative_action_seems_to_calm_the_far_equilibrium():
    near, far = equilibria(StandoffLoop(controller="PD", kd=1.0))
    assert (near.stable, near.realisable) == (True, True)
    assert (far.stable, far.realisable) == (True, False)
    _, far = equilibria(StandoffLoop(controller="PD", kd=0.5))
    assert (far.stable, far.realisable) == (False, True)


def test_the_singularity_is_where_the_denominator_vanishes():
    (place,) = singularities(StandoffLoop(controller="PD"))
    assert place == pytest.approx(2.7598 / 2.124, abs=1e-12)
    loop = StandoffLoop(controller="PID", kd=2.5)
    (place,) = singularities(loop)
    assert loop.inertia(place) == pytest.approx(0, abs=1e-12)
    assert singularities(StandoffLoop(controller="PI")) == ()
    assert singularities(StandoffLoop(controller="PD", kd=0.0)) == ()


def test_a_reference_beyond_the_parabola_is_refused_with_its_bound():
    # (b - 1)^2 / (4 a) - c.
    bound = 1.7598**2 / (4 * 1.062) - 0.137
    assert len(equilibria(StandoffLoop(reference=bound - 1e-9))) == 2
    with pytest.raises(InvalidInput, match=r"`reference` must be less than 0\.592.*got 0\.6$"):
        equilibria(StandoffLoop(reference=0.6))
    with pytest.raises(InvalidInput, match="`reference` must be more than"):
        equilibria(StandoffLoop(reference=-5.0, error=ErrorModel(a=-1.0)))


def test_a_singularity_on_an_equilibrium_is_refused():
    with pytest.raises(InvalidInput, match=r"`kd` must not put the singularity .* at 1\.436"):
        equilibria(StandoffLoop(controller="PD", kd=1 / ROOT))
