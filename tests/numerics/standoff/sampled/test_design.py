"""Gains by margins: they keep what was asked, and use it up."""

import math
from dataclasses import replace

import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.standoff.loop import (
    CONTROLLERS,
    StandoffLoop,
    root_slope,
    wanted_equilibrium,
)
from sightfield.systems.numerics.standoff.sampled_loop import (
    SampledPid,
    Specification,
    design_gains,
    loop_margins,
    sampled_loop,
)

CLOCK = SampledPid(period=0.02, filter_time=0.05)


@pytest.mark.parametrize("controller", CONTROLLERS)
def test_the_gains_keep_the_margins_and_a_tenth_more_does_not(controller):
    asked = Specification(phase_margin=math.radians(55), gain_margin=2.5, peak_sensitivity=1.7)
    found = design_gains(StandoffLoop(controller=controller), CLOCK, 2, asked)
    again = loop_margins(sampled_loop(found.loop, CLOCK, 2))
    assert asked.holds(again)
    more = replace(found.loop, kp=1.1 * found.loop.kp, ki=1.21 * found.loop.ki)
    assert not asked.holds(loop_margins(sampled_loop(more, CLOCK, 2)))


def test_p_gains_for_a_gain_margin_are_those_in_closed_form():
    # Without delay the gain margin of P is 2 / (h K_P s), and it is what binds here.
    asked = Specification(gain_margin=8.0, peak_sensitivity=100.0, phase_margin=0.01)
    loop = design_gains(StandoffLoop(controller="P"), CLOCK, 0, asked).loop
    assert loop.kp == pytest.approx(2 / (8.0 * CLOCK.period * root_slope(loop)), rel=1e-3)


def test_the_damping_asked_for_is_that_of_the_ideal_loop():
    asked = Specification(damping=0.7)
    loop = design_gains(StandoffLoop(controller="PI"), SampledPid(period=1e-3), 0, asked).loop
    pole, _ = wanted_equilibrium(loop).poles
    assert -pole.real / abs(pole) == pytest.approx(0.7)


def test_more_delay_costs_speed():
    speeds = [
        design_gains(StandoffLoop(controller="PI"), CLOCK, delay).loop.kp for delay in (0, 3, 9)
    ]
    assert speeds == sorted(speeds, reverse=True)
    assert speeds[2] < 0.5 * speeds[0]


def test_what_cannot_be_had_is_refused():
    with pytest.raises(InvalidInput, match=r"0 rad .* and 1\.571 rad .90 degrees.; got 2 rad"):
        Specification(phase_margin=2.0)
    with pytest.raises(InvalidInput, match="`damping` must be positive; got 0"):
        Specification(damping=0.0)
    with pytest.raises(InvalidInput, match="must be attainable"):
        design_gains(StandoffLoop(), CLOCK, 2, Specification(delay_margin=1e6))
