"""The stand-off laboratory against other truths: regions state by state, margins by python-control.

Loops are drawn at random, other ones for another SEED.

    make bench ARGS="-k standoff"
    SEED=8 make bench ARGS="-k standoff"
"""

import math
import os
import runpy
import time
from functools import partial
from pathlib import Path

import control
import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.standoff.attraction import region_of_attraction
from sightfield.systems.numerics.standoff.loop import (
    CONTROLLERS,
    StandoffLoop,
    wanted_equilibrium,
)
from sightfield.systems.numerics.standoff.sampled_loop import (
    SampledPid,
    loop_margins,
    sampled_loop,
)
from sightfield.systems.numerics.standoff.sampled_region import (
    attracted_by_sampled,
    certified_ball,
    sampled_region,
)

pytestmark = pytest.mark.benchmarks

# The open loop, put together by python-control from its parts.
TESTS = Path(__file__).parents[1] / "tests" / "numerics" / "standoff" / "sampled"
transfer = runpy.run_path(str(TESTS / "test_margins.py"))["transfer"]

SEED = int(os.environ.get("SEED", "7"))
# Loops of the regions, states of each, and loops of the margins.
LOOPS, STATES, MARGINS = 100, 100, 1000


def drawn(random):
    """A loop with every imperfection, and the samples by which its estimate is late."""
    kp = 10 ** random.uniform(0, 1.5)
    loop = StandoffLoop(
        controller=str(random.choice(CONTROLLERS)),
        kp=kp,
        ki=kp**2 * 10 ** random.uniform(-1.3, -0.3),
        kd=random.uniform(0, 1.5),
        reference=random.uniform(0.1, 0.3),
    )
    sampled = SampledPid(
        period=10 ** random.uniform(-2.3, -1.3),
        filter_time=10 ** random.uniform(-2.3, -0.7),
        limit=10 ** random.uniform(-0.7, 0.5),
    )
    return loop, sampled, int(random.integers(0, 6))


def settles(loop, sampled, delay, y, integral):
    """Brute force, from the law as it is written: which states rest at the wanted equilibrium."""
    rest, error = wanted_equilibrium(loop).y, loop.error
    h, blend = sampled.period, 1 - math.exp(-sampled.period / sampled.filter_time)
    slowest = max(1 / loop.kp, loop.kp / loop.ki, sampled.filter_time, h)
    late = [y.copy() for _ in range(delay + 1)]
    filtered, z = None, integral.copy()
    with np.errstate(all="ignore"):
        for _ in range(math.ceil(60 * slowest / h) + math.ceil(20 / sampled.limit / h)):
            seen = late[0] - (error.a * late[0] ** 2 + error.b * late[0] + error.c)
            miss = seen - loop.reference
            filtered = miss if filtered is None else filtered
            rate = blend * (miss - filtered) / h
            wished = loop.kp * miss + loop.integral_gain * z + loop.derivative_gain * rate
            command = np.clip(wished, -sampled.limit, sampled.limit)
            z = z + h * (miss + (command - wished) / loop.kp)
            filtered = filtered + h * rate
            late = [*late[1:], late[-1] - h * command]
    return np.nanmax(np.abs(np.array(late) - rest), axis=0, initial=0.0) < 1e-3


def test_regions_with_delay_saturation_and_filter():
    random, agree, settled, took, loops = np.random.default_rng(SEED), 0, 0, 0.0, 0
    while loops < LOOPS:
        loop, sampled, delay = drawn(random)
        if certified_ball(loop, sampled, delay).radius == 0:
            # Unstable: nothing settles.
            continue
        loops += 1
        rest = wanted_equilibrium(loop).y
        y = rest + random.uniform(-2.0, 2.0, STATES)
        integral = random.uniform(-0.3, 0.3, STATES) * loop.integrates
        began = time.process_time()
        found = attracted_by_sampled(loop, sampled, y, integral, delay_samples=delay)
        took += time.process_time() - began
        expected = settles(loop, sampled, delay, y, integral)
        agree += int((found == expected).sum())
        settled += int(expected.sum())
    total = LOOPS * STATES
    print(
        f"\n{agree} of {total} states ({agree / total:.2%}) go where brute force takes them, "
        f"{settled} of them to rest; {took / LOOPS:.3f} CPU-s a loop"
    )


def test_margins_of_sampled_loops():
    random, worst, stable, same = np.random.default_rng(SEED), np.zeros(3), 0, 0
    for _ in range(MARGINS):
        loop, sampled, delay = drawn(random)
        found = margins(loop, sampled, delay)
        expected = transfer(loop, sampled, delay)
        poles = control.feedback(expected, 1).poles()
        same += found.stable == bool(np.all(np.abs(poles) < 1))
        if not found.stable:
            continue
        stable += 1
        gain, phase, *_ = control.stability_margins(expected, method="frd")
        angles = np.geomspace(1e-6, math.pi, 40001)
        peak = float(1 / np.abs(1 + expected(np.exp(1j * angles))).min())
        off = (
            abs(found.gain_margin / gain - 1) if math.isfinite(gain) and gain > 1 else 0.0,
            abs(math.degrees(found.phase_margin) - abs(phase)) if math.isfinite(phase) else 0.0,
            # Frequencies on a grid come as near to the peak as they do.
            peak / found.peak_sensitivity - 1,
        )
        worst = np.maximum(worst, off)
    print(
        f"\n{MARGINS} loops, {stable} of them stable, as python-control says of {same}; off by at "
        f"most {worst[0]:.1e} (gain) and {worst[1]:.1e} deg (phase); no more than {worst[2]:.1e} "
        "of a peak that a grid of 40,001 frequencies shows is missed"
    )


def margins(loop, sampled, delay):
    """What the laboratory says of a loop's margins."""
    return loop_margins(sampled_loop(loop, sampled, delay))


def test_time_of_analyses_at_extreme_gains():
    worst = {}
    for kp in 10.0 ** np.arange(-3, 7):
        for ratio in 10.0 ** np.arange(-10, 4):
            for controller in CONTROLLERS:
                try:
                    loop = StandoffLoop(controller=controller, kp=kp, ki=ratio * kp**2)
                except InvalidInput:
                    # A gain that is too large to be one.
                    continue
                sampled = SampledPid(period=0.03, limit=0.6)
                for name, analyse in (
                    ("region", partial(region_of_attraction, loop)),
                    ("sampled region", partial(sampled_region, loop, sampled, 2)),
                    ("margins", partial(margins, loop, sampled, 2)),
                ):
                    began = time.process_time()
                    analyse()
                    spent = time.process_time() - began, kp, ratio, controller
                    worst[name] = max(worst.get(name, spent), spent)
    print()
    for name, (spent, kp, ratio, controller) in worst.items():
        where = f"K_P {kp:g}, K_I / K_P^2 {ratio:g}, {controller}"
        print(f"{name}: {spent:.3f} CPU-s at most ({where})")
