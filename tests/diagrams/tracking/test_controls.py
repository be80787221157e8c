"""Sliders, buttons and keys of the live page, in headless Chromium, steer the simulation."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.primitives import ConstantVectorSource

from sightfield.diagrams.tracking.controls import (
    LOSING_BUTTON,
    Controls,
    MeshcatVelocity,
    add_controls,
    make_monitor,
    read_controls,
    remove_controls,
)
from sightfield.diagrams.tracking.scene import View
from sightfield.diagrams.visuals.live_page import open_live_page
from sightfield.systems.numerics.errors import InvalidInput

pytestmark = pytest.mark.browser

SPEED = 0.4


@pytest.fixture(scope="module")
def page(meshcat, new_scene_page):
    return new_scene_page(meshcat.web_url())


@pytest.fixture
def controls(meshcat, page):
    """Fresh controls, which the page has."""
    add_controls(meshcat, pursuers=3, realtime_rate=2.0, losing_set=True)
    page.settle(meshcat)
    return meshcat


def press(meshcat, page, *keys: str) -> None:
    """Press keys on the page and wait until Meshcat has heard of them."""
    # A slider that only the tests have tells when what went before it has arrived.
    meshcat.AddSlider("heard", 0.0, 1.0, 1.0, 0.0)
    page.settle(meshcat)
    for key in keys:
        page.page.keyboard.press(key)
    page.page.evaluate("() => viewer.gui_controllers.heard.setValue(1)")
    for _ in range(1000):
        if meshcat.GetSliderValue("heard"):
            break
        page.page.wait_for_timeout(5)
    else:
        pytest.fail("the page was not heard")
    meshcat.DeleteSlider("heard")


def test_untouched_controls_say_what_they_started_with(controls):
    assert read_controls(controls) == Controls(
        realtime_rate=2.0, paused=False, stopped=False, view=View(chosen_pursuer=0)
    )


@pytest.mark.parametrize(
    ("keys", "view"),
    [
        (["BracketRight"], View(chosen_pursuer=1)),
        (["BracketRight"] * 5, View(chosen_pursuer=2)),
        (["BracketLeft"], View(chosen_pursuer=-1)),
        (["KeyF"], View(field_shown=False)),
        (["KeyF", "KeyF"], View()),
        (["KeyV"], View(polygon_shown=False)),
        (["KeyL"], View(losing_shown=False)),
    ],
)
def test_keys_choose_the_view(controls, page, keys, view):
    press(controls, page, *keys)
    assert read_controls(controls).view == view


def test_keys_change_the_speed_and_pause_and_stop(controls, page):
    press(controls, page, "Equal", "Equal", "Minus")
    assert read_controls(controls).realtime_rate == 2.25
    press(controls, page, "Space")
    assert read_controls(controls).paused
    press(controls, page, "Space", "Escape")
    assert not read_controls(controls).paused
    assert read_controls(controls).stopped


def test_buttons_can_be_clicked_and_sliders_moved(controls, page):
    page.page.evaluate("() => viewer.gui.open()")
    page.page.get_by_text("pause / resume").click()
    page.page.evaluate("() => viewer.gui_controllers.speed.setValue(5)")
    press(controls, page)
    assert read_controls(controls).paused
    assert read_controls(controls).realtime_rate == 5.0


def test_controls_can_be_put_on_again_and_taken_off(controls):
    add_controls(controls, pursuers=1)
    # Without a losing set there is nothing to switch.
    assert LOSING_BUTTON not in controls.GetButtonNames()
    assert read_controls(controls).view.losing_shown
    remove_controls(controls)
    remove_controls(controls)
    assert controls.GetButtonNames() == []


@pytest.mark.parametrize(
    ("name", "arguments"),
    [
        ("pursuers", {"pursuers": 0}),
        ("realtime_rate", {"pursuers": 1, "realtime_rate": -1.0}),
        ("realtime_rate", {"pursuers": 1, "realtime_rate": 21.0}),
    ],
)
def test_bad_starting_values_are_refused(meshcat, name, arguments):
    with pytest.raises(InvalidInput, match=f"`{name}` must"):
        add_controls(meshcat, **arguments)


@pytest.mark.parametrize("port", [-1, 80, 65536])
def test_a_port_out_of_range_is_refused(port):
    with pytest.raises(InvalidInput, match="`port` must"):
        open_live_page(port=port)


@pytest.fixture
def simulator(controls, page):
    """A simulation that obeys the page and has nothing else to do."""
    simulator = Simulator(ConstantVectorSource([1.0]))
    simulator.set_monitor(make_monitor(simulator, controls))
    return simulator


def test_the_simulation_takes_the_speed_of_the_slider(simulator, controls, page):
    press(controls, page, "Equal", "Equal")
    simulator.AdvanceTo(0.01)
    assert simulator.get_target_realtime_rate() == 2.5


def test_a_stopped_simulation_ends_early_and_says_why(simulator, controls, page):
    press(controls, page, "Escape")
    status = simulator.AdvanceTo(1000.0)
    assert "stopped on the page" in status.FormatMessage()
    assert simulator.get_context().get_time() < 1000.0


@pytest.mark.parametrize(("key", "end"), [("Space", 0.01), ("Escape", 0.0)])
def test_a_paused_simulation_waits_until_it_is_resumed_or_stopped(
    simulator, controls, page, monkeypatch, key, end
):
    press(controls, page, "Space")
    looks = []

    def wait(seconds):
        looks.append(simulator.get_context().get_time())
        if len(looks) == 5:
            page.page.keyboard.press(key)
        page.page.wait_for_timeout(1000 * seconds)

    monkeypatch.setattr("sightfield.diagrams.tracking.controls.time.sleep", wait)
    simulator.AdvanceTo(0.01)
    assert len(looks) >= 5
    assert set(looks) == {0.0}
    assert simulator.get_context().get_time() == end


@pytest.fixture
def steered(meshcat, page) -> Simulator:
    simulator = Simulator(MeshcatVelocity(meshcat, SPEED, period=0.1))
    simulator.Initialize()
    page.settle(meshcat)
    return simulator


def velocity(simulator) -> np.ndarray:
    context = simulator.get_context()
    return simulator.get_system().GetOutputPort("velocity").Eval(context)


@pytest.mark.parametrize(
    ("keys", "expected"),
    [
        ([], [0.0, 0.0]),
        (["ArrowRight"] * 2, [0.5 * SPEED, 0.0]),
        (["ArrowLeft"] * 9, [-SPEED, 0.0]),
        (
            ["ArrowUp"] * 4 + ["ArrowLeft"],
            [-0.25 * SPEED / np.hypot(1, 0.25), SPEED / np.hypot(1, 0.25)],
        ),
        (["ArrowDown"] * 4 + ["ArrowRight"] * 4, [SPEED * np.sqrt(0.5), -SPEED * np.sqrt(0.5)]),
    ],
)
def test_arrow_keys_steer_no_faster_than_the_speed(meshcat, page, steered, keys, expected):
    press(meshcat, page, *keys)
    steered.AdvanceTo(0.1)
    np.testing.assert_allclose(velocity(steered), expected, atol=1e-12)


def test_the_velocity_is_the_same_for_all_who_ask_within_a_period(meshcat, page, steered):
    steered.AdvanceTo(0.11)
    press(meshcat, page, "ArrowRight", "ArrowRight")
    steered.AdvanceTo(0.19)
    np.testing.assert_array_equal(velocity(steered), [0.0, 0.0])
    steered.AdvanceTo(0.21)
    np.testing.assert_allclose(velocity(steered), [0.5 * SPEED, 0.0])


@pytest.mark.parametrize(("name", "value"), [("speed", 0.0), ("period", -1.0)])
def test_a_velocity_without_speed_or_period_is_refused(meshcat, name, value):
    with pytest.raises(InvalidInput, match=f"`{name}` must be positive"):
        MeshcatVelocity(meshcat, **({"speed": SPEED} | {name: value}))
