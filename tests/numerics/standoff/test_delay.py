"""The delay margin: closed forms, and a pole on the imaginary axis."""

import cmath
import math

import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.standoff.loop import CONTROLLERS, StandoffLoop, root_slope
from sightfield.systems.numerics.standoff.response import delay_margin, open_loop


def test_a_proportional_loop_bears_a_quarter_turn():
    loop = StandoffLoop(controller="P")
    margin = delay_margin(loop)
    assert margin.frequency == pytest.approx(10 * root_slope(loop), rel=1e-12)
    assert margin.delay == pytest.approx(math.pi / (20 * root_slope(loop)), rel=1e-12)


@pytest.mark.parametrize("controller", CONTROLLERS)
@pytest.mark.parametrize("filter_time", [0.001, 0.02, 0.5])
@pytest.mark.parametrize("kd", [0.1, 1.0, 4.0])
def test_at_the_margin_the_delayed_loop_has_a_pole_on_the_axis(controller, filter_time, kd):
    loop = StandoffLoop(controller=controller, kd=kd)
    margin = delay_margin(loop, filter_time)
    turn = cmath.exp(-1j * margin.frequency * margin.delay)
    assert open_loop(loop, margin.frequency, filter_time) * turn == pytest.approx(-1, abs=1e-6)
    # No smaller delay at any frequency near by or far off does the same.
    for k in range(1, 4000):
        frequency = 10 ** (-1 + k / 1000)
        response = open_loop(loop, frequency, filter_time)
        if abs(abs(response) - 1) < 1e-4:
            assert (math.pi + cmath.phase(response)) / frequency > margin.delay * (1 - 1e-3)


def test_an_ideal_derivative_of_gain_above_one_bears_no_delay():
    loop = StandoffLoop(controller="PD", kd=1.0)
    assert delay_margin(loop).delay == 0
    # And with ever faster filters the margin goes there.
    margins = [delay_margin(loop, 10.0**-k).delay for k in range(1, 6)]
    assert margins == sorted(margins, reverse=True)
    assert margins[-1] < 1e-4
    assert delay_margin(StandoffLoop(controller="PD", kd=0.5)).delay > 0.1


def test_a_negative_filter_time_is_refused():
    with pytest.raises(InvalidInput, match="`filter_time` must be zero or positive"):
        delay_margin(StandoffLoop(), -0.1)
