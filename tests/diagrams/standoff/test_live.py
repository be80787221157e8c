"""The page with sliders: pictures follow the gains, in a browser too."""

import math

import numpy as np
import pytest

from sightfield.diagrams.standoff.laboratory import (
    DELAY,
    KP,
    StandoffPage,
    draw_laboratory,
    laboratory_image,
    sampled_response,
)
from sightfield.diagrams.standoff.make_standoff import StandoffScenario, run_standoff
from sightfield.diagrams.visuals.live_page import open_live_page
from sightfield.systems.numerics.standoff.loop import CONTROLLERS, ErrorModel, StandoffLoop
from sightfield.systems.numerics.standoff.sampled_loop import SampledPid

CLOCK = SampledPid(period=0.02, filter_time=0.05, limit=0.6)


def test_the_response_is_that_of_the_block_diagram():
    scenario = StandoffScenario(
        loop=StandoffLoop(kd=0.5), sampled=CLOCK, start=0.6, delay_samples=2
    )
    times, y = sampled_response(scenario, 3.0)
    run = run_standoff(scenario, 3.0)
    np.testing.assert_allclose(times, run.times)
    np.testing.assert_allclose(y, run.distance, atol=1e-9)


@pytest.mark.parametrize("controller", CONTROLLERS)
@pytest.mark.parametrize("a", [1.062, 0.0])
def test_every_controller_has_its_four_panels(controller, a):
    loop = StandoffLoop(controller=controller, kd=0.5, error=ErrorModel(a=a))
    scenario = StandoffScenario(loop=loop, sampled=CLOCK)
    assert len(draw_laboratory(scenario).axes) == 4


def test_an_unstable_loop_is_called_so():
    loop = StandoffLoop(controller="P", kp=200.0)
    title = draw_laboratory(StandoffScenario(loop=loop, sampled=CLOCK)).get_suptitle()
    assert title.endswith("UNSTABLE")
    assert math.isfinite(loop.kp)


@pytest.mark.browser
def test_a_slider_on_the_page_moves_the_loop(new_page):
    meshcat = open_live_page(port=0)
    page = StandoffPage(meshcat, StandoffScenario(loop=StandoffLoop(), sampled=CLOCK))
    assert not page.update()
    watched = new_page()
    watched.page.goto(meshcat.web_url())
    watched.page.wait_for_function("window.node && node('laboratory/picture')")
    for name, value in ((KP, 25), (DELAY, 3)):
        watched.page.evaluate(
            "([name, value]) => viewer.gui_controllers[name].setValue(value)", [name, value]
        )
    for _ in range(200):
        if meshcat.GetSliderValue(DELAY) == 3:
            break
        watched.page.wait_for_timeout(20)
    assert page.update()
    assert (page.scenario.loop.kp, page.scenario.delay_samples) == (25.0, 3)
    assert watched.complaints == []


@pytest.mark.browser
def test_the_whole_picture_is_on_a_page_of_any_shape(new_page):
    meshcat = open_live_page(port=0)
    page = StandoffPage(meshcat, StandoffScenario(loop=StandoffLoop(), sampled=CLOCK))
    watched = new_page()
    watched.page.goto(meshcat.web_url())
    watched.page.wait_for_function("window.node && node('laboratory/picture')")
    # As wide as it is drawn, and as high as the picture's proportion has it [m].
    rows, columns = laboratory_image(page.scenario).shape[:2]
    corners = np.array([[-1.0, -rows / columns], [1.0, rows / columns]])
    for size in ((1024, 768), (1280, 720), (1920, 1080), (400, 800)):
        watched.resize(*size)
        seen = watched.on_screen(corners)
        assert (seen >= 0).all()
        assert (seen <= size).all()
        assert np.ptp(seen[:, 0]) > 0.75 * size[0]
    assert watched.complaints == []


class Clock:
    """One that goes on as somebody sleeps, and a little as somebody looks at it."""

    def __init__(self):
        self.now, self.naps = 0.0, []

    def monotonic(self):
        self.now += 1e-3
        return self.now

    def sleep(self, seconds):
        self.now += seconds
        self.naps.append(seconds)


def test_between_two_looks_at_sliders_that_rest_the_page_sleeps(monkeypatch):
    page = StandoffPage(open_live_page(port=0), StandoffScenario(loop=StandoffLoop()))
    clock = Clock()
    monkeypatch.setattr("sightfield.diagrams.standoff.laboratory.time", clock)
    looks, update = [], page.update
    monkeypatch.setattr(page, "update", lambda: looks.append(update()) or looks[-1])
    page.serve(0.4)
    assert not any(looks)
    assert len(clock.naps) == len(looks) > 1
    assert min(clock.naps) > 0.01
