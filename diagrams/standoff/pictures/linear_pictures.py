"""Bode's diagram and the root locus of a stand-off loop."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator
from numpy.typing import NDArray

from ....systems.numerics.standoff.loop import StandoffLoop
from ..analysis import StandoffAnalysis
from ..linear import frequency_response, root_locus
from .colours import SINGULAR

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
