"""From a detection to a range, a bearing and a position, with an honest covariance.

The spread of an estimate is what the calibration found at its range, systematic error included,
so the thesis's model says of itself how wrong it is far away. To that is added what the outline of
the blob gives reason to doubt: a shell of known radius and height at a known range takes up a known
angle, and its top edge is at a known place.
"""

import math
from dataclasses import dataclass

import numpy as np

from ...errors import require_one_of
from .calibration import Calibration
from .outcomes import Outcome
from .range_models import MODELS, exact_range
from .shell_detection import ShellDetection

# Widths over the expected: below, partly or mostly hidden; above, not one whole shell.
_PARTLY, _MOSTLY, _TOO_WIDE = 0.85, 0.35, 1.25
# Noise of a width: a share of it, and pixels at its two sides.
_WIDTH_SHARE, _WIDTH_PIXELS = 0.01, 0.7
# Noise of the mean bearing against the sides'; and of the outer edge, beyond the half pixel by
# which the blob reaches over it.
_SKEW_PIXELS, _OUTER_PIXELS = 0.5, 0.1
# What the raster does to all lines of an edge alike, where it runs along a row or column [px].
_RASTER = 0.25
# Estimates go on to this share of the nearest calibrated distance and of the farthest.
_NEAREST, _FARTHEST = 0.5, 1.25
# Standard deviation per distance outside the calibrated range.
_EXTRAPOLATION = 0.5


@dataclass(frozen=True, kw_only=True)
class ShellEstimate:
    """Where a shell is, as seen from the camera; NaN and infinite covariance without an estimate.

    Attributes:
        outcome: Whether there is an estimate, and how doubtful; or why there is none.
        range: From the axis to the shell's near side, d of (2.4) [m].
        bearing: alpha of (2.5), counter-clockwise from the robot's front [rad].
        covariance: Of range and bearing, shape (2, 2) [m^2, m rad; m rad, rad^2].
    """

    outcome: Outcome
    range: float
    bearing: float
    covariance: np.ndarray


def no_estimate(outcome: Outcome) -> ShellEstimate:
    """Nothing known, and why."""
    return ShellEstimate(
        outcome=outcome,
        range=math.nan,
        bearing=math.nan,
        covariance=np.diag([math.inf, math.inf]),
    )


def estimate_shell(
    detection: ShellDetection, calibration: Calibration, model: str = "exact"
) -> ShellEstimate:
    """Range and bearing of a detected shell.

    Args:
        detection: Of `detect_shells`, with the axis of the calibration's camera.
        calibration: Of that camera.
        model: One of MODELS.

    Raises:
        InvalidInput: No such model.
    """
    require_one_of("model", model, MODELS)
    if not detection.outcome.has_estimate:
        return no_estimate(detection.outcome)
    p = detection.pixel_radius
    distance = float(calibration.range_of(model, p))
    # Whatever the model, the exact optics know best how wide a shell should look.
    true_range = float(calibration.range_of("exact", p))
    nearest, farthest = calibration.readings.distances[[0, -1]].tolist()
    if not (_NEAREST * nearest <= true_range <= _FARTHEST * farthest) or math.isinf(distance):
        return no_estimate(Outcome.OUT_OF_RANGE)

    radius = calibration.shell_radius
    expected = 2 * math.asin(radius / (true_range + radius))
    ratio = detection.width / expected
    if ratio > _TOO_WIDE:
        return no_estimate(Outcome.TOO_WIDE)
    if ratio < _MOSTLY:
        return no_estimate(Outcome.MOSTLY_HIDDEN)
    range_doubt, bearing_doubt = _doubts(detection, calibration, true_range, expected)
    outside = max(nearest - true_range, true_range - farthest, 0.0)
    # The model's slope turns the scatter of this very edge into metres.
    slope = float(calibration.range_of(model, p) - calibration.range_of(model, p - 0.1)) / 0.1
    curve = calibration.curves[model]
    usual = float(np.interp(p, curve.pixel_radius, curve.rms))
    here = slope * math.hypot(detection.pixel_radius_std, _RASTER)
    variance = max(usual, here) ** 2 + range_doubt**2 + (_EXTRAPOLATION * outside) ** 2
    bearing_variance = calibration.bearing_rms**2 + (_RASTER / p) ** 2 + bearing_doubt**2
    outcome = Outcome.SEEN
    if outside > 0:
        outcome = Outcome.OUTSIDE_CALIBRATION
    if ratio < _PARTLY:
        outcome = Outcome.PARTLY_HIDDEN
    return ShellEstimate(
        outcome=outcome,
        range=distance,
        bearing=detection.bearing,
        covariance=np.diag([variance, bearing_variance]),
    )


def _doubts(
    detection: ShellDetection, calibration: Calibration, distance: float, expected: float
) -> tuple[float, float]:
    """Deviations of range [m] and bearing [rad] that the blob's outline gives reason to fear.

    Args:
        detection: Of the blob.
        calibration: Of the camera.
        distance: By the exact optics, if the whole shell is seen [m].
        expected: Width of a shell there [rad].
    """
    p, radius, width = detection.pixel_radius, calibration.shell_radius, detection.width
    ratio, noise = width / expected, 2 * (_WIDTH_SHARE + _WIDTH_PIXELS / (p * expected))
    range_doubt, bearing_doubt = 0.0, max(detection.skew - _SKEW_PIXELS / p, 0.0)
    # A side may be hidden, or something may stand out beside it: the middle is not the shell's.
    bearing_doubt += 0.5 * abs(expected - width)
    if ratio > 1 + noise:
        # The base may be hidden: a nearer shell would look as wide.
        range_doubt = distance - (radius / math.sin(0.5 * width) - radius)
    elif ratio < 1 - noise:
        # What is taken for the nearest point of the base is beside it.
        range_doubt = radius * (1 - math.sqrt(1 - (1 - ratio) ** 2))
    # A nearer shell whose base is hidden shows its top edge further in.
    outer = detection.outer_radius + _OUTER_PIXELS
    by_top = float(exact_range(outer, camera=calibration.camera, base=calibration.shell_top))
    return range_doubt + max(distance - by_top, 0.0), bearing_doubt


def locate(
    estimate: ShellEstimate, pose: np.ndarray, shell_radius: float
) -> tuple[np.ndarray, np.ndarray]:
    """Position of a shell's axis in the world, by (2.5) and (2.6).

    The d of (2.4) ends at the shell's side, and (2.6) uses it as if it ended in the middle: the
    radius is added here.

    Args:
        estimate: Range and bearing.
        pose: Of the camera: x, y [m], heading [rad], shape (3,).
        shell_radius: [m].

    Returns:
        Position, shape (2,) [m], and its covariance, shape (2, 2) [m^2]; NaN and infinite on the
        diagonal without an estimate.
    """
    if not estimate.outcome.has_estimate:
        return np.full(2, math.nan), np.diag([math.inf, math.inf])
    heading = float(pose[2]) + estimate.bearing
    reach = estimate.range + shell_radius
    out = np.array([math.cos(heading), math.sin(heading)])
    aside = np.array([-out[1], out[0]])
    slopes = np.column_stack([out, reach * aside])
    return np.asarray(pose[:2]) + reach * out, slopes @ estimate.covariance @ slopes.T
