"""Regions of attraction: closed forms, motions from both sides of each end, and mirror images."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.standoff.attraction import (
    certified_interval,
    energy,
    normalise,
    region_of_attraction,
)
from sightfield.systems.numerics.standoff.loop import (
    CONTROLLERS,
    ErrorModel,
    StandoffLoop,
    root_slope,
    span,
    wanted_equilibrium,
)
from sightfield.systems.numerics.standoff.response import (
    DIVERGED,
    SETTLED,
    SINGULAR,
    respond,
    still_integral,
)

OTHER, SINGULARITY = 1.4360983037093464, 2.7598 / 2.124


def swings_over(loop, start):
    """Whether a motion of the second-order equation passes the edge, by another solver and state.

    Otherwise it turns back before.
    """
    places = [OTHER, (1 / loop.derivative_gain + 1.7598) / 2.124] if loop.derivative_gain else []
    top = min(places, default=OTHER)

    def over(_, state):
        return top * (1 - 1e-6) - state[0]

    def back(_, state):
        return state[1] if state[0] > 0.3 else 1.0

    over.terminal = back.terminal = True
    path = solve_ivp(
        lambda _, state: [state[1], loop.acceleration(state[0], state[1])],
        (0, 50),
        [start, loop.rate(start)],
        method="DOP853",
        rtol=1e-11,
        atol=1e-12,
        events=(over, back),
    )
    return len(path.t_events[0]) > 0


@pytest.mark.parametrize(
    ("controller", "kd", "high"),
    [
        ("P", 1.0, OTHER),
        ("PI", 1.0, OTHER),
        ("PD", 0.5, OTHER),
        ("PID", 0.5, OTHER),
        ("PD", 1.0, SINGULARITY),
        ("PID", 1.0, SINGULARITY),
        ("PD", 2.0, (0.5 + 1.7598) / 2.124),
        ("PID", 2.0, (0.5 + 1.7598) / 2.124),
    ],
)
def test_the_far_end_is_the_other_equilibrium_or_the_singularity(controller, kd, high):
    region = region_of_attraction(StandoffLoop(controller=controller, kd=kd))
    assert region.high == pytest.approx(high, abs=1e-12)
    assert math.isinf(region.low) == (controller in ("P", "PD"))


@pytest.mark.parametrize(
    "loop",
    [
        StandoffLoop(controller="PI"),
        StandoffLoop(controller="PI", ki=50.0),
        StandoffLoop(controller="PID"),
        StandoffLoop(controller="PID", kd=0.5),
        StandoffLoop(controller="PID", kp=2.0, ki=30.0, kd=2.0),
    ],
    ids=str,
)
def test_the_near_end_agrees_with_bisection_of_motions(loop):
    low = region_of_attraction(loop).low
    inside, outside = low + 0.1, low - 0.1
    assert swings_over(loop, outside)
    assert not swings_over(loop, inside)
    while inside - outside > 1e-7:
        middle = (inside + outside) / 2
        inside, outside = (inside, middle) if swings_over(loop, middle) else (middle, outside)
    assert low == pytest.approx(inside, abs=1e-6)


@pytest.mark.parametrize("controller", CONTROLLERS)
@pytest.mark.parametrize("kd", [0.5, 1.0, 2.0])
def test_starts_just_inside_settle_and_starts_just_outside_do_not(controller, kd):
    loop = StandoffLoop(controller=controller, kd=kd)
    region, rest = region_of_attraction(loop), wanted_equilibrium(loop).y
    for end, inwards in ((region.low, 1), (region.high, -1)):
        if math.isfinite(end):
            inside, outside = end + inwards * 1e-6, end - inwards * 1e-6
            assert region.holds(inside)
            assert not region.holds(outside)
            assert respond(loop, inside).end == pytest.approx(rest, abs=1e-6)
            assert respond(loop, outside).end != pytest.approx(rest, abs=1e-2)


def test_each_start_outside_has_its_own_fate():
    def fate(start, **parameters):
        found = respond(StandoffLoop(**parameters), start)
        return found.outcome, pytest.approx(found.end)

    assert fate(1.5, controller="P") == (DIVERGED, math.inf)
    assert fate(1.5, controller="PD") == (SETTLED, OTHER)
    assert fate(1.5, controller="PD", kd=0.5) == (SINGULAR, 3.7598 / 2.124)
    assert fate(-11.0, controller="PI") == (DIVERGED, math.inf)
    assert fate(-3.0, controller="PID") == (SINGULAR, SINGULARITY)
    assert fate(1.35, controller="PID") == (SETTLED, OTHER)


def test_the_thesis_loops_settle_from_any_distance_below_if_they_start_at_rest():
    for controller in ("PI", "PID"):
        loop = StandoffLoop(controller=controller)
        assert region_of_attraction(loop, integral="still").low == -math.inf
        found = respond(loop, -50.0, integral=still_integral(loop, -50.0), duration=200.0)
        assert found.outcome == SETTLED


def test_a_strong_integral_bounds_the_starts_at_rest_too():
    loop = StandoffLoop(controller="PI", kp=1.0, ki=50.0)
    low = region_of_attraction(loop, integral="still").low
    for start, outcome in ((low + 1e-6, SETTLED), (low - 1e-6, DIVERGED)):
        found = respond(loop, start, integral=still_integral(loop, start))
        assert found.outcome == outcome


@pytest.mark.parametrize("c", [-1e3, -1e6, -1e9, -1e17])
def test_distances_far_from_zero_cost_no_accuracy(c):
    loop = StandoffLoop(error=ErrorModel(c=c))
    rest, length, slope = wanted_equilibrium(loop).y, span(loop), root_slope(loop)
    # Measured by the distance between its equilibria it is this loop, at 0 and 1.
    unit = StandoffLoop(
        kp=loop.kp * slope,
        ki=loop.ki * slope,
        kd=loop.kd * slope,
        reference=0.0,
        error=ErrorModel(a=1.0, b=0.0, c=0.0),
    )
    start = -1e-3
    found, alike = respond(loop, rest + start * length), respond(unit, start)
    expected = np.interp(found.times, alike.times, alike.y)
    assert np.abs((found.y - rest) / length - expected).max() < 1e-3 * abs(start)
    assert len(found.times) < 10_000


@pytest.mark.parametrize("controller", CONTROLLERS)
def test_the_mirrored_error_has_the_mirrored_region(controller):
    loop = StandoffLoop(controller=controller, kd=0.8)
    mirrored = replace(
        loop, reference=-loop.reference, error=ErrorModel(a=-1.062, b=-0.7598, c=-0.137)
    )
    region, image = region_of_attraction(loop), region_of_attraction(mirrored)
    assert (image.low, image.high) == pytest.approx((-region.high, -region.low), abs=1e-9)


def test_random_loops_go_where_their_regions_say():
    random = np.random.default_rng(4)
    for _ in range(5):
        loop = StandoffLoop(
            controller=str(random.choice(["PI", "PID"])),
            kp=10 ** random.uniform(0, 1.5),
            ki=10 ** random.uniform(-0.5, 1.5),
            kd=10 ** random.uniform(-1, 0.7),
            reference=random.uniform(-0.5, 0.5),
        )
        rest, region = wanted_equilibrium(loop).y, region_of_attraction(loop)
        for part in (0.5, 0.999):
            for end in (region.low, region.high):
                start = rest + part * (end - rest)
                assert respond(loop, start, duration=1e4).end == pytest.approx(rest, abs=1e-5)
        outside = region.low + 0.001 * (region.low - rest)
        assert respond(loop, outside, duration=1e4).end != pytest.approx(rest, abs=1e-3)


@pytest.mark.parametrize("controller", CONTROLLERS)
def test_the_energy_falls_along_every_motion_and_certifies_part_of_the_region(controller):
    loop = StandoffLoop(controller=controller)
    region, (low, high) = region_of_attraction(loop), certified_interval(loop)
    assert region.low < low < wanted_equilibrium(loop).y < high < region.high + 1e-9
    motion = respond(loop, max(region.low + 0.01, -5.0))
    values = energy(loop, motion.y, motion.integral)
    assert np.all(np.diff(values) <= 1e-9 * values[0])
    assert values[-1] == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize("kp", [1e4, 1e6])
@pytest.mark.parametrize(("controller", "power"), [("PI", 1.0), ("PID", 0.5)])
def test_a_weak_integral_attracts_from_as_far_as_its_leading_order_says(controller, power, kp):
    # Motions creep to the fold of m + w = 0, where w = other / 4, and leave: far away dw / dx is
    # ratio q, with q = 1 for PI and -2 damping x / other for PID.
    loop = StandoffLoop(controller=controller, kp=kp)
    unit = normalise(loop)
    wound = unit.other / 4
    reach = wound / unit.ratio
    if controller == "PID":
        reach = math.sqrt(wound * unit.other / (unit.ratio * unit.damping))
    low = region_of_attraction(loop).low
    assert low == pytest.approx(
        unit.rest - reach * unit.distance, rel=5 * unit.ratio ** (power / 2)
    )
    assert region_of_attraction(loop, integral="still").low == -math.inf


def test_a_start_on_the_singularity_is_refused():
    with pytest.raises(InvalidInput, match=r"`start` must not lie on the singularity at 1\.29934"):
        respond(StandoffLoop(controller="PD"), SINGULARITY)
    with pytest.raises(InvalidInput, match="`start` must be a finite number; got nan"):
        respond(StandoffLoop(controller="P"), math.nan)


def test_a_motion_is_followed_for_a_minute_unless_told_otherwise():
    loop = StandoffLoop(kp=0.01, ki=0.0, controller="P")
    start = wanted_equilibrium(loop).y + 0.1
    assert respond(loop, start).times[-1] == 60.0
    assert respond(loop, start, duration=7.0).times[-1] == 7.0
