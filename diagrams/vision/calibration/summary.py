"""What a calibration found, as one JSON object."""

import numpy as np

from ....systems.numerics.vision.estimation.calibration import Calibration
from ....systems.numerics.vision.estimation.range_models import MODELS, implied_k
from ....systems.numerics.vision.omni_optics import OmniCamera


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
