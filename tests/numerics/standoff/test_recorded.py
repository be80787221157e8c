"""Equilibria, motions, regions and margins of stand-off loops are as recorded."""

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.standoff.attraction import (
    attracted_states,
    certified_interval,
    energy,
    normalise,
    region_of_attraction,
    separatrix,
)
from sightfield.systems.numerics.standoff.loop import (
    CONTROLLERS,
    ErrorModel,
    StandoffLoop,
    equilibria,
    held_equilibria,
    root_slope,
    singularities,
    span,
)
from sightfield.systems.numerics.standoff.response import (
    crossover_frequencies,
    delay_margin,
    open_loop,
    respond,
    still_integral,
)

GAINS = {"kp": 3.0, "ki": 2.2, "kd": 0.6}
ERRORS = {
    "bent": ErrorModel(a=0.9, b=-0.55, c=0.11, shortest=0.3, longest=1.3),
    "bent the other way": ErrorModel(a=-0.7, b=-0.4, c=0.2, shortest=0.1, longest=1.1),
}


@pytest.fixture(params=CONTROLLERS)
def controller(request):
    return request.param


@pytest.fixture(params=ERRORS)
def loop(request, controller):
    return StandoffLoop(controller=controller, reference=0.3, error=ERRORS[request.param], **GAINS)


def test_where_a_loop_rests_is_as_recorded(loop, as_recorded):
    as_recorded([equilibria(loop), held_equilibria(loop), singularities(loop), span(loop)])


def test_regions_are_as_recorded(loop, as_recorded):
    as_recorded([certified_interval(loop), region_of_attraction(loop)], "interval")
    as_recorded(energy(loop, np.array([0.2, 0.7]), np.array([0.3, -0.6])), "energy")
    as_recorded(normalise(loop), "normalised")
    if loop.integrates:
        as_recorded(region_of_attraction(loop, integral="still"), "still")
        border = separatrix(loop)
        as_recorded([border.saddle, border.empty, border.still], "border")
        as_recorded(len(border.points), "points", relative=0.02)
        rng = np.random.default_rng(0)
        y, total = rng.uniform(-2, 2.5, 60), rng.uniform(-2, 2, 60)
        as_recorded("".join(map(str, attracted_states(loop, y, total).astype(int))), "states")


def test_motions_are_as_recorded(loop, as_recorded):
    for start in (-0.4, 0.35, 0.8, 2.2):
        found = respond(loop, start, duration=3.0, integral=0.1)
        last = found.y[-1] if abs(found.y[-1]) < 1e3 else np.inf
        as_recorded([found.outcome, found.end, last], f"from {start}", relative=1e-5)
    found = respond(loop, 0.35)
    as_recorded([found.outcome, found.end, found.times[-1]], "long", relative=1e-3)
    as_recorded(still_integral(loop, 0.9), "still")


@pytest.mark.parametrize("filter_time", [0.0, 0.05])
def test_margins_of_delay_are_as_recorded(loop, filter_time, as_recorded):
    response = [open_loop(loop, frequency, filter_time) for frequency in (0.3, 2.0, 9.0)]
    as_recorded([response, crossover_frequencies(loop, filter_time)], "loop")
    as_recorded(delay_margin(loop, filter_time), "margin")


@pytest.mark.parametrize("ki", [2.2, 0.004], ids=["strong", "weak"])
@pytest.mark.parametrize("bent", ERRORS)
def test_a_border_at_the_singularity_is_as_recorded(bent, ki, as_recorded):
    loop = StandoffLoop(controller="PID", kp=3.0, ki=ki, kd=2.5, reference=0.3, error=ERRORS[bent])
    (place,) = singularities(loop)
    assert abs(separatrix(loop).saddle[0] - place) < 1e-9
    border = separatrix(loop)
    as_recorded([normalise(loop), border.saddle, border.empty, border.still], relative=1e-5)
    as_recorded([certified_interval(loop), region_of_attraction(loop)], "interval", relative=1e-5)
    rng = np.random.default_rng(2)
    y, total = rng.uniform(-2, 2.5, 60), rng.uniform(-2, 2, 60)
    as_recorded("".join(map(str, attracted_states(loop, y, total).astype(int))), "states")


def test_a_weak_integral_creeps_as_recorded(as_recorded):
    loop = StandoffLoop(controller="PID", kp=8.0, ki=0.02, kd=0.4, error=ERRORS["bent"])
    border = separatrix(loop)
    as_recorded([border.saddle, border.empty, border.still, border.points[:4]], relative=1e-5)
    found = respond(loop, 0.9, integral=0.5, duration=400.0)
    as_recorded([found.outcome, found.end], "motion")


def test_an_interval_holds_what_lies_between_its_ends():
    region = region_of_attraction(StandoffLoop(controller="P"))
    assert not region.holds(region.high)
    assert region.holds(np.nextafter(region.high, -1))
    assert region.holds(-1e9)


def test_the_calibrated_range_holds_its_ends():
    model = ERRORS["bent"]
    assert model.covers(0.3)
    assert model.covers(1.3)
    assert not model.covers(0.2999)
    assert not model.covers(1.3001)


@pytest.mark.parametrize("controller", CONTROLLERS)
def test_a_straight_error_is_as_recorded(controller, as_recorded):
    straight = ErrorModel(a=0.0, b=-0.55, c=0.11, shortest=0.3, longest=1.3)
    loop = StandoffLoop(controller=controller, reference=0.3, error=straight, **GAINS)
    as_recorded([equilibria(loop), held_equilibria(loop), singularities(loop), span(loop)], "rest")
    as_recorded([certified_interval(loop), region_of_attraction(loop)], "interval")
    assert attracted_states(loop, np.array([9.0, -99.0]), np.zeros(2)).tolist() == [True, True]
    found = respond(loop, 4.0, integral=0.3)
    as_recorded([found.outcome, found.end], "motion", relative=1e-5)
    if loop.integrates:
        as_recorded(respond(loop, 0.9, integral=still_integral(loop, 0.9)).end, "still")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"error": ErrorModel(a=0.0, b=1.0)}, "`b` must be less than 1 for a = 0"),
        ({"reference": 0.6}, "`reference` must be less than"),
        ({"error": ErrorModel(a=-1.0), "reference": -9.0}, "`reference` must be more than"),
    ],
)
def test_loops_without_an_equilibrium_are_refused(change, message):
    with pytest.raises(InvalidInput, match=message):
        equilibria(StandoffLoop(**change))


def test_an_integral_is_as_weak_or_strong_as_numbers_can_tell():
    unit = 3.0**2 * root_slope(StandoffLoop())
    strongest = 1e12 * unit / (1 + 0.6 * root_slope(StandoffLoop()))
    for ki, good in (
        (1.001e-14 * unit, True),
        (0.999e-14 * unit, False),
        (0.999 * strongest, True),
        (1.001 * strongest, False),
    ):
        loop = StandoffLoop(kp=3.0, kd=0.6, ki=ki)
        if good:
            assert normalise(loop).ratio == pytest.approx(ki / unit)
        else:
            with pytest.raises(InvalidInput, match="`ki` must lie between"):
                normalise(loop)


def test_starts_are_finite_and_off_the_singularity():
    loop = StandoffLoop(controller="PD")
    (place,) = singularities(loop)
    for start in (place, np.inf, np.nan):
        with pytest.raises(InvalidInput, match="`start` must"):
            respond(loop, start)
    for wrong in ({"duration": 0.0}, {"duration": -1.0}):
        with pytest.raises(InvalidInput, match="`duration` must"):
            respond(loop, 0.5, **wrong)
    with pytest.raises(InvalidInput, match="`integral` must be empty or still"):
        region_of_attraction(loop, integral="full")
    with pytest.raises(InvalidInput, match="`shortest` must be less than longest"):
        ErrorModel(shortest=1.0, longest=1.0)
