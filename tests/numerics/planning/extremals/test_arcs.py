"""Turns, merging curves and singular arcs."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from sightfield.systems.numerics.planning.extremals.arcs import (
    merging_curve,
    singular_samples,
    turned_beta,
    turning_arc,
)
from sightfield.systems.numerics.planning.trailer import Trailer, trailer_rates

SPEEDS = st.sampled_from([-1.0, 1.0])
ANGLES = st.floats(-3.1, 3.1)
DURATIONS = st.floats(0.0, 6.0)


def driven(state, v, omega_of_beta, t):
    """Where the equations of motion lead."""

    def rates(_, q):
        return trailer_rates(q[2], q[3], v, omega_of_beta(q[3]), Trailer())

    return solve_ivp(rates, (0, t), state, rtol=1e-11, atol=1e-12, method="DOP853").y[:, -1]


@given(v=SPEEDS, omega=st.floats(-1, 1), theta=ANGLES, beta=ANGLES, t=DURATIONS)
def test_a_turning_arc_is_what_the_equations_of_motion_do(v, omega, theta, beta, t):
    expected = driven([1.0, -2.0, theta, beta], v, lambda _: omega, t)
    # The equations spread an error as they spread neighbours, at most by exp(t).
    assert turning_arc(1.0, -2.0, theta, beta, v, omega, t) == pytest.approx(expected, abs=1e-7)


@given(v=SPEEDS, omega=st.sampled_from([-1.0, 1.0]), beta=st.floats(-1.5, 1.5), t=DURATIONS)
def test_regular_primitives_follow_the_printed_formula_but_for_whole_turns(v, omega, beta, t):
    k = 2 / (v - omega * math.tan(beta / 2))
    assume(abs(t + k) > 1e-6)
    printed = 2 * (v / omega) * math.atan((t - 2 * v + k) / (t + k))
    difference = turned_beta(beta, v, omega, t)[0] - printed
    assert math.remainder(difference, math.tau) == pytest.approx(0, abs=1e-8)


@given(beta=st.floats(-3, 3), t=DURATIONS)
def test_on_a_straight_the_trailer_angle_decays_as_its_half_tangent(beta, t):
    end = turning_arc(0.0, 0.0, 0.3, beta, 1.0, 0.0, t)
    assert math.tan(end[3] / 2) == pytest.approx(math.tan(beta / 2) * math.exp(-t), rel=1e-9)
    assert end[:3] == pytest.approx((t * math.cos(0.3), t * math.sin(0.3), 0.3))


@given(v=SPEEDS, omega=st.floats(-1, 1), theta=ANGLES, beta=ANGLES, t=st.floats(0, 2))
def test_driving_an_arc_backwards_undoes_it(v, omega, theta, beta, t):
    there = turning_arc(0.5, 0.7, theta, beta, v, omega, t)
    back = turning_arc(*there, -v, -omega, t)
    assert back == pytest.approx((0.5, 0.7, theta, beta), abs=1e-9)


@given(v=SPEEDS, omega=st.floats(-1, 1), beta=ANGLES, t=st.floats(0, 3))
def test_the_contraction_is_the_derivative_of_the_flow(v, omega, beta, t):
    step = 1e-6
    ahead, _ = turned_beta(beta + step, v, omega, t)
    behind, _ = turned_beta(beta - step, v, omega, t)
    growth = turned_beta(beta, v, omega, t)[1]
    assert (ahead - behind) / (2 * step) * growth == pytest.approx(1, abs=1e-6)


@given(v=SPEEDS, beta=st.floats(-0.5, 0.5), theta=ANGLES, t=st.floats(0, 1.5))
def test_a_merging_curve_is_what_the_equations_of_motion_do(v, beta, theta, t):
    expected = driven([3.0, 4.0, theta, beta], v, lambda b: 2 * v * math.sin(b), t)
    assert merging_curve(3.0, 4.0, theta, beta, v, t) == pytest.approx(expected, abs=1e-8)


def test_a_merging_curve_keeps_twice_the_sine_from_its_line_and_merges_in_reverse():
    beta = math.pi / 6
    distances = []
    for t in np.linspace(0, 8, 9):
        _, y, theta, angle = merging_curve(0.0, 2 * math.sin(beta), 2 * beta, beta, -1.0, t)
        assert y == pytest.approx(2 * math.sin(angle), abs=1e-12)
        assert theta == pytest.approx(2 * angle, abs=1e-12)
        distances.append(y)
    assert distances[0] == pytest.approx(1)
    assert distances[-1] < 1e-3
    assert np.all(np.diff(distances) < 0)


@given(beta=st.floats(math.pi - 0.5, math.pi + 0.5), t=st.floats(0, 3))
def test_a_merging_curve_stays_on_its_branch_of_angles(beta, t):
    expected = driven([0.0, 0.0, 0.0, beta], 1.0, lambda b: 2 * math.sin(b), t)
    assert merging_curve(0.0, 0.0, 0.0, beta, 1.0, t) == pytest.approx(expected, abs=1e-7)


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
