"""Where a stand-off loop goes from everywhere: phase portrait, border, certificates."""

import math
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from ....systems.numerics.standoff.attracted import attracted_states
from ....systems.numerics.standoff.energy import edge, energy
from ....systems.numerics.standoff.separatrix import separatrix
from ..analysis import StandoffAnalysis
from .colours import BORDER, CALIBRATED, CERTIFIED, REGION, SINGULAR

# Points along the side of a phase portrait.
_CELLS = 160


def draw_phase_portrait(found: StandoffAnalysis) -> Figure:
    """The plane of distance and integral for PI and PID, the rate over the distance without."""
    figure = Figure(figsize=(10, 7), layout="constrained")
    axes = figure.subplots()
    if found.loop.integrates:
        _draw_plane(axes, found)
    else:
        _draw_line(axes, found)
    for each in found.equilibria:
        # A stable pole pair that no filtered loop keeps is drawn hollow too.
        full = each.stable and each.realisable
        axes.plot(each.y, 0, "o", color="black", mfc="black" if full else "white", zorder=5)
    for k, y in enumerate(found.singularities):
        label = "singularity" if k == 0 else None
        axes.axvline(y, color=SINGULAR, linestyle="--", label=label)
    axes.set_xlabel("distance y [m]")
    handles, labels = axes.get_legend_handles_labels()
    handles.append(Patch(color=REGION))
    axes.legend([*handles], [*labels, "region of attraction"], loc="upper left")
    axes.set_title(
        f"{found.loop.controller}: full dots attract real loops, hollow ones do not; "
        f"region {_interval(found.region.low, found.region.high)} m"
    )
    return figure


def save_phase_picture(path: Path, found: StandoffAnalysis) -> None:
    """Write what `draw_phase_portrait` draws as a PNG picture."""
    draw_phase_portrait(found).savefig(path, dpi=110)


def _draw_line(axes: Axes, found: StandoffAnalysis) -> None:
    loop = found.loop
    low, high = _view(found)
    y = np.linspace(low, high, 2001)
    with np.errstate(divide="ignore"):
        rate = loop.rate(y)
    # No line through the pole.
    rate[np.abs(loop.inertia(y)) < 2e-3] = np.nan
    bound = 1.5 * float(np.abs(loop.rate(np.linspace(low, found.wanted.y, 50))).max())
    if math.isfinite(edge(loop)):
        bound = min(bound, 12 * loop.kp * abs(loop.miss((found.wanted.y + edge(loop)) / 2)))
    axes.axvspan(max(found.region.low, low), min(found.region.high, high), color=REGION)
    axes.plot(y, rate, color="#215fcc", label="y'")
    axes.axhline(0, color="black", linewidth=0.8)
    _draw_intervals(axes, found, 0.04 * bound)
    axes.set_xlim(low, high)
    axes.set_ylim(-bound, bound)
    axes.set_ylabel("rate y' [m/s]")


def _draw_plane(axes: Axes, found: StandoffAnalysis) -> None:
    loop = found.loop
    low, high = _view(found)
    border = separatrix(loop) if math.isfinite(edge(loop)) else None
    if border is None:
        # Where the proportional part alone makes up for the integral.
        top = 1.15 * loop.kp / loop.ki * abs(float(loop.miss(low)))
    else:
        shown = (border.points[:, 0] > low) & (border.points[:, 0] < high)
        top = 1.15 * float(np.abs(border.points[shown, 1]).max())
    y, integral = np.meshgrid(np.linspace(low, high, _CELLS), np.linspace(-top, top, _CELLS))
    attracted = attracted_states(loop, y, integral)
    axes.contourf(y, integral, attracted.astype(float), levels=[0.5, 1.5], colors=[REGION])
    inertia = loop.inertia(y)
    axes.streamplot(
        y,
        integral,
        (loop.kp * loop.miss(y) + loop.ki * integral) * np.sign(inertia),
        loop.miss(y) * np.abs(inertia),
        density=1.3,
        linewidth=0.6,
        arrowsize=0.8,
        color="#8fa3bd",
    )
    if border is not None:
        axes.plot(*border.points.T, color=BORDER, linewidth=1.8, label="border (separatrix)")
        level = float(energy(loop, edge(loop), 0.0))
        inside = np.where((edge(loop) - y) * loop.error.a > 0, energy(loop, y, integral), np.nan)
        axes.contour(y, integral, inside, levels=[level], colors=[CERTIFIED], linestyles="--")
        axes.plot([], [], "--", color=CERTIFIED, label="certified by the energy")
    if found.certificate is not None:
        values = found.certificate.value(np.stack([y, integral], axis=-1))
        axes.contour(y, integral, values, levels=[1.0], colors=["#b8860b"])
        axes.plot([], [], color="#b8860b", label="certified by sums of squares")
    axes.axhline(0, color="black", linewidth=0.5)
    axes.set_xlim(low, high)
    axes.set_ylim(-top, top)
    axes.set_ylabel("integral of f, z [m s]")


def _draw_intervals(axes: Axes, found: StandoffAnalysis, height: float) -> None:
    """Certified intervals as bars below and above the axis."""
    low, high = np.clip(found.energy_interval, *_view(found)).tolist()
    axes.plot([low, high], [-height] * 2, "--", color=CERTIFIED, label="certified by the energy")
    if found.certificate is not None:
        sure = [found.certificate.low, found.certificate.high]
        axes.plot(sure, [height] * 2, color="#b8860b", label="certified by sums of squares")
    model = found.loop.error
    axes.axvspan(
        model.shortest, model.longest, 0, 0.02, color=CALIBRATED, ec="#c9b26b",
        label="calibrated range",
    )  # fmt: skip


def _view(found: StandoffAnalysis) -> tuple[float, float]:
    """Distances worth seeing: equilibria, singularities, what is certified, and some way beyond."""
    sure = found.energy_interval
    if found.certificate is not None:
        sure = (found.certificate.low, found.certificate.high)
    places = [*(each.y for each in found.equilibria), *found.singularities, *sure]
    places = [place for place in places if math.isfinite(place)]
    span = max(places) - min(places) or 1.0
    extra = [end for end in (found.region.low, found.region.high) if math.isfinite(end)]
    near = [end for end in extra if min(places) - 1.5 * span < end < max(places) + 1.5 * span]
    low, high = min([*places, *near]), max([*places, *near])
    return low - 0.2 * span, high + 0.2 * span


def _interval(low: float, high: float) -> str:
    """An open interval in words."""
    ends = [f"{end:.4f}" if math.isfinite(end) else "∞" for end in (low, high)]
    return f"({'-' if low == -math.inf else ''}{ends[0]}, {ends[1]})"
