"""Estimates of one picture: as a JSON object, and drawn into it."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from ....systems.numerics.vision.estimation.calibration import Calibration
from ....systems.numerics.vision.estimation.range_models import exact_pixel_radius
from ....systems.numerics.vision.estimation.shell_detection import ShellDetection
from ....systems.numerics.vision.estimation.shell_estimate import ShellEstimate, locate

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
