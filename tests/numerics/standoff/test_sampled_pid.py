"""The sampled controller: its parts one by one, its limit, and its quiet start."""

import math

import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.standoff.loop import StandoffLoop
from sightfield.systems.numerics.standoff.sampled_loop import SampledPid, pid_step

FRESH = (0.0, 0.0, 0.0)


def test_the_first_command_is_proportional_without_a_kick():
    loop, sampled = StandoffLoop(kd=3.0), SampledPid()
    _, command = pid_step(FRESH, 0.7, 0.25, loop, sampled)
    assert command == pytest.approx(0.25 + 10 * 0.5)


def test_the_derivative_of_a_ramp_is_its_slope():
    loop = StandoffLoop(controller="PD", kp=1e-12, kd=2.0)
    sampled = SampledPid(period=0.01, filter_time=0.05)
    state, command = FRESH, 0.0
    for k in range(2000):
        state, command = pid_step(state, 0.3 * k * sampled.period, 0.0, loop, sampled)
    assert command == pytest.approx(2.0 * 0.3, rel=1e-9)


def test_the_integral_of_a_constant_miss_is_a_ramp():
    loop, sampled = StandoffLoop(controller="PI"), SampledPid(period=0.01)
    state = FRESH
    for _ in range(100):
        state, _ = pid_step(state, 0.5, 0.0, loop, sampled)
    assert state[0] == pytest.approx(0.3 * 1.0)


def test_the_command_keeps_its_limit_and_the_integral_does_not_wind_up():
    loop, sampled = StandoffLoop(controller="PI"), SampledPid(period=0.01, limit=0.4)
    state, command = FRESH, 0.0
    for _ in range(20000):
        state, command = pid_step(state, 1.2, 0.0, loop, sampled)
        assert abs(command) <= 0.4 + 1e-12
    # Where K_I z alone gives the limit, not 200 m s.
    assert state[0] == pytest.approx(0.4 / 5.0, rel=1e-3)
    _, command = pid_step(state, 0.1, 0.0, loop, sampled)
    assert command == pytest.approx(-0.4)


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"period": 0.0}, "`period` must be positive; got 0.0"),
        ({"filter_time": -1.0}, "`filter_time` must be positive; got -1.0"),
        ({"limit": 0.0}, "`limit` must be positive; got 0.0"),
        ({"limit": math.nan}, "`limit` must be a finite number; got nan"),
    ],
)
def test_bad_sampling_is_refused(parameters, message):
    with pytest.raises(InvalidInput) as caught:
        SampledPid(**parameters)
    assert str(caught.value) == message
