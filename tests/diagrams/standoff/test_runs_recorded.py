"""Runs of `sightfield standoff simulate` and what its page shows are as recorded."""

import pytest

from sightfield.diagrams.standoff.laboratory import StandoffPage, draw_laboratory
from sightfield.diagrams.standoff.make_standoff import StandoffScenario
from sightfield.diagrams.visuals.live_page import open_live_page
from sightfield.systems.numerics.standoff.loop import ErrorModel, StandoffLoop
from sightfield.systems.numerics.standoff.sampled_loop import SampledPid

GAINS = "--kp 7 --ki 3.5 --kd 0.6"
CLOCK = "--period 0.02 --filter-time 0.05 --delay 0.04 --limit 0.5"


@pytest.mark.parametrize(
    ("words", "besides"),
    [
        (f"--controller PI {GAINS} {CLOCK} --noise 0.01 --seed 3 --seconds 2.5", ()),
        ("--controller P --start 1.6 --seconds 1.5 --no-feed-forward", ("scene",)),
        ("--controller PID --start 40 --seconds 3", ("scene",)),
    ],
    ids=["late", "far", "lost"],
)
def test_a_simulation_is_as_recorded(words, besides, as_it_was):
    as_it_was("standoff", "simulate", *words.split(), besides=besides, relative=1e-5)


@pytest.mark.parametrize(
    ("loop", "limit"),
    [
        (StandoffLoop(controller="PID", kp=8.0, ki=3.0, kd=0.5), 0.6),
        (StandoffLoop(controller="P", kp=12.0, reference=0.25), 0.4),
        (StandoffLoop(controller="PI", ki=7.0, error=ErrorModel(a=0.0)), 0.6),
        (StandoffLoop(controller="P", kp=200.0), 0.6),
        (StandoffLoop(controller="P", reference=0.7), 0.6),
    ],
    ids=["PID", "P", "straight", "unstable", "no-rest"],
)
def test_the_panels_of_the_page_are_as_recorded(loop, limit, drawn, as_recorded):
    clock = SampledPid(period=0.02, filter_time=0.05, limit=limit)
    scenario = StandoffScenario(loop=loop, sampled=clock, start=0.55, delay_samples=2)
    as_recorded(drawn(draw_laboratory(scenario)), relative=1e-5)


def test_the_sliders_of_the_page_are_as_recorded(as_recorded, meshcat_calls):
    loop = StandoffLoop(controller="PID", kp=80.0, ki=0.05, kd=1.26)
    page = StandoffPage(open_live_page(port=0), StandoffScenario(loop=loop, delay_samples=3))
    assert (page.scenario.loop.kp, page.scenario.loop.ki) == (60.0, 0.1)
    assert page.scenario.delay_samples == 3
    page.serve(0.01)
    calls = {key: told.calls[0] for key, told in meshcat_calls.items() if "SetObject" not in key}
    as_recorded(calls)
