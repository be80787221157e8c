"""Margins of the sampled loop: python-control's, and the loop's own motions."""

import math

import control
import numpy as np
import pytest

from sightfield.systems.numerics.standoff.loop import (
    CONTROLLERS,
    StandoffLoop,
    root_slope,
    wanted_equilibrium,
)
from sightfield.systems.numerics.standoff.response import delay_margin
from sightfield.systems.numerics.standoff.sampled_loop import (
    SampledPid,
    frequency_grid,
    loop_margins,
    pid_step,
    sampled_loop,
)


def random_case(random):
    period = 10 ** random.uniform(-3, -1)
    scale = 10 ** random.uniform(-2, 0.3) / period
    loop = StandoffLoop(
        controller=str(random.choice(CONTROLLERS)),
        kp=scale,
        ki=scale**2 * 10 ** random.uniform(-3, 0),
        kd=10 ** random.uniform(-1.5, 0.3),
        reference=random.uniform(-0.3, 0.3),
    )
    sampled = SampledPid(period=period, filter_time=period * 10 ** random.uniform(-1, 1.5))
    return loop, sampled, int(random.integers(0, 6))


def transfer(loop, sampled, delay):
    """The loop put together by python-control from its parts, as the law is written."""
    h, blend = sampled.period, 1 - math.exp(-sampled.period / sampled.filter_time)
    z = control.tf([1, 0], [1], dt=h)
    law = loop.kp + control.tf([0], [1], dt=h)
    if loop.integrates:
        law += loop.ki * h / (z - 1)
    if loop.derivative_gain:
        law += loop.kd * blend / h * (z - 1) / (z - 1 + blend)
    plant = control.sample_system(control.tf([root_slope(loop)], [1, 0]), h, method="zoh")
    late = control.tf([1], [1] + [0] * delay, dt=h) if delay else 1
    return law * plant * late


@pytest.mark.parametrize("seed", range(12))
def test_the_margins_are_those_of_python_control(seed):
    random = np.random.default_rng(seed)
    for _ in range(5):
        case = random_case(random)
        linear, expected = sampled_loop(*case), transfer(*case)
        grid = frequency_grid(linear)
        # Below, python-control's polynomials in z cancel.
        grid = grid[grid * linear.period > 0.02]
        np.testing.assert_allclose(
            linear.response(grid), expected(np.exp(1j * grid * linear.period)), rtol=1e-5
        )
        found = loop_margins(linear)
        poles = control.feedback(expected, 1).poles()
        assert found.stable == bool(np.all(np.abs(poles) < 1))
        if not found.stable:
            continue
        gain, phase, _, _, _, _ = control.stability_margins(expected, method="frd")
        if math.isfinite(phase):
            assert math.degrees(found.phase_margin) == pytest.approx(abs(phase), abs=0.05)
        if math.isfinite(found.gain_margin) and math.isfinite(gain) and gain > 1:
            assert found.gain_margin == pytest.approx(gain, rel=1e-3)
        fine = np.linspace(1e-4, math.pi, 20001)
        peak = 1 / np.abs(1 + expected(np.exp(1j * fine))).min()
        assert found.peak_sensitivity == pytest.approx(peak, rel=2e-3)


@pytest.mark.parametrize("controller", CONTROLLERS)
@pytest.mark.parametrize("delay", [0, 1, 7])
def test_poles_are_the_rates_at_which_the_sampled_law_really_moves(controller, delay):
    loop = StandoffLoop(controller=controller)
    sampled = SampledPid(period=0.01, filter_time=0.03)
    rest = wanted_equilibrium(loop).y

    def motion(perturbation, count):
        y = [rest + perturbation] * (delay + 1)
        memory = (0.0, 0.0, 0.0)
        for _ in range(count):
            estimate = y[-1 - delay] - float(loop.error.error(y[-1 - delay]))
            memory, command = pid_step(memory, estimate, 0.0, loop, sampled)
            y.append(y[-1] - sampled.period * command)
        return np.array(y[delay:]) - rest

    poles = sampled_loop(loop, sampled, delay).poles()
    y = motion(1e-7, 60)
    # A linear recurrence with the poles as its roots (Cayley-Hamilton) holds once the filter is on.
    recurrence = np.poly(poles).real
    misses = np.convolve(y, recurrence, mode="valid")[delay + 2 :]
    assert np.abs(misses).max() < 1e-5 * np.abs(y).max()


@pytest.mark.parametrize("controller", CONTROLLERS)
def test_fast_samples_have_the_delay_margin_of_the_continuous_loop(controller):
    loop = StandoffLoop(controller=controller, kd=0.5)
    sampled = SampledPid(period=1e-5, filter_time=0.02)
    found = loop_margins(sampled_loop(loop, sampled))
    expected = delay_margin(loop, 0.02 if loop.derivative_gain else 0.0)
    assert found.delay_margin == pytest.approx(expected.delay, rel=1e-3)


def test_p_control_swings_at_two_over_its_gain():
    loop = StandoffLoop(controller="P")
    period = 0.5 / (loop.kp * root_slope(loop))
    found = loop_margins(sampled_loop(loop, SampledPid(period=period)))
    assert found.stable
    assert found.gain_margin == pytest.approx(4.0)
    assert found.gain_frequency == pytest.approx(math.pi / period)
    np.testing.assert_allclose(found.poles, [0.5])
    too_fast = SampledPid(period=4.1 * period)
    assert not loop_margins(sampled_loop(loop, too_fast)).stable


def test_delay_alone_takes_the_margin_that_is_left():
    loop, sampled = StandoffLoop(controller="PI"), SampledPid(period=0.001)
    margin = loop_margins(sampled_loop(loop, sampled)).delay_margin
    for part, stable in ((0.98, True), (1.02, False)):
        late = sampled_loop(loop, sampled, round(part * margin / sampled.period))
        assert loop_margins(late).stable == stable


def test_the_filter_takes_in_a_sample_what_it_takes_in_a_time_constant():
    # A step of the miss leaves exp(-t / tau) of it in the derivative, whatever the sample time.
    for period in (0.05, 0.01, 0.0025):
        sampled = SampledPid(period=period, filter_time=0.02)
        assert sampled.blend == pytest.approx(1 - math.exp(-period / 0.02), rel=1e-12)
        loop = StandoffLoop(controller="PD", kp=1e-12, kd=1.0)
        state, _ = pid_step((0.0, 0.0, 1.0), 1.0 + loop.reference, 0.0, loop, sampled)
        for _ in range(round(0.1 / period) - 1):
            state, _ = pid_step(state, 1.0 + loop.reference, 0.0, loop, sampled)
        assert 1 - state[1] == pytest.approx(math.exp(-0.1 / 0.02), rel=1e-9)
