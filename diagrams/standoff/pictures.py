"""Pictures of the stand-off loop, ideal and sampled, in one set of colours.

Responses (Figure 2.20 of the thesis, and why its curves do not end at the reference), Bode's
diagram and the root locus, the phase portrait with border and certificates, and for the loop that a
computer closes Nyquist's diagram, the sensitivity, and what it attracts.
"""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Patch
from matplotlib.ticker import MultipleLocator
from numpy.typing import NDArray

from ...systems.numerics.standoff.attraction import attracted_states, edge, energy, separatrix
from ...systems.numerics.standoff.loop import (
    CONTROLLERS,
    StandoffLoop,
    equilibria,
    wanted_equilibrium,
)
from ...systems.numerics.standoff.response import respond, still_integral
from ...systems.numerics.standoff.sampled_loop import (
    LoopMargins,
    SampledLoop,
    frequency_grid,
    sampled_loop,
)
from ...systems.numerics.standoff.sampled_region import attracted_by_sampled
from .analysis import StandoffAnalysis, frequency_response, root_locus

CONTROLLER_COLOURS = {"P": "#215fcc", "PI": "#d9722e", "PD": "#178a5a", "PID": "#8b3fa8"}
REGION, CERTIFIED = "#dcecdc", "#178a5a"
SINGULAR = "#c62828"
BORDER = "#333333"
REFERENCE = "#888888"
CALIBRATED = "#fff3cf"
EVADER, PURSUER = "#d92e33", "#215fcc"


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


Complex = NDArray[np.complex128]


def draw_bode(found: StandoffAnalysis) -> Figure:
    """Magnitude and phase of the open loop, ideal and with the derivative filtered."""
    loop, tau = found.loop, found.sampled.filter_time
    corner = abs(found.wanted.poles[-1])
    frequencies = np.geomspace(min(corner, 1.0) / 100, max(corner, 1 / tau) * 100, 500)
    figure = Figure(figsize=(9, 7), layout="constrained")
    magnitude, phase = figure.subplots(2, 1, sharex=True)
    for filter_time, name, colour in _variants(loop, tau):
        seen = frequency_response(loop, frequencies, filter_time)
        degrees = np.degrees(np.unwrap(np.angle(seen.response)))
        # The branch that starts between -180 and 0 degrees, and not at -180 + 360.
        degrees -= 360 * round((degrees[0] + 90) / 360)
        phase.semilogx(frequencies, degrees, color=colour)
        margin = found.filtered_margin if filter_time else found.margin
        if np.isfinite(seen.crossover):
            for axes in (magnitude, phase):
                axes.axvline(seen.crossover, color=colour, linestyle=":", linewidth=1)
            words = f"{name}: phase margin {np.degrees(seen.phase_margin):.1f}°, "
            words += f"bears {1000 * margin.delay:.1f} ms of delay"
        else:
            words = f"{name}: gain above 1 at all frequencies, bears no delay"
        magnitude.loglog(frequencies, np.abs(seen.response), color=colour, label=words)
    magnitude.axhline(1, color="black", linewidth=0.8)
    phase.axhline(-180, color="black", linewidth=0.8)
    phase.yaxis.set_major_locator(MultipleLocator(45))
    magnitude.set_ylabel("magnitude of L [1]")
    phase.set_ylabel("phase of L [degrees]")
    phase.set_xlabel("frequency [rad/s]")
    magnitude.legend(frameon=False)
    for axes in (magnitude, phase):
        axes.grid(alpha=0.3)
    figure.suptitle(f"{loop.controller}: open loop at y = {found.wanted.y:.4f} m")
    return figure


def draw_root_locus(found: StandoffAnalysis) -> Figure:
    """Poles as all gains grow together, ideal and with the derivative filtered."""
    loop = found.loop
    factors = np.concatenate([[0.0], np.geomspace(1e-3, 1e2, 1500)])
    variants = _variants(loop, found.sampled.filter_time)
    figure = Figure(figsize=(6.5 * len(variants), 5.5), layout="constrained")
    for axes, (filter_time, name, _) in zip(
        figure.subplots(1, len(variants), squeeze=False)[0], variants, strict=True
    ):
        locus = root_locus(loop, factors, filter_time)
        present = root_locus(loop, np.array([1.0]), filter_time).poles[0]
        axes.plot(locus.poles.real, locus.poles.imag, ".", markersize=2.5, color="#7aa0e0")
        axes.plot(locus.poles[0].real, locus.poles[0].imag, "x", color="black", label="no gain")
        axes.plot(locus.zeros.real, locus.zeros.imag, "o", mfc="none", color="black", label="zeros")
        axes.plot(
            present.real, present.imag, "s", color=SINGULAR, markersize=6, label="gains as given"
        )
        left, right, height = _locus_view(locus.poles, present, locus.zeros)
        axes.set_xlim(left, right)
        axes.set_ylim(-height, height)
        axes.axvline(0, color="black", linewidth=0.8)
        axes.axhline(0, color="black", linewidth=0.3)
        axes.set_title(name)
        axes.set_xlabel("real part [1/s]")
        axes.set_ylabel("imaginary part [1/s]")
        axes.legend(loc="upper left", frameon=False)
    figure.suptitle(f"{loop.controller}: root locus at y = {found.wanted.y:.4f} m")
    return figure


def _locus_view(poles: Complex, present: Complex, zeros: Complex) -> tuple[float, float, float]:
    """Left and right end and height that show zeros and present poles, but for far ones.

    A filter's pole lies tens of times farther out than what decides how the loop moves, and would
    press all else into a corner.
    """
    near = np.sort(np.abs([*present, *zeros]))
    near = near[near > 0]
    # Up to the first gap of more than ten.
    gaps = np.flatnonzero(near[1:] > 10 * near[:-1])
    # Never without the slowest two poles.
    least = np.sort(np.abs(present))[min(1, len(present) - 1)]
    outmost = max(float(near[gaps[0]] if len(gaps) else near[-1]), float(least))
    left, right = -1.5 * outmost, 0.3 * outmost
    seen = poles[(poles.real > left) & (poles.real < right)]
    height = min(1.2 * float(np.abs(seen.imag).max()), 1.5 * outmost) if seen.size else 0.0
    return left, right, max(height, 0.3 * outmost)


def save_linear_pictures(folder: Path, found: StandoffAnalysis) -> list[str]:
    """Write bode.png and root_locus.png; returns their names."""
    draw_bode(found).savefig(folder / "bode.png", dpi=110)
    draw_root_locus(found).savefig(folder / "root_locus.png", dpi=110)
    return ["bode.png", "root_locus.png"]


def _variants(loop: StandoffLoop, tau: float) -> list[tuple[float, str, str]]:
    """Filter time [s], name and colour of the loops that are worth a curve."""
    variants = [(0.0, "ideal", "#215fcc")]
    if loop.derivative_gain:
        variants.append((tau, f"derivative filtered by {1000 * tau:g} ms", "#d9722e"))
    return variants


# Points along the side of a phase portrait.
_PORTRAIT_CELLS = 160


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
    y, integral = np.meshgrid(
        np.linspace(low, high, _PORTRAIT_CELLS), np.linspace(-top, top, _PORTRAIT_CELLS)
    )
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


# Points along the side of a plane.
_REGION_CELLS = 80


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
    y, total = np.meshgrid(
        np.linspace(low, high, _REGION_CELLS), np.linspace(-top, top, _REGION_CELLS)
    )
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
