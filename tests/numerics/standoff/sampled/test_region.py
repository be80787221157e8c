"""Regions of the sampled loop: the law itself, state by state, and limits in closed form."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.standoff.attraction import region_of_attraction
from sightfield.systems.numerics.standoff.loop import (
    ErrorModel,
    StandoffLoop,
    root_slope,
    wanted_equilibrium,
)
from sightfield.systems.numerics.standoff.sampled_loop import SampledPid, pid_step
from sightfield.systems.numerics.standoff.sampled_region import (
    attracted_by_sampled,
    certified_ball,
    sampled_region,
)


def settles(loop, sampled, delay, y, integral, seconds):
    """Brute force: the shipped law, sample by sample, and where it is in the end."""
    rest, memory, started = wanted_equilibrium(loop).y, (integral, 0.0, 0.0), [y] * (delay + 1)
    late = started
    for _ in range(round(seconds / sampled.period)):
        estimate = late[0] - loop.error.error(late[0])
        memory, command = pid_step(memory, estimate, 0.0, loop, sampled)
        late = [*late[1:], late[-1] - sampled.period * command]
        if not abs(late[-1] - rest) < 1e3:
            return False
    return max(abs(each - rest) for each in late) < 1e-3


CASES = [
    (StandoffLoop(controller="P"), SampledPid(period=0.03, limit=0.6), 2),
    (StandoffLoop(controller="PI", ki=40.0), SampledPid(period=0.02, limit=0.5), 2),
    (StandoffLoop(controller="PD", kd=0.5), SampledPid(period=0.02, filter_time=0.05), 1),
    (StandoffLoop(ki=20.0, kd=0.5), SampledPid(period=0.02, filter_time=0.1, limit=1.0), 2),
]


@pytest.mark.parametrize(("loop", "sampled", "delay"), CASES, ids=lambda each: "")
def test_states_go_where_the_law_takes_them_one_by_one(loop, sampled, delay):
    random = np.random.default_rng(7)
    y = random.uniform(-1.5, 1.8, 40)
    integral = random.uniform(-0.3, 0.3, 40) if loop.integrates else np.zeros(40)
    found = attracted_by_sampled(loop, sampled, y, integral, delay_samples=delay)
    expected = [
        settles(loop, sampled, delay, *each, 12.0) for each in zip(y, integral, strict=True)
    ]
    assert 3 < sum(expected) < 38
    np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize(("loop", "sampled", "delay"), CASES, ids=lambda each: "")
def test_the_ends_of_the_region_part_what_settles_from_what_does_not(loop, sampled, delay):
    region = sampled_region(loop, sampled, delay)
    for end, inwards in ((region.low, 1), (region.high, -1)):
        if math.isfinite(end):
            assert settles(loop, sampled, delay, end + inwards * 1e-6, 0.0, 30.0)
            assert not settles(loop, sampled, delay, end - inwards * 1e-4, 0.0, 30.0)


@pytest.mark.parametrize(("loop", "sampled", "delay"), CASES, ids=lambda each: "")
def test_the_certified_ball_shrinks_into_itself(loop, sampled, delay):
    ball = certified_ball(loop, sampled, delay)
    assert ball.radius > 0
    random, rest = np.random.default_rng(3), wanted_equilibrium(loop).y
    for _ in range(50):
        direction = random.normal(size=len(ball.matrix))
        off = direction * ball.radius / math.sqrt(direction @ ball.matrix @ direction)
        state = np.zeros(len(ball.parts))
        state[ball.parts] = off
        late = rest + state[: delay + 1]
        estimate = late[-1] - loop.error.error(late[-1])
        memory = (state[-2], state[-1], 1.0)
        after, command = pid_step(memory, estimate, 0.0, loop, sampled)
        assert abs(command) < sampled.limit
        next_late = [late[0] - sampled.period * command, *late[:-1]]
        new = np.array([*np.array(next_late) - rest, after[0], after[1]])[ball.parts]
        assert new @ ball.matrix @ new < ball.radius**2


def test_p_control_far_below_jumps_over_the_other_equilibrium():
    # One sample takes y to y + h K_P f(y); the start that lands on y+ is the lower end.
    loop, sampled = StandoffLoop(controller="P"), SampledPid(period=0.01)
    (near, far), slope = (0.22096384, 1.43609830), 0.1 * 1.062
    # y + slope (y - near) (y - far) = far, of which y = far is a root.
    low = near - 1 / slope
    region = sampled_region(loop, sampled)
    assert region.low == pytest.approx(low, abs=1e-5)
    assert region.high == pytest.approx(far, abs=1e-6)


@pytest.mark.parametrize("controller", ["PI", "PID"])
def test_fast_samples_have_the_region_of_the_equation(controller):
    loop = StandoffLoop(controller=controller, kd=0.3, ki=20.0)
    found = sampled_region(loop, SampledPid(period=0.002, filter_time=0.004))
    expected = region_of_attraction(loop)
    assert found.low == pytest.approx(expected.low, rel=0.1)
    assert found.high == pytest.approx(expected.high, rel=0.02)


def test_a_straight_error_is_attracted_from_everywhere_and_an_unstable_clock_from_nowhere():
    line = StandoffLoop(controller="PI", error=ErrorModel(a=0.0))
    everywhere = sampled_region(line, SampledPid(period=0.01))
    assert (everywhere.low, everywhere.high) == (-math.inf, math.inf)
    slow = SampledPid(period=2.1 / (10 * root_slope(StandoffLoop())))
    assert sampled_region(StandoffLoop(controller="P"), slow) is None
    assert not attracted_by_sampled(StandoffLoop(controller="P"), slow, np.array([0.22])).any()
