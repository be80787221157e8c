"""The closed loop's equations follow from the block diagram, and the printed ones do not."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.standoff.loop import CONTROLLERS, StandoffLoop


def block_diagram_rate(loop, y, integral):
    """y' that the loop round the derivative settles on, found by iterating it, damped."""
    rate, gain = 0.0, loop.derivative_gain * loop.slope(y)
    for _ in range(500):
        drive = loop.kp * loop.miss(y) + loop.integral_gain * integral
        rate += (drive + gain * rate - rate) / (1 + abs(gain))
    return rate


def rate_of_the_rate(loop, y, integral, step=1e-5):
    """y'' by central differences along the motion."""
    rate, growth = loop.rate(y, integral), loop.miss(y)
    ahead = loop.rate(y + step * rate, integral + step * growth)
    behind = loop.rate(y - step * rate, integral - step * growth)
    return (ahead - behind) / (2 * step)


@pytest.mark.parametrize("controller", CONTROLLERS)
@pytest.mark.parametrize("y", [-0.5, 0.1, 0.6, 0.8])
def test_the_rate_solves_the_loop_round_the_derivative(controller, y):
    loop = StandoffLoop(controller=controller, kd=1.7)
    integral = 0.3 if loop.integrates else 0.0
    assert loop.rate(y, integral) == pytest.approx(block_diagram_rate(loop, y, integral), rel=1e-9)


@pytest.mark.parametrize("controller", ["PI", "PID"])
@pytest.mark.parametrize("kd", [0.3, 1.0, 2.5])
def test_the_acceleration_is_the_rate_of_the_rate(controller, kd):
    loop = StandoffLoop(controller=controller, kd=kd)
    found = loop.acceleration(0.1, loop.rate(0.1, 0.2))
    assert found == pytest.approx(rate_of_the_rate(loop, 0.1, 0.2), rel=1e-6)


@pytest.mark.parametrize(("kd", "right"), [(0.3, False), (1.0, True), (2.5, False)])
def test_the_printed_denominator_of_2_12_is_right_for_a_derivative_gain_of_one_only(kd, right):
    loop = StandoffLoop(controller="PID", kd=kd)
    y, rate = 0.1, loop.rate(0.1, 0.2)
    a, b = loop.error.a, loop.error.b
    pull = loop.kp * loop.slope(y) * rate + loop.ki * loop.miss(y) + 2 * a * kd * rate**2
    printed = pull / (1 - 2 * a * kd * y - (b - 1))
    assert (printed == pytest.approx(rate_of_the_rate(loop, y, 0.2), rel=1e-6)) is right


def test_pd_is_of_first_order():
    # Printed as y'' = K_P f / (1 - K_D f'), which would start from rest without moving.
    loop = StandoffLoop(controller="PD")
    f, slope = 0.17163, -1.5474
    assert loop.rate(0.1) == pytest.approx(10 * f / (1 - slope), rel=1e-4)


def test_arrays_go_through():
    loop = StandoffLoop()
    y = np.array([0.1, 0.5])
    assert loop.rate(y, np.zeros(2)).tolist() == [loop.rate(0.1), loop.rate(0.5)]


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"controller": "pid"}, "`controller` must be one of P, PI, PD, PID; got pid"),
        ({"kp": -1.0}, "`kp` must be positive; got -1.0"),
        ({"kp": 0.0}, "`kp` must be positive; got 0.0"),
        ({"kp": math.nan}, "`kp` must be a finite number; got nan"),
        ({"ki": -5.0}, "`ki` must be positive; got -5.0"),
        ({"controller": "P", "ki": -5.0}, "`ki` must be zero or positive; got -5.0"),
        ({"kd": -1.0}, "`kd` must be zero or positive; got -1.0"),
        ({"kd": math.inf}, "`kd` must be a finite number; got inf"),
        ({"reference": math.nan}, "`reference` must be a finite number; got nan"),
    ],
)
def test_bad_parameters_are_refused(parameters, message):
    with pytest.raises(InvalidInput) as caught:
        StandoffLoop(**parameters)
    assert str(caught.value) == message
