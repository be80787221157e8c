"""How well ranges are read: the thesis's Figures 2.10 to 2.12, for both models."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ....systems.numerics.vision.estimation.calibration import Calibration
from ....systems.numerics.vision.estimation.range_models import MODELS

COLOURS = {"thesis": "#d92e33", "exact": "#215fcc"}
NAMES = {"thesis": "d = h tan(p / k)", "exact": "exact mirror ball"}
_DPI = 120
_DEGREES = 180 / np.pi


def save_error_curves(path: Path, calibration: Calibration) -> None:
    """Draw size and sign of the mean error over the distance, both models (Figure 2.11, (2.8))."""
    figure = Figure(figsize=(10.5, 4.4), layout="constrained")
    sizes, signed = figure.subplots(1, 2)
    for model in MODELS:
        curve = calibration.curves[model]
        style = {"color": COLOURS[model], "marker": "o", "markersize": 4}
        label = f"{NAMES[model]}, mean {1000 * curve.mean_absolute_error:.1f} mm"
        sizes.semilogy(
            curve.distance, 1000 * np.maximum(np.abs(curve.mean_error), 1e-5), label=label, **style
        )
        signed.errorbar(
            curve.distance,
            1000 * curve.mean_error,
            1000 * curve.spread,
            capsize=3,
            label=NAMES[model],
            **style,
        )
    a, b, c = calibration.parabola
    y = np.linspace(calibration.readings.distances[0], calibration.readings.distances[-1], 200)
    signed.plot(
        y, 1000 * (a * y**2 + b * y + c), "k--", linewidth=1, label="parabola of (2.8)", zorder=4
    )
    sizes.set_title("Figure 2.11: size of the mean error", fontsize="medium")
    signed.set_title(
        f"true less estimated: a = {a:.3f} 1/m, b = {b:.3f}, c = {c:.4f} m", fontsize="medium"
    )
    for axes in (sizes, signed):
        axes.set_xlabel("true distance [m]")
        axes.set_ylabel("error [mm]")
        axes.grid(alpha=0.3)
        axes.legend(frameon=False)
    figure.savefig(path, dpi=_DPI)


def save_direction_spread(path: Path, calibration: Calibration) -> None:
    """Draw estimates over the direction, and their spread (Figures 2.10 and 2.12)."""
    figure = Figure(figsize=(10.5, 5.2), layout="constrained")
    over, spread = figure.subplots(1, 2, width_ratios=[1.4, 1])
    readings = calibration.readings
    bearing = np.remainder(readings.bearing * _DEGREES, 360)
    for model in MODELS:
        estimate = calibration.range_of(model, calibration.pixel_radius)
        for distance in readings.distances:
            rows = np.flatnonzero(readings.distance == distance)
            rows = rows[np.argsort(bearing[rows])]
            over.plot(
                bearing[rows], estimate[rows], ".-", color=COLOURS[model], linewidth=1, markersize=4
            )
        curve = calibration.curves[model]
        spread.plot(
            curve.distance,
            1000 * curve.spread,
            "o-",
            color=COLOURS[model],
            markersize=4,
            label=NAMES[model],
        )
    for distance in readings.distances:
        over.axhline(distance, color="black", linewidth=0.6, linestyle=":")
    over.set_title("Figure 2.10: estimates over the direction", fontsize="medium")
    over.set_xlabel("bearing from the front, counter-clockwise [deg]")
    over.set_ylabel("estimated distance [m]")
    # Room for the key above the lines.
    over.set_ylim(0, 1.2 * float(readings.distances[-1]))
    lines = [Line2D([], [], color=COLOURS[model], label=NAMES[model]) for model in MODELS]
    lines.append(Line2D([], [], color="black", linestyle=":", label="true"))
    over.legend(handles=lines, frameon=False, ncols=3, loc="upper center")
    spread.set_title("Figure 2.12: standard deviation over the directions", fontsize="medium")
    spread.set_xlabel("true distance [m]")
    spread.set_ylabel("standard deviation [mm]")
    spread.set_ylim(bottom=0)
    spread.grid(alpha=0.3)
    spread.legend(frameon=False)
    figure.savefig(path, dpi=_DPI)
