"""Analyses by Drake and python-control agree with the closed forms."""

import json
import math

import numpy as np
import pytest

from sightfield.diagrams.standoff.analysis import (
    analyse_standoff,
    drake_poles,
    frequency_response,
    root_locus,
    sum_of_squares_certificate,
)
from sightfield.diagrams.standoff.pictures import draw_phase_portrait
from sightfield.systems.numerics.standoff.attraction import region_of_attraction
from sightfield.systems.numerics.standoff.loop import (
    CONTROLLERS,
    ErrorModel,
    StandoffLoop,
    equilibria,
    wanted_equilibrium,
)
from sightfield.systems.numerics.standoff.response import (
    SETTLED,
    crossover_frequencies,
    open_loop,
    respond,
)


@pytest.mark.parametrize("controller", CONTROLLERS)
@pytest.mark.parametrize("kd", [0.5, 1.0, 2.0])
def test_drake_finds_the_poles_in_closed_form(controller, kd):
    loop = StandoffLoop(controller=controller, kd=kd)
    for each in equilibria(loop):
        np.testing.assert_allclose(drake_poles(loop, each.y), each.poles, atol=1e-6)


@pytest.mark.parametrize("controller", CONTROLLERS)
def test_the_locus_of_python_control_passes_through_the_poles(controller):
    loop = StandoffLoop(controller=controller, kd=0.7)
    locus = root_locus(loop, np.array([1.0, 2.0]))
    poles = sorted(locus.poles[0], key=abs)
    np.testing.assert_allclose(poles, wanted_equilibrium(loop).poles, atol=1e-6)


@pytest.mark.parametrize("controller", CONTROLLERS)
@pytest.mark.parametrize("filter_time", [0.0, 0.02])
def test_the_bode_diagram_of_python_control_is_the_open_loop(controller, filter_time):
    loop = StandoffLoop(controller=controller, kd=0.5)
    frequencies = np.geomspace(0.01, 1000, 30)
    found = frequency_response(loop, frequencies, filter_time)
    expected = [open_loop(loop, each, filter_time) for each in frequencies.tolist()]
    np.testing.assert_allclose(found.response, expected, rtol=1e-9)
    assert found.crossover == pytest.approx(crossover_frequencies(loop, filter_time)[-1], rel=1e-6)


@pytest.mark.parametrize("controller", CONTROLLERS)
@pytest.mark.parametrize("kd", [0.5, 1.0])
def test_sums_of_squares_certify_a_part_of_the_region(controller, kd):
    loop = StandoffLoop(controller=controller, kd=kd)
    found, region = sum_of_squares_certificate(loop), region_of_attraction(loop)
    assert found is not None
    assert region.low < found.low < found.rest[0] < found.high <= region.high
    # On one state nothing but the equilibrium or the singularity bounds it.
    if not loop.integrates:
        assert found.high == pytest.approx(region.high, abs=1e-5)
    # On its rim every motion settles, and V falls.
    for angle in np.linspace(0, 2 * np.pi, 9):
        direction = np.array([np.cos(angle), np.sin(angle)])[: len(found.rest)]
        if abs(direction[0]) < 1e-9 and len(direction) == 1:
            continue
        off = direction / math.sqrt(direction @ found.matrix @ direction)
        start = found.rest + 0.9999 * off
        integral = float(start[1]) if loop.integrates else 0.0
        motion = respond(loop, float(start[0]), integral=integral)
        assert motion.outcome == SETTLED
        assert motion.end == pytest.approx(found.rest[0], abs=1e-6)
        states = np.column_stack([motion.y, motion.integral])[:, : len(found.rest)]
        values = found.value(states)
        assert values[0] == pytest.approx(0.9998, abs=1e-4)
        assert np.all(np.diff(values) < 1e-6)


@pytest.mark.parametrize("controller", CONTROLLERS)
def test_an_analysis_reads_as_promised(controller):
    found = analyse_standoff(StandoffLoop(controller=controller))
    thing = found.as_object()
    json.dumps(thing, allow_nan=False)
    assert thing["controller"] == controller
    near, far = thing["equilibria"]
    assert list(near) == ["y", "stable", "stable_in_equation", "poles"]
    assert near["y"] == pytest.approx(0.2209638432, abs=1e-9)
    assert far["y"] == pytest.approx(1.4360983037, abs=1e-9)
    assert near["stable"] is True
    assert far["stable_in_equation"] is ("D" in controller)
    assert far["stable"] is False
    assert len(near["poles"]) == (2 if "I" in controller else 1)
    singular = [1.2993408663] if "D" in controller else []
    assert thing["singularities"] == pytest.approx(singular, abs=1e-9)
    low, high = thing["region_of_attraction"]
    expected = {"P": None, "PD": None, "PI": -10.7614075, "PID": -2.2716956}[controller]
    assert low == (expected if expected is None else pytest.approx(expected, abs=1e-6))
    assert high == pytest.approx(1.2993408663 if singular else 1.4360983037, abs=1e-9)


@pytest.mark.parametrize(("kp", "share"), [(1e-2, 1e3), (1e6, 1e-10), (1e6, 1e3)])
def test_analyses_end_whatever_the_gains(kp, share):
    loop = StandoffLoop(kp=kp, ki=share * kp**2)
    found = analyse_standoff(loop)
    assert found.region.low < found.wanted.y < found.region.high
    assert found.sampled_margins.stable == (kp < 1)


def test_the_bias_is_the_error_at_rest():
    found = analyse_standoff(StandoffLoop())
    assert found.bias == pytest.approx(found.loop.error.error(found.wanted.y))
    assert not found.loop.error.covers(found.wanted.y)
    assert [each.calibrated for each in found.held] == [False, True, False]


def test_an_error_that_bends_the_other_way_is_analysed_too():
    loop = StandoffLoop(
        controller="PID", reference=-0.2, error=ErrorModel(a=-1.062, b=-0.7598, c=-0.137)
    )
    found, mirrored = analyse_standoff(loop), analyse_standoff(StandoffLoop(controller="PID"))
    assert found.certificate is not None
    assert mirrored.certificate is not None
    assert found.region.high == pytest.approx(-mirrored.region.low, abs=1e-8)
    assert found.certificate.low == pytest.approx(-mirrored.certificate.high, abs=1e-4)
    assert found.energy_interval[0] == pytest.approx(-mirrored.energy_interval[1])


def test_without_a_certificate_the_rest_of_the_analysis_stands(monkeypatch):
    def demand_that_fails(*_):
        raise SystemExit("condition 'result.is_success()' failed")

    module = "sightfield.diagrams.standoff.analysis.DrakeRegion"
    monkeypatch.setattr(module, demand_that_fails)
    found = analyse_standoff(StandoffLoop())
    assert found.certificate is None
    assert found.region == region_of_attraction(StandoffLoop())
    (axes,) = draw_phase_portrait(found).axes
    assert "certified by sums of squares" not in axes.get_legend_handles_labels()[1]
