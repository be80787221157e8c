"""A page with sliders on which one turns a stand-off loop's gains and sees what they do.

It shows one picture: response, poles, Nyquist's diagram and the region that is attracted.
"""

import math
import time
from dataclasses import replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from pydrake.geometry import Meshcat, Rgba

from ...systems.numerics.errors import InvalidInput
from ...systems.numerics.standoff.loop import equilibria, span, wanted_equilibrium
from ...systems.numerics.standoff.sampled_loop import (
    LoopMargins,
    frequency_grid,
    loop_margins,
    pid_step,
    sampled_loop,
)
from ...systems.numerics.standoff.sampled_region import attracted_by_sampled
from ..visuals.lighting import picture_square
from ..visuals.stage import end_on_this_thread
from .make_standoff import StandoffScenario
from .pictures import PURSUER, REFERENCE, REGION, SINGULAR, draw_nyquist_plane

# Of the response [s], and points along a side of the region's picture.
_SECONDS, _CELLS = 6.0, 48


def draw_laboratory(scenario: StandoffScenario) -> Figure:
    """Four panels of the loop as a computer closes it, behind an evader that stands still.

    Args:
        scenario: Loop, clock, delay and start. A loop that cannot be is said to be so.
    """
    figure = Figure(figsize=(14, 7.875), dpi=100, layout="constrained")
    loop, clock = scenario.loop, scenario.sampled
    gains = f"{loop.controller}: $K_P$ = {loop.kp:g} 1/s"
    if loop.integrates:
        gains += f", $K_I$ = {loop.ki:g} 1/s²"
    if loop.derivative_gain:
        gains += f", $K_D$ = {loop.kd:g}"
    gains += f"; {1000 * clock.period * scenario.delay_samples:g} ms late"
    try:
        linear = sampled_loop(loop, clock, scenario.delay_samples)
        margins = loop_margins(linear)
        equilibria(loop)
    except InvalidInput as error:
        figure.text(0.5, 0.5, str(error), ha="center", wrap=True)
        return figure
    (response, poles), (nyquist, region) = figure.subplots(2, 2)
    _draw_response(response, scenario)
    _draw_poles(poles, margins, clock.period)
    draw_nyquist_plane(nyquist, linear, margins, frequency_grid(linear))
    _draw_region(region, scenario)
    verdict = f"Ms = {margins.peak_sensitivity:.2f}" if margins.stable else "UNSTABLE"
    figure.suptitle(f"{gains}: {verdict}", color="black" if margins.stable else SINGULAR)
    return figure


def laboratory_image(scenario: StandoffScenario) -> np.ndarray:
    """What `draw_laboratory` draws as red, green, blue, shape (rows, columns, 3), uint8.

    Args:
        scenario: See `draw_laboratory`.
    """
    canvas = FigureCanvasAgg(draw_laboratory(scenario))
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[:, :, :3].copy()


def sampled_response(scenario: StandoffScenario, seconds: float) -> tuple[np.ndarray, np.ndarray]:
    """The shipped law behind an evader that stands still, without noise.

    Args:
        scenario: Loop, clock, delay and start.
        seconds: How long [s].

    Returns:
        Times and distances, each of shape (n,) [s], [m]; to the end, or until it is lost.
    """
    loop, clock = scenario.loop, scenario.sampled
    late = [scenario.start] * (scenario.delay_samples + 1)
    memory, distances = (0.0, 0.0, 0.0), [scenario.start]
    bound = 100 * max(span(loop), abs(scenario.start))
    for _ in range(round(seconds / clock.period)):
        estimate = late[0] - loop.error.error(late[0])
        memory, command = pid_step(memory, estimate, 0.0, loop, clock)
        late = [*late[1:], late[-1] - clock.period * command]
        distances.append(late[-1])
        if not abs(late[-1]) < bound:
            break
    return clock.period * np.arange(len(distances)), np.array(distances)


def _draw_response(axes: Axes, scenario: StandoffScenario) -> None:
    times, y = sampled_response(scenario, _SECONDS)
    rest = wanted_equilibrium(scenario.loop).y
    axes.plot(times, y, color=PURSUER)
    axes.axhline(rest, color="black", lw=0.8)
    axes.axhline(scenario.loop.reference, color=REFERENCE, ls="--", lw=1)
    reach = max(1.6 * abs(scenario.start - rest), 0.05)
    axes.set_ylim(rest - reach, rest + reach)
    axes.set_xlim(0, _SECONDS)
    axes.set_xlabel("time [s]")
    axes.set_ylabel("true distance y [m]")
    axes.set_title(f"response: rests at {rest:.3f} m, {scenario.loop.reference:g} m asked for")


def _draw_poles(axes: Axes, margins: LoopMargins, period: float) -> None:
    angle = np.linspace(0, 2 * np.pi, 200)
    axes.plot(np.cos(angle), np.sin(angle), ":", color="black", lw=0.8)
    colour = PURSUER if margins.stable else SINGULAR
    axes.plot(margins.poles.real, margins.poles.imag, "x", color=colour, ms=9, mew=2)
    reach = max(1.15, 1.1 * float(np.abs(margins.poles).max()))
    axes.set_xlim(-1.6 * reach, 1.6 * reach)
    axes.set_ylim(-reach, reach)
    axes.set_aspect("equal")
    slowest = float(np.abs(margins.poles[0]))
    words = "poles z, stable inside the circle"
    if 0 < slowest < 1:
        words += f"; slowest: {-period / math.log(slowest):.3g} s"
    axes.set_title(words)
    axes.set_xlabel("real part")
    axes.set_ylabel("imaginary part")


def _draw_region(axes: Axes, scenario: StandoffScenario) -> None:
    loop, clock = scenario.loop, scenario.sampled
    places = [each.y for each in equilibria(loop)]
    width = span(loop)
    low, high = places[0] - 1.5 * width, places[-1] + 0.5 * width
    # An integral that is worth as much as the largest miss, between the equilibria and beyond.
    top = 0.5 * loop.kp * width / loop.ki if loop.integrates else 1.0
    rows = _CELLS if loop.integrates else 2
    y, total = np.meshgrid(np.linspace(low, high, _CELLS), np.linspace(-top, top, rows))
    asked = -total if loop.integrates else 0.0
    held = attracted_by_sampled(loop, clock, y, asked, delay_samples=scenario.delay_samples)
    axes.contourf(y, total, held.astype(float), levels=[0.5, 1.5], colors=[REGION])
    axes.plot(places, np.zeros(len(places)), "o", color="black", mfc="white")
    axes.plot(places[0 if loop.error.a >= 0 else -1], 0, "o", color="black")
    axes.plot(scenario.start, 0, "x", color=PURSUER, ms=9, mew=2)
    axes.axhline(0, color="black", lw=0.5)
    axes.set_xlim(low, high)
    axes.set_ylim(-top, top)
    axes.set_title("green starts settle; cross: this start")
    axes.set_xlabel("distance y at the start [m]")
    axes.set_ylabel("integral z at the start [m s]" if loop.integrates else "")
    if not loop.integrates:
        axes.set_yticks([])


ROOT = "/laboratory"
STOP = "Stop"
KP, KI, KD, DELAY = "K_P [1/s]", "K_I [1/s^2]", "K_D [1]", "delay [samples]"
# Name, least, largest and step of each slider.
_SLIDERS = ((KP, 0.5, 60.0, 0.5), (KI, 0.1, 200.0, 0.1), (KD, 0.0, 3.0, 0.05), (DELAY, 0, 40, 1))
_PIXELS = 1400
# How often the sliders are read [s].
_PAUSE = 0.05


class StandoffPage:
    """The page: sliders, and a picture that follows them.

    Attributes:
        meshcat: Where it is.
        scenario: What is shown now.
    """

    def __init__(self, meshcat: Meshcat, scenario: StandoffScenario) -> None:
        """Put sliders and picture on a page.

        Args:
            meshcat: The page.
            scenario: What to begin with; values beyond a slider's ends are moved to them.
        """
        end_on_this_thread(meshcat)
        self.meshcat = meshcat
        loop = scenario.loop
        values = {KP: loop.kp, KI: loop.ki, KD: loop.kd, DELAY: scenario.delay_samples}
        for name, least, largest, step in _SLIDERS:
            value = min(max(values[name], least), largest)
            meshcat.AddSlider(name, least, largest, step, value)
        meshcat.AddButton(STOP)
        # Of this camera a page of any shape shows all; the open controls lie to its right.
        meshcat.SetCamera(
            Meshcat.OrthographicCamera(
                left=-1.02, right=1.5, bottom=-0.71, top=0.71, near=0.01, far=20.0
            )
        )
        eye, centre = np.array([0.0, -1e-3, 5.0]), np.zeros(3)
        # Drake's stubs put the dtype of an array where its shape belongs.
        meshcat.SetCameraPose(eye, centre)  # pyright: ignore[reportArgumentType]
        for part in ("/Grid", "/Axes"):
            meshcat.SetProperty(part, "visible", False)
        for end in ("top_color", "bottom_color"):
            meshcat.SetProperty("/Background", end, [0.88, 0.88, 0.88])
        self.scenario = self._asked(scenario)
        self._draw()

    def update(self) -> bool:
        """Draw again if a slider has moved; whether it has."""
        asked = self._asked(self.scenario)
        if asked == self.scenario:
            return False
        self.scenario = asked
        self._draw()
        return True

    def serve(self, seconds: float | None = None) -> None:
        """Follow the sliders until the button is pressed.

        Args:
            seconds: At most so long [s]; None: for ever.
        """
        end = None if seconds is None else time.monotonic() + seconds
        while self.meshcat.GetButtonClicks(STOP) == 0:
            if end is not None and time.monotonic() > end:
                break
            if not self.update():
                time.sleep(_PAUSE)

    def _asked(self, scenario: StandoffScenario) -> StandoffScenario:
        kp, ki, kd, delay = (self.meshcat.GetSliderValue(name) for name, *_ in _SLIDERS)
        loop = replace(scenario.loop, kp=kp, ki=ki, kd=kd)
        return replace(scenario, loop=loop, delay_samples=round(delay))

    def _draw(self) -> None:
        square = picture_square(laboratory_image(self.scenario), 2.0, pixels=_PIXELS)
        self.meshcat.SetObject(f"{ROOT}/picture", square, Rgba(1, 1, 1, 1))
