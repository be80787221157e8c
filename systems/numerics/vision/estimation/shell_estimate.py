"""All there is to know of the shells in one picture: found, measured, and located.

The whole outline of a shell is fitted to the picture (`outline_fit`); the covariance is of that
very picture, and of the calibration. What fits no shell is refused: at a given range, a shell of
known size has a certain height, width and curvature of base and top, and nothing else of its colour
has. The thesis's model reads its range at the same edge and adds its systematic error, as the
calibration found it.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...errors import require_one_of
from .calibration import Calibration
from .outline_fit import OutlineFit, fit_outline
from .pictures import as_rgb, has_contrast, require_size
from .range_models import MODELS, exact_pixel_radius
from .shell_detection import Outcome, ShellColour, ShellDetection, Window, detect_blobs

# Widths over the expected: below the first a side may be hidden, below the second most of a shell;
# above the third it is not one whole shell, with pixels by which a blurred one may be wider.
_PARTLY, _MOSTLY, _TOO_WIDE, _WIDER = 0.97, 0.35, 1.25, 8.0
# A blob narrower than this share of the fitted shell, and by more than so many pixels, is no whole
# shell either: a smoothing across a hidden side may look like one.
_NARROWER, _NARROWER_PIXELS = 0.88, 3.0
# Largest shift of a shell's edges, in deviations of the smoothing: in pictures that are not
# saturated, and in those that are. And its largest remainders, as in `OutlineFit`.
_SHIFTED, _SHIFTED_WHITE = 0.8, 2.5
_MISFIT, _DENT, _ROUGHNESS = 1.0, 0.24, 0.07
# How many times larger remainders may be than noise and raster make them: of a whole shell, as
# blocks of compressed pictures err too, and of one with a side hidden, which fits more things.
_STRANGE, _STRANGE_PARTLY = 2.8, 2.0
# Floor and walls differ in colour by less than this share of the shell's: more is another coloured
# thing at the outline, which may hide some of it.
_AROUND = 0.25
# Where they differ by more than this, it may be such a thing.
_BESIDE = 0.15
# More smoothing than this leaves no outline [px].
_BLURRED = 4.0
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
    """An estimate that says that nothing is known, and why."""
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
    if not detection.outcome.has_estimate or detection.window is None:
        return no_estimate(detection.outcome)
    start = _start(detection.window, detection.bearing, detection.width, calibration)
    nearest, farthest = calibration.readings.distances[[0, -1]].tolist()
    low, high = _NEAREST * nearest, _FARTHEST * farthest
    # Roughly, so with a margin.
    if not 0.8 * low <= start <= 1.5 * high:
        return no_estimate(Outcome.OUT_OF_RANGE)
    expected = 2 * math.asin(calibration.shell_radius / (start + calibration.shell_radius))
    ratio = detection.width / expected
    if ratio > _TOO_WIDE + _WIDER / (detection.pixel_radius * expected):
        return no_estimate(Outcome.TOO_WIDE)
    if ratio < _MOSTLY:
        return no_estimate(Outcome.MOSTLY_HIDDEN)
    fit, outcome = _best_fit(detection, calibration, start, expected)
    if fit is None:
        return no_estimate(outcome)
    if not low <= fit.range <= high:
        return no_estimate(Outcome.OUT_OF_RANGE)
    return _read(fit, outcome, detection.width, calibration, model)


def _start(window: Window, bearing: float, width: float, calibration: Calibration) -> float:
    """Range at which a shell's middle is as far out as the middle of the blob [m]."""
    rows, columns = np.nonzero(window.blob)
    right, up = columns - window.axis[0], window.axis[1] - rows
    radius = np.hypot(right, up)
    turn = (np.arctan2(right, up) - bearing + math.pi) % (2 * math.pi) - math.pi
    middle = radius[np.abs(turn) <= 0.125 * width + 1 / radius]
    outline = calibration.outline
    return float(np.interp(np.median(middle), outline.middles, outline.ranges))


def _best_fit(
    detection: ShellDetection, calibration: Calibration, start: float, expected: float
) -> tuple[OutlineFit | None, Outcome]:
    """The fit of a whole shell, or of one with a side hidden; or why there is none."""
    assert detection.window is not None
    outline, bearing = calibration.outline, detection.bearing
    whole = fit_outline(detection.window, outline, (start, bearing))
    if whole is not None and whole.sharpness > _BLURRED:
        return None, Outcome.BLURRED
    if whole is not None and _is_shell(whole) and _is_wide(whole, detection, calibration):
        return whole, Outcome.SEEN
    missing = expected - detection.width
    if missing < (1 - _PARTLY) * expected:
        return None, Outcome.NO_SHELL_SHAPE
    amount = missing * detection.pixel_radius
    fits = [
        fit_outline(detection.window, outline, (start, bearing + turn), hidden)
        for turn, hidden in ((-0.5 * missing, (amount, 0.0)), (0.5 * missing, (0.0, amount)))
    ]
    shells = [fit for fit in fits if fit is not None and _is_shell(fit, _STRANGE_PARTLY)]
    if not shells:
        return None, Outcome.NO_SHELL_SHAPE
    return min(shells, key=lambda fit: fit.misfit), Outcome.PARTLY_HIDDEN


def _is_wide(fit: OutlineFit, detection: ShellDetection, calibration: Calibration) -> bool:
    """Whether a blob is as wide as the shell that was fitted to it."""
    expected = 2 * math.asin(calibration.shell_radius / (fit.range + calibration.shell_radius))
    missing = (expected - detection.width) * detection.pixel_radius
    return detection.width >= _NARROWER * expected or missing <= _NARROWER_PIXELS


def _is_shell(fit: OutlineFit, strange: float = _STRANGE) -> bool:
    shifted = _SHIFTED_WHITE if fit.saturated else _SHIFTED
    return (
        fit.sharpness <= _BLURRED
        and fit.shift <= shifted * fit.sharpness
        and fit.misfit <= _MISFIT
        and fit.dent <= _DENT
        and fit.roughness <= _ROUGHNESS
        and fit.strange <= strange
        and fit.around <= _AROUND
    )


def _read(
    fit: OutlineFit, outcome: Outcome, width: float, calibration: Calibration, model: str
) -> ShellEstimate:
    """Range by a model, and all that makes it and the bearing unsure."""
    camera, base = calibration.camera, calibration.base
    edges = exact_pixel_radius([fit.range, 1.001 * fit.range], camera=camera, base=base)
    p = float(edges[0])
    by_optics, turned = calibration.optics_doubt(fit.range, p)
    covariance = fit.covariance + np.diag([by_optics, turned])
    # One side farther in than the other: something may hide a pixel of it.
    off = 0.5 * fit.lopsided
    covariance += np.diag([(off * 0.001 * fit.range / (edges[1] - p)) ** 2, (off / p) ** 2])
    # Another colour beside an edge that is farther in or out: something may hide that much of it.
    if fit.around > _BESIDE:
        covariance[0, 0] += (fit.shift * 0.001 * fit.range / (edges[1] - p)) ** 2
    if outcome == Outcome.PARTLY_HIDDEN:
        covariance += np.diag(_doubts(fit.range, width, calibration.shell_radius))
    distance = fit.range
    if model != "exact":
        there, beyond = calibration.range_of(model, edges).tolist()
        if not math.isfinite(beyond):
            return no_estimate(Outcome.OUT_OF_RANGE)
        scale = np.array([(beyond - there) / (0.001 * fit.range), 1.0])
        covariance = covariance * np.outer(scale, scale)
        curve, distance = calibration.curves[model], there
        covariance[0, 0] += float(np.interp(p, curve.pixel_radius, curve.mean_error)) ** 2
    nearest, farthest = calibration.readings.distances[[0, -1]].tolist()
    outside = max(nearest - fit.range, fit.range - farthest, 0.0)
    covariance[0, 0] += (_EXTRAPOLATION * outside) ** 2
    if outside > 0 and outcome == Outcome.SEEN:
        outcome = Outcome.OUTSIDE_CALIBRATION
    return ShellEstimate(
        outcome=outcome, range=distance, bearing=fit.bearing, covariance=covariance
    )


def _doubts(distance: float, width: float, radius: float) -> tuple[float, float]:
    """Variances of range and bearing if less of a shell is seen than there is.

    What hides a side may hide some of the other, and the base's nearest point.
    """
    expected = 2 * math.asin(radius / (distance + radius))
    missing = min(max(1 - width / expected, 0.0), 1.0)
    beside = radius * (1 - math.sqrt(1 - missing**2))
    return beside**2, (0.5 * missing * expected) ** 2


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


def search_shells(
    picture: np.ndarray,
    colours: Sequence[ShellColour],
    calibration: Calibration,
    model: str = "exact",
) -> list[tuple[ShellDetection, ShellEstimate]]:
    """Look for one shell of each colour, and estimate where it is.

    What has a shell's colour but not its outline does not count, unless it is all there is. A
    colour that comes twice stands for two identical shells, in any order.

    Args:
        picture: Red, green, blue and perhaps alpha, shape (height, width, 3 or 4), uint8. One that
            is a single colour all over, as before the first one came, gives no estimates.
        colours: What to look for.
        calibration: Of the camera.
        model: Of the range, one of MODELS.

    Returns:
        For each colour, what was seen and where it is.

    Raises:
        InvalidInput: The picture has another type, shape or size than the camera's, or there is
            no such model.
    """
    picture = as_rgb(picture)
    camera = calibration.camera
    require_size(picture, camera.width, camera.height)
    if not has_contrast(picture):
        nothing = ShellDetection(outcome=Outcome.NO_PICTURE)
        return [(nothing, no_estimate(Outcome.NO_PICTURE)) for _ in colours]
    blobs = detect_blobs(picture, list(dict.fromkeys(colours)), camera.axis_pixel)
    found: dict[ShellColour, list[tuple[ShellDetection, ShellEstimate]]] = {}
    for colour, detections in zip(dict.fromkeys(colours), blobs, strict=True):
        pairs = [(each, estimate_shell(each, calibration, model)) for each in detections]
        found[colour] = _shared_out(pairs, list(colours).count(colour))
    return [found[colour].pop(0) for colour in colours]


def _shared_out(
    pairs: list[tuple[ShellDetection, ShellEstimate]], count: int
) -> list[tuple[ShellDetection, ShellEstimate]]:
    """What to say of each of `count` shells of one colour, given all blobs of it."""
    shells = [pair for pair in pairs if pair[1].outcome.has_estimate]
    if len(shells) > count:
        area = pairs[0][0].area
        return [_nothing(Outcome.TWO_BLOBS, area) for _ in range(count)]
    if not shells:
        return [pairs[0]] * count
    rest = [_nothing(Outcome.NOT_ANOTHER, 0) for _ in range(count - len(shells))]
    return shells + rest


def _nothing(outcome: Outcome, area: int) -> tuple[ShellDetection, ShellEstimate]:
    return ShellDetection(outcome=outcome, area=area), no_estimate(outcome)
