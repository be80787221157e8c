"""A run of tracking on pictures in a few numbers."""

import numpy as np

from ...tracking.report import UNITS, log_arrays, summarise_tracking
from .run import PictureRun

# Units of the arrays in the log; "1" for numbers without one.
PICTURE_UNITS = {
    **UNITS,
    "evader_estimate": "m",
    "evader_known": "1",
    "valid": "1",
    "arrived": "1",
    "estimation_error": "m",
}


def summarise_picture_tracking(run: PictureRun, scenario: str) -> dict[str, object]:
    """The run in numbers, ready for JSON.

    Args:
        run: What happened.
        scenario: Its name.

    Returns:
        What `sightfield track` says of the game, and: senses ("pictures" or "truth"), weight (w of
        (2.7)), model (of ranges), estimation_error_rms, _median and _worst (distance of the
        pursuers' joint estimate from the truth while they have one, None if they never do) [m],
        estimated_share (of the samples, that of evaders of whom the latest picture of some pursuer
        gives an estimate), mean_distance (of a pursuer to its own evader, None if it never has
        one) [m], pictures_lost_share.
    """
    vision, log = run.game.scenario.vision, run.tracking.log
    errors = run.errors[np.isfinite(run.errors)]
    pursuer, target = log["pursuer_position"], log["assignment"]
    own = np.take_along_axis(log["evader_position"], np.maximum(target, 0)[:, :, None], axis=1)
    distances = np.linalg.norm(own - pursuer, axis=2)[target >= 0]
    return {
        **summarise_tracking(run.tracking, scenario),
        "senses": vision.senses,
        "weight": vision.weight,
        "model": vision.model,
        "estimation_error_rms": float(np.sqrt(np.mean(errors**2))) if errors.size else None,
        "estimation_error_median": float(np.median(errors)) if errors.size else None,
        "estimation_error_worst": float(errors.max()) if errors.size else None,
        "estimated_share": float(run.valid.any(axis=1).mean()),
        "mean_distance": float(distances.mean()) if distances.size else None,
        "pictures_lost_share": float(1 - run.arrived.mean()),
    }


def picture_log_arrays(run: PictureRun) -> dict[str, np.ndarray]:
    """The run's samples by the names in PICTURE_UNITS, time along every array's first axis."""
    return {
        **log_arrays(run.tracking),
        "evader_estimate": run.estimate,
        "evader_known": run.known,
        "valid": run.valid,
        "arrived": run.arrived,
        "estimation_error": run.errors,
    }
