"""What sampling, filter, limit and delay make of stand-off loops is as recorded."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.standoff.loop import CONTROLLERS, ErrorModel, StandoffLoop
from sightfield.systems.numerics.standoff.sampled_loop import (
    SampledPid,
    Specification,
    design_gains,
    frequency_grid,
    loop_margins,
    pid_step,
    sampled_loop,
)
from sightfield.systems.numerics.standoff.sampled_region import (
    attracted_by_sampled,
    certified_ball,
    sampled_region,
)

ERROR = ErrorModel(a=0.9, b=-0.55, c=0.11)
CLOCK = SampledPid(period=0.04, filter_time=0.11)
LIMITED = SampledPid(period=0.04, filter_time=0.11, limit=0.5)


@pytest.fixture(params=CONTROLLERS)
def loop(request):
    return StandoffLoop(
        controller=request.param, kp=3.0, ki=2.2, kd=0.6, reference=0.25, error=ERROR
    )


@pytest.mark.parametrize("late", [0, 3])
def test_margins_are_as_recorded(loop, late, as_recorded):
    linear = sampled_loop(loop, CLOCK, late)
    as_recorded(linear.matrix(), "matrix")
    poles = np.abs(linear.poles()[:3])
    as_recorded(poles, "poles")
    as_recorded(linear.response(np.array([0.4, 3.0, 40.0])), "response")
    margins = loop_margins(linear)
    numbers = {k: v for k, v in vars(margins).items() if k not in ("poles", "peak_frequency")}
    as_recorded([numbers, linear.crossovers()], "margins")
    as_recorded(margins.peak_frequency, "peak", relative=1e-4)
    grid = frequency_grid(linear)
    as_recorded([len(grid), grid[0], grid[-1], grid.sum()], "grid")


@pytest.mark.parametrize("gain", [3.0, 30.0, 60.0])
def test_margins_of_loops_on_both_sides_of_the_limit_are_as_recorded(gain, as_recorded):
    loop = StandoffLoop(controller="PI", kp=gain, ki=0.3 * gain**2, reference=0.25, error=ERROR)
    linear = sampled_loop(loop, CLOCK, 1)
    margins = loop_margins(linear)
    assert margins.stable == (np.abs(linear.poles()).max() < 1)
    numbers = {k: v for k, v in vars(margins).items() if k not in ("poles", "peak_frequency")}
    as_recorded(numbers, relative=1e-5)
    as_recorded([certified_ball(loop, CLOCK, 1).radius, sampled_region(loop, CLOCK, 1)], "region")


@pytest.mark.parametrize("late", [0, 2])
@pytest.mark.parametrize("sampled", [CLOCK, LIMITED], ids=["free", "limited"])
def test_regions_are_as_recorded(loop, sampled, late, as_recorded):
    ball = certified_ball(loop, sampled, late)
    as_recorded([ball.radius, ball.parts, np.diag(ball.matrix)], "ball")
    as_recorded(sampled_region(loop, sampled, late), "region", relative=1e-5)
    rng = np.random.default_rng(1)
    starts, totals = rng.uniform(-9, 3, 80), rng.uniform(-1.5, 1.5, 80)
    held = attracted_by_sampled(loop, sampled, starts, totals, delay_samples=late)
    as_recorded("".join(map(str, held.astype(int))), "starts")


def test_steps_of_the_controller_are_as_recorded(loop, as_recorded):
    state, commands = (0.2, 0.0, 0.0), []
    for k in range(8):
        state, command = pid_step(state, 0.4 + 0.3 * math.sin(2.0 * k), 0.05, loop, LIMITED)
        commands.append([*state, command])
    as_recorded(commands)


@pytest.mark.parametrize("controller", CONTROLLERS)
def test_designs_are_as_recorded(controller, as_recorded):
    loop = StandoffLoop(controller=controller, reference=0.25, error=ERROR)
    asked = Specification(
        phase_margin=math.radians(52), gain_margin=1.8, peak_sensitivity=1.9, damping=0.8
    )
    for late, wish in ((0, asked), (2, None)):
        found = design_gains(loop, CLOCK, late, wish)
        name = f"{late} late, {'as asked' if wish else 'usual'}"
        gains = [found.loop.kp, found.loop.ki, found.loop.kd]
        as_recorded([gains, found.margins.stable, found.margins.phase_margin], name, relative=1e-5)
    as_recorded(str(asked), "asked")


@pytest.mark.parametrize(
    "name", ["phase_margin", "gain_margin", "peak_sensitivity", "delay_margin", "stable"]
)
def test_a_specification_holds_up_to_its_very_limits(name):
    loop = StandoffLoop(controller="PI", kp=3.0, ki=4.0)
    margins = loop_margins(sampled_loop(loop, SampledPid(period=0.03), 4))
    limits = {
        "phase_margin": margins.phase_margin,
        "gain_margin": margins.gain_margin,
        "peak_sensitivity": margins.peak_sensitivity,
        "delay_margin": margins.delay_margin,
    }
    assert Specification(**limits).holds(margins)
    if name == "stable":
        vars(margins)["stable"] = False
        assert not Specification(**limits).holds(margins)
        return
    stricter = 1 - 1e-6 if name == "peak_sensitivity" else 1 + 1e-6
    assert not Specification(**{**limits, name: stricter * limits[name]}).holds(margins)


def test_an_evader_is_passed_on_and_the_filter_starts_at_the_first_estimate():
    loop = StandoffLoop(kp=2.0, ki=0.5, kd=0.7, reference=0.2)
    memory, command = pid_step((0.3, 9.0, 0.0), 0.5, 0.11, loop, CLOCK)
    assert command == pytest.approx(0.11 + 2.0 * 0.3 + 0.5 * 0.3)
    assert memory == pytest.approx((0.3 + 0.04 * 0.3, 0.3, 1.0))
    blend = 1 - math.exp(-0.04 / 0.11)
    memory, command = pid_step(memory, 0.6, 0.0, loop, CLOCK)
    assert command == pytest.approx(0.8 + 0.5 * 0.312 + 0.7 * blend * 0.1 / 0.04)
    assert memory[1] == pytest.approx(0.3 + blend * 0.1)
