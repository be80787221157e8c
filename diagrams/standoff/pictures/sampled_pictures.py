"""Nyquist's diagram, the sensitivity, and what the sampled stand-off loop attracts."""

import math
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from ....systems.numerics.standoff.sampled.margins import (
    LoopMargins,
    SampledLoop,
    frequency_grid,
    sampled_loop,
)
from ....systems.numerics.standoff.sampled.region import attracted_by_sampled
from ....systems.numerics.standoff.separatrix import separatrix
from ..analysis import StandoffAnalysis
from .colours import BORDER, PURSUER, REGION, SINGULAR

# Points along the side of a plane.
_CELLS = 80


def draw_nyquist(found: StandoffAnalysis) -> Figure:
    """L(exp(jwh)) beside -1, and the sensitivity |1 / (1 + L)| over frequency.

    Args:
        found: Of the loop.
    """
    linear, margins = (
        sampled_loop(found.loop, found.sampled, found.delay_samples),
        found.sampled_margins,
    )
    grid = frequency_grid(linear)
    figure = Figure(figsize=(12, 5.6), layout="constrained")
    plane, over = figure.subplots(1, 2)
    draw_nyquist_plane(plane, linear, margins, grid)
    sensitivity = 1 / np.abs(1 + linear.response(grid))
    over.loglog(grid, sensitivity, color=PURSUER)
    over.axhline(1, color="black", lw=0.8)
    over.plot(margins.peak_frequency, margins.peak_sensitivity, "o", color=SINGULAR)
    over.set_xlim(max(grid[0], 1e-4 * grid[-1]), grid[-1])
    over.set_ylim(max(sensitivity.min(), 1e-3), 1.5 * margins.peak_sensitivity)
    over.set_xlabel("frequency [rad/s]")
    over.set_ylabel("sensitivity |1 / (1 + L)| [1]")
    over.set_title(f"Ms = {margins.peak_sensitivity:.3f}: the most that a disturbance grows")
    over.grid(alpha=0.3)
    late = found.delay_samples * found.sampled.period
    kind = "" if margins.stable else " UNSTABLE"
    figure.suptitle(
        f"{found.loop.controller}, sampled by {1000 * found.sampled.period:g} ms, "
        f"{1000 * late:g} ms late:{kind} open loop at y = {found.wanted.y:.4f} m"
    )
    return figure


def draw_nyquist_plane(
    axes: Axes, linear: SampledLoop, margins: LoopMargins, grid: np.ndarray
) -> None:
    """L in the complex plane round -1, with its margins.

    Args:
        axes: Where.
        linear: The loop.
        margins: Its margins.
        grid: Frequencies, shape (n,) [rad/s].
    """
    seen = linear.response(grid)
    axes.plot(seen.real, seen.imag, color=PURSUER, label="L(exp(jwh)), w > 0")
    axes.plot(seen.real, -seen.imag, color=PURSUER, lw=0.7, ls="--", label="w < 0")
    axes.plot(-1, 0, "+", color=SINGULAR, ms=12, mew=2)
    axes.add_patch(Circle((0, 0), 1, fill=False, ls=":", color="black", lw=0.8))
    near = 1 / margins.peak_sensitivity
    axes.add_patch(Circle((-1, 0), near, color=SINGULAR, alpha=0.15, label="1 / Ms round -1"))
    # Margins of an unstable loop say nothing.
    if margins.stable and math.isfinite(margins.gain_margin):
        place = -1 / margins.gain_margin
        words = f"gain margin {margins.gain_margin:.3g}"
        axes.plot(place, 0, "s", color=BORDER, label=words)
    if margins.stable and math.isfinite(margins.crossover):
        at = linear.response(np.array(margins.crossover))
        words = f"phase margin {math.degrees(margins.phase_margin):.1f}°"
        axes.plot(at.real, at.imag, "o", color=BORDER, label=words)
    axes.axhline(0, color="black", lw=0.5)
    axes.axvline(0, color="black", lw=0.5)
    axes.set_xlim(-2.6, 1.4)
    axes.set_ylim(-2, 2)
    axes.set_aspect("equal")
    axes.set_xlabel("real part")
    axes.set_ylabel("imaginary part")
    axes.legend(loc="upper right", framealpha=0.85, fontsize=9)


def draw_sampled_region(found: StandoffAnalysis) -> Figure:
    """Which states of PI and PID end at the wanted equilibrium with clock, filter, delay and limit.

    Args:
        found: Of a loop with an integral part.
    """
    figure = Figure(figsize=(9, 6), layout="constrained")
    axes = figure.subplots()
    loop, wanted = found.loop, found.wanted.y
    places = [each.y for each in found.equilibria]
    width = max(places) - min(places) if len(places) > 1 else 1.0
    low, high = min(places) - 2 * width, max(places) + 0.4 * width
    top = 2.5 * loop.kp * abs(loop.miss((low + wanted) / 2)) / loop.ki
    border = None
    if loop.error.a:
        border = separatrix(loop)
        shown = (border.points[:, 0] > low) & (border.points[:, 0] < high)
        top = 1.15 * float(np.abs(border.points[shown, 1]).max())
    # The law's integral is of the estimated miss, -f.
    y, total = np.meshgrid(np.linspace(low, high, _CELLS), np.linspace(-top, top, _CELLS))
    held = attracted_by_sampled(loop, found.sampled, y, -total, delay_samples=found.delay_samples)
    axes.contourf(y, total, held.astype(float), levels=[0.5, 1.5], colors=[REGION])
    if border is not None:
        axes.plot(*border.points.T, color=BORDER, lw=1.5, label="border of the ideal loop")
        axes.legend(loc="upper left")
    for each in found.equilibria:
        full = each.stable and each.realisable and found.sampled_margins.stable
        axes.plot(each.y, 0, "o", color="black", mfc="black" if full else "white", zorder=5)
    axes.axhline(0, color="black", lw=0.5)
    axes.set_xlim(low, high)
    axes.set_ylim(-top, top)
    axes.set_xlabel("distance y at the start [m]")
    axes.set_ylabel("integral of f at the start, z [m s]")
    clock = found.sampled
    words = f"sampled by {1000 * clock.period:g} ms"
    words += f", {1000 * clock.period * found.delay_samples:g} ms late"
    if not math.isinf(clock.limit):
        words += f", at most {clock.limit:g} m/s"
    axes.set_title(f"{loop.controller}, {words}: green starts settle")
    return figure


def save_sampled_pictures(folder: Path, found: StandoffAnalysis) -> list[str]:
    """Write nyquist.png and, with an integral part, sampled_region.png; returns their names."""
    names = ["nyquist.png"]
    draw_nyquist(found).savefig(folder / names[0], dpi=110)
    if found.loop.integrates:
        names.append("sampled_region.png")
        draw_sampled_region(found).savefig(folder / names[1], dpi=110)
    return names
