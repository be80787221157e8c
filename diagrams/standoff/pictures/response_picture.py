"""Figure 2.20 of the thesis, and why its curves do not end at the reference."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ....systems.numerics.standoff.equilibria import equilibria, wanted_equilibrium
from ....systems.numerics.standoff.loop import CONTROLLERS, StandoffLoop
from ....systems.numerics.standoff.response import respond, still_integral
from .colours import CALIBRATED, CONTROLLER_COLOURS, REFERENCE


def draw_responses(loop: StandoffLoop, start: float, duration: float = 8.0) -> Figure:
    """All four controllers from one start, and the estimate over the true distance.

    PI and PID are drawn twice: from y' = 0, as in the thesis, and with an empty integral, as a
    controller starts that has just been switched on.

    Args:
        loop: Gains, reference and error; its controller is not looked at.
        start: Distance at the start [m].
        duration: Of the responses [s].

    Raises:
        InvalidInput: The start is not finite or on a singularity, or there is no equilibrium.
    """
    figure = Figure(figsize=(13, 5.5), layout="constrained")
    responses, bias = figure.subplots(1, 2, width_ratios=[1.25, 1])
    _draw_motions(responses, loop, start, duration)
    _draw_bias(bias, loop, start)
    gains = f"$K_P$ = {loop.kp:g} 1/s, $K_I$ = {loop.ki:g} 1/s², $K_D$ = {loop.kd:g}"
    figure.suptitle(f"Stand-off responses (Figure 2.20): {gains}, r = {loop.reference:g} m")
    return figure


def save_response_picture(
    path: Path, loop: StandoffLoop, start: float, duration: float = 8.0
) -> None:
    """Write what `draw_responses` draws as a PNG picture.

    Args:
        path: Of the file.
        loop: Gains, reference and error.
        start: Distance at the start [m].
        duration: [s].
    """
    draw_responses(loop, start, duration).savefig(path, dpi=110)


def _draw_motions(axes: Axes, loop: StandoffLoop, start: float, duration: float) -> None:
    shown = [start, loop.reference]
    for controller in CONTROLLERS:
        # Gains that suit the chosen controller need not suit the others.
        if "I" in controller and loop.ki == 0:
            continue
        each = replace(loop, controller=controller)
        if abs(each.inertia(start)) < 1e-6:
            continue
        colour = CONTROLLER_COLOURS[controller]
        starts = [(still_integral(each, start), "-", "")]
        if each.integrates:
            starts.append((0.0, ":", ", integral empty"))
        for integral, style, remark in starts:
            motion = respond(each, start, duration=duration, integral=integral)
            times, y = motion.times, motion.y
            if motion.outcome == "settled":
                times, y = np.append(times, duration), np.append(y, motion.end)
            axes.plot(times, y, style, color=colour, label=f"{controller}{remark}")
            shown.append(float(np.clip(y, -10, 10).max()))
    rest = wanted_equilibrium(loop).y
    axes.axhline(rest, color="black", linewidth=0.8, label=f"estimate = r: y = {rest:.4f} m")
    axes.axhline(
        loop.reference,
        color=REFERENCE,
        linestyle="--",
        linewidth=1,
        label=f"r = {loop.reference:g} m",
    )
    low, high = min(shown), max(*shown, rest)
    axes.set_ylim(low - 0.08 * (high - low), min(high, start + 3) + 0.12 * (high - low))
    axes.set_xlim(0, duration)
    axes.set_xlabel("time [s]")
    axes.set_ylabel("true distance y [m]")
    axes.set_title("Responses; solid: from y' = 0 where the loop is of second order")
    axes.legend(loc="best", framealpha=0.85)


def _draw_bias(axes: Axes, loop: StandoffLoop, start: float) -> None:
    rests = [each.y for each in equilibria(loop)]
    low, high = min(0.0, start, rests[0] - 0.1), max(rests[-1], loop.error.longest) + 0.15
    y = np.linspace(low, high, 400)
    axes.axvspan(
        loop.error.shortest, loop.error.longest, color=CALIBRATED, label="calibrated range"
    )
    axes.plot(y, y, color=REFERENCE, linewidth=0.8, label="truth")
    axes.plot(y, y - loop.error.error(y), color="#215fcc", label="estimate y - e(y)")
    axes.axhline(loop.reference, color=REFERENCE, linestyle="--", linewidth=1)
    for k, rest in enumerate(rests):
        bias = rest - loop.reference
        axes.plot(rest, loop.reference, "o", color="black")
        axes.annotate(
            f"y = {rest:.3f} m\nbias e(y) = {bias:+.3f} m", (rest, loop.reference),
            ((14, -34), (-14, 26))[k], textcoords="offset points", ha=("left", "right")[k],
            arrowprops={"arrowstyle": "-", "linewidth": 0.6},
        )  # fmt: skip
    axes.set_xlim(low, high)
    top = max(float((y - loop.error.error(y)).max()), loop.reference)
    bottom = min(float((y - loop.error.error(y)).min()), loop.reference)
    axes.set_ylim(bottom - 0.1 * (top - bottom), top + 0.35 * (top - bottom))
    axes.set_xlabel("true distance y [m]")
    axes.set_ylabel("estimated distance [m]")
    axes.set_title("The loop rests where the estimate equals r, not where y does")
    axes.legend(loc="upper left", frameon=False)
