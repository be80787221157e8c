"""One picture of a stand-off loop for who turns its gains: response, poles, Nyquist, region."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from ....systems.numerics.errors import InvalidInput
from ....systems.numerics.standoff.equilibria import equilibria, span, wanted_equilibrium
from ....systems.numerics.standoff.sampled.margins import (
    LoopMargins,
    frequency_grid,
    loop_margins,
    sampled_loop,
)
from ....systems.numerics.standoff.sampled.region import attracted_by_sampled
from ....systems.numerics.standoff.sampled_pid import pid_step
from ..scenario import StandoffScenario
from .colours import PURSUER, REFERENCE, REGION, SINGULAR
from .sampled_pictures import draw_nyquist_plane

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
