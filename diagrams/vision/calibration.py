"""Calibration of omni-directional cameras: optics from files, reports, plots, and shells found.

Plots show how well ranges are read, as the thesis's Figures 2.10 to 2.12, for both models.
"""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ...systems.numerics.errors import require
from ...systems.numerics.vision.boards.fit import BoardFit, rms_of
from ...systems.numerics.vision.estimation.calibration import Calibration
from ...systems.numerics.vision.estimation.range_models import MODELS, exact_pixel_radius, implied_k
from ...systems.numerics.vision.estimation.shell_detection import ShellDetection
from ...systems.numerics.vision.estimation.shell_estimate import ShellEstimate, locate
from ...systems.numerics.vision.omni_optics import OmniCamera
from ..scenario_files import load_scenario


def load_camera(path: Path | None) -> OmniCamera:
    """The optics in a file, whose keys are the fields of `OmniCamera`, or the default ones.

    Raises:
        InvalidInput: No file there, no YAML mapping, an unknown key, or a value out of its range.
    """
    if path is None:
        return OmniCamera()
    require(path.is_file(), "camera", "be a YAML file", path)
    return load_scenario(OmniCamera, path)


def summarise_calibration(
    calibration: Calibration, skipped: list[str], truth: OmniCamera | None
) -> dict[str, object]:
    """The entries of a calibration's summary, in SI units and pixels.

    Args:
        calibration: What was found.
        skipped: Pictures in which no shell was found, and why.
        truth: The optics that took the pictures, if they were simulated.

    Returns:
        pictures (used), skipped; k, k_spread [px/rad], height [m], parabola (a [1/m], b, c [m]);
        optics (fitted height and focal length, axis); implied (k, k_spread, height by the true
        optics, or null); bearing_rms [rad]; models, each with mean_absolute_error (of Figure 2.11)
        and mean_rms [m], and curves over the distance: distance, mean_error, spread, rms [m] and
        pixel_radius [px]; error_ratio (thesis's mean_absolute_error over the exact model's).
    """
    camera, curves = calibration.camera, calibration.curves
    implied = None
    if truth is not None:
        k = implied_k(truth, calibration.base, calibration.readings.distances)
        implied = {
            "k": float(k.mean()),
            "k_spread": float(k.std(ddof=1)),
            "height": truth.focus_height - calibration.base,
        }
    errors = {model: curves[model].mean_absolute_error for model in MODELS}
    return {
        "pictures": len(calibration.readings.distance),
        "skipped": skipped,
        "k": calibration.k,
        "k_spread": calibration.k_spread,
        "height": calibration.height,
        "parabola": dict(zip("abc", calibration.parabola, strict=True)),
        "optics": {
            "pinhole_height": camera.pinhole_height,
            "focal_length": camera.focal_length,
            "axis": camera.axis_pixel.tolist(),
        },
        "implied": implied,
        "bearing_rms": calibration.bearing_rms,
        "models": {
            model: {
                "mean_absolute_error": errors[model],
                "mean_rms": float(np.mean(curves[model].rms)),
                "distance": curves[model].distance.tolist(),
                "pixel_radius": curves[model].pixel_radius.tolist(),
                "mean_error": curves[model].mean_error.tolist(),
                "spread": curves[model].spread.tolist(),
                "rms": curves[model].rms.tolist(),
            }
            for model in MODELS
        },
        # Readings without any noise leave nothing to divide by.
        "error_ratio": errors["thesis"] / errors["exact"] if errors["exact"] > 0 else None,
    }


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


# Rings of equal range in pictures [m].
_RINGS = (0.25, 0.5, 1.0, 2.0)

Found = Sequence[tuple[str, ShellDetection, ShellEstimate]]


def summarise_found(
    found: Found, calibration: Calibration, pose: Sequence[float], model: str
) -> dict[str, object]:
    """The entries of an estimate's summary.

    Args:
        found: What the estimator says of each colour.
        calibration: It was made with.
        pose: Of the camera: x, y [m], heading [rad].
        model: Of ranges, one of MODELS.

    Returns:
        model, pose, and shells: for each colour its outcome, valid, and, null where there is no
        estimate, range [m] and bearing [rad] of the near side, range_std, bearing_std, position
        of the axis [m], covariance of it [m^2], and pixel_radius [px].
    """
    shells = []
    for name, detection, estimate in found:
        valid = estimate.outcome.has_estimate
        position, covariance = locate(estimate, np.asarray(pose), calibration.shell_radius)
        deviations = np.sqrt(np.diag(estimate.covariance)).tolist()
        shells.append(
            {
                "colour": name,
                "outcome": estimate.outcome.words,
                "valid": valid,
                "range": estimate.range if valid else None,
                "bearing": estimate.bearing if valid else None,
                "range_std": deviations[0] if valid else None,
                "bearing_std": deviations[1] if valid else None,
                "position": position.tolist() if valid else None,
                "covariance": covariance.tolist() if valid else None,
                "pixel_radius": detection.pixel_radius if valid else None,
            }
        )
    return {"model": model, "pose": list(pose), "shells": shells}


def save_found_picture(
    path: Path, picture: np.ndarray, found: Found, calibration: Calibration
) -> None:
    """Draw the shells that were found into the picture, over rings of equal range.

    Args:
        path: A PNG file.
        picture: Shape (height, width, 3), uint8.
        found: Name, detection and estimate of each colour.
        calibration: Of the camera.
    """
    height, width = picture.shape[:2]
    figure = Figure(figsize=(width / 80, height / 80), layout="constrained")
    axes = figure.add_subplot()
    axes.imshow(picture)
    camera, turn = calibration.camera, np.linspace(0, 2 * np.pi, 181)
    column, row = camera.axis_pixel
    for ring in _RINGS:
        (p,) = exact_pixel_radius([ring], camera=camera, base=calibration.base)
        axes.plot(column + p * np.sin(turn), row - p * np.cos(turn), color="white", linewidth=0.5)
        axes.annotate(f"{ring:g} m", (column, row + p), color="white", fontsize=6, ha="center")
    missing = []
    for name, detection, estimate in found:
        if not estimate.outcome.has_estimate:
            missing.append(f"{name}: {estimate.outcome.words}")
            continue
        x, y = detection.pixel
        axes.plot([column, x], [row, y], color="white", linewidth=0.8, linestyle="--")
        axes.plot(x, y, "+", color="black", markersize=11, markeredgewidth=2.5)
        axes.plot(x, y, "+", color="white", markersize=10, markeredgewidth=1)
        deviations = np.sqrt(np.diag(estimate.covariance))
        axes.annotate(
            f"{name}: {estimate.range:.3f} ± {deviations[0]:.3f} m\n"
            f"{np.degrees(estimate.bearing):.1f} ± {np.degrees(deviations[1]):.1f}°",
            (x, y),
            # Towards the axis, where there is the floor.
            xytext=(0.45 * x + 0.55 * column, 0.45 * y + 0.55 * row),
            ha="center",
            va="center",
            fontsize=8,
            bbox={"facecolor": "white", "alpha": 0.85, "edgecolor": "none", "pad": 2},
        )
    axes.set_title("; ".join(missing), fontsize="small")
    axes.set_axis_off()
    figure.savefig(path, dpi=110)


# Of aspects: beyond so many standard deviations, and so much, the ruler is to be looked at.
_DEVIATIONS, _LEAST = 4.0, 0.005


def summarise_board(
    fit: BoardFit,
    model: str,
    used: Sequence[str],
    skipped: Sequence[str],
    held: np.ndarray | None,
    free: BoardFit,
    ends: np.ndarray,
) -> dict[str, object]:
    """The entries of a calibration's summary.

    Args:
        fit: What was found.
        model: Its name.
        used, skipped: Names of pictures with a board, and of those without one and of copies.
        held: Residuals of pictures left out, shape (pictures, corners, 2) [px], None if they were
            too few.
        free: The fit with the proportions of the squares free.
        ends: Of the parameters' intervals of 95%, shape (p, 2).

    Returns:
        model, pictures, skipped, converged, rms [px], left_out_rms [px] or null, rms_by_picture
        [px], parameters (value, deviation, interval of 95%, null where it has no end, each in the
        unit of its name), aspect (value, deviation), and in words what is known of the ruler.
    """
    parameters = {
        name: {"value": value, "deviation": spread, "interval": _known(end)}
        for name, value, spread, end in zip(
            fit.camera.names,
            fit.camera.vector.tolist(),
            fit.deviations.tolist(),
            ends.tolist(),
            strict=True,
        )
    }
    return {
        "model": model,
        "pictures": list(used),
        "skipped": list(skipped),
        "converged": fit.converged,
        "rms": fit.rms,
        "left_out_rms": None if held is None else rms_of(held),
        "rms_by_picture": [rms_of(each) for each in fit.residuals],
        "parameters": parameters,
        "aspect": {"value": free.aspect, "deviation": free.aspect_deviation},
        "ruler": _ruler(free),
    }


def _known(ends: list[float]) -> list[float | None]:
    """Ends without those that are infinite, which JSON has no number for."""
    return [end if math.isfinite(end) else None for end in ends]


def save_residuals(path: Path, fit: BoardFit, pictures: Sequence[np.ndarray]) -> None:
    """Draw where the corners were and by how much the model misses them, 50 times as long.

    Args:
        path: Of the PNG file.
        fit: What was found.
        pictures: Pixels of the corners in each picture, shapes (n, 2).
    """
    figure = Figure(figsize=(10.5, 4.8), layout="constrained")
    over, cloud = figure.subplots(1, 2, width_ratios=[1.6, 1])
    pixels = np.concatenate(pictures)
    away = fit.residuals.reshape(-1, 2)
    over.quiver(*pixels.T, *(50 * away).T, angles="xy", scale_units="xy", scale=1, width=0.0015)
    over.set_xlim(0, fit.camera.width)
    over.set_ylim(fit.camera.height, 0)
    over.set_aspect("equal")
    over.set_title("residuals, 50 times as long", fontsize="medium")
    cloud.plot(*away.T, ".", markersize=2)
    cloud.set_aspect("equal")
    cloud.set_title(f"{fit.rms:.3f} px rms", fontsize="medium")
    cloud.set_xlabel("to the right [px]")
    cloud.set_ylabel("down [px]")
    cloud.grid(alpha=0.3)
    figure.savefig(path, dpi=_DPI)


def _ruler(free: BoardFit) -> str:
    """What a board tells of the ruler that measured it: proportions, never the size."""
    off = free.aspect - 1
    if abs(off) > max(_DEVIATIONS * free.aspect_deviation, _LEAST):
        return (
            f"The squares look {100 * abs(off):.2f}% {'higher' if off > 0 else 'lower'} than said "
            f"(+- {100 * free.aspect_deviation:.2f}%): measure them again in both directions, or "
            "try another model. Their size cannot be told from pictures."
        )
    return (
        f"The squares have the proportions that were said, to {100 * free.aspect_deviation:.2f}%. "
        "Their size cannot be told from pictures, and the camera does not depend on it."
    )
