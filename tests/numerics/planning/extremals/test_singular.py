"""The general singular arc."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from sightfield.systems.numerics.planning.extremals.arcs import merging_curve, turning_arc
from sightfield.systems.numerics.planning.extremals.singular import singular_samples
from sightfield.systems.numerics.planning.trailer import Trailer, trailer_rates

SPEEDS = st.sampled_from([-1.0, 1.0])
ANGLES = st.floats(-3.1, 3.1)


def singular_end(state, omega, v, t):
    return singular_samples(np.array(state, dtype=float), float(omega), v, np.array([t]))[0]


@given(v=SPEEDS, omega=st.floats(-1, 1), theta=ANGLES, beta=ANGLES, t=st.floats(0, 3))
def test_a_singular_arc_is_what_the_equations_of_motion_do_with_its_turn_rate(
    v, omega, theta, beta, t
):
    def rates(_, q):
        return [*trailer_rates(q[2], q[3], v, q[4], Trailer()), v * q[4] * math.cos(q[3])]

    initial = [1.0, 2.0, theta, beta, omega]
    expected = solve_ivp(rates, (0, t), initial, rtol=1e-11, atol=1e-12, method="DOP853")
    assume(np.max(np.abs(expected.y[4])) <= 1)
    assert singular_end(initial[:4], omega, v, t) == pytest.approx(expected.y[:, -1], abs=1e-8)


@given(omega=st.floats(-1, 1), beta=ANGLES)
def test_the_turn_rate_keeps_the_law_of_one_rho(omega, beta):
    along = singular_samples(np.array([0.0, 0.0, 0.0, beta]), omega, 1.0, np.linspace(0, 1.5, 16))
    angle, turn = along[:, 3], along[:, 4]
    rho_squared = (turn - np.sin(angle)) ** 2 + np.cos(angle) ** 2
    assert rho_squared == pytest.approx(rho_squared[0], abs=1e-9)


@given(beta=ANGLES, t=st.floats(0, 4))
def test_without_a_turn_rate_it_is_a_straight(beta, t):
    expected = turning_arc(0.0, 1.0, 0.4, beta, 1.0, 0.0, t)
    assert singular_end([0, 1, 0.4, beta], 0, 1.0, t) == pytest.approx([*expected, 0], abs=1e-10)


@given(v=SPEEDS, beta=st.floats(-0.5, 0.5), t=st.floats(0, 1.5))
def test_with_twice_the_sine_it_is_a_merging_curve(v, beta, t):
    expected = merging_curve(0.0, 1.0, 0.4, beta, v, t)
    end = singular_end([0, 1, 0.4, beta], 2 * v * math.sin(beta), v, t)
    assert end[:4] == pytest.approx(expected, abs=1e-9)


@given(omega=st.floats(-1, 1), beta=ANGLES, t=st.floats(0, 3))
def test_singular_arcs_mirror(omega, beta, t):
    left = singular_end([0, 0, 0.2, beta], omega, 1.0, t)
    right = singular_end([0, 0, -0.2, -beta], -omega, 1.0, t)
    assert right == pytest.approx(left * [1, -1, -1, -1, -1], abs=1e-12)
