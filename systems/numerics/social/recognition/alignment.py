"""Sub-pixel corners of a square, by alignment of the stored picture with the one that was taken.

Least squares over all pixels of the square (Lucas and Kanade 1981; Baker and Matthews 2004), with
free brightness and contrast, and weights that ignore occluded parts (Beaton and Tukey 1974). The
corners' covariance follows from the curvature of the sum of squares.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from scipy.spatial import KDTree

from .matching import Matches, homography_of, is_sane, map_square

# Side of the compared pictures: the square's own in the picture, between these [px].
_FINEST, _COARSEST = 72, 20
_STEPS, _ENOUGH = 15, 0.01
# Tukey's constant, in usual errors; the least usual error of a pixel [counts]; and the size of the
# window over which errors are judged, as a part of the square.
_TUKEY, _LEAST_NOISE, _WINDOWS = 2.5, 2.0, 8
# Neighbouring errors are correlated: this many pixels count as one.
_TOGETHER = 4.0
# Least standard deviation of each corner [px].
_RASTER = 0.1
# The square counts as visible this near to a matched point [of its side]; and least number of such
# pixels to rely on.
_NEAR, _FEWEST = 0.15, 60
# A pixel agrees from this weight on.
_COUNTS = 0.1
# Least share of the square in the frame.
_LEAST_INSIDE = 0.2
# Standard deviation of a matched point [px].
_MATCH_NOISE = 1.2
# A step of all corners at once is at most this share of the square [of its side].
_LONGEST = 0.15


@dataclass(frozen=True, eq=False)
class Alignment:
    """Where a square is, from all its pixels.

    Attributes:
        corners: Shape (4, 2) [px].
        covariance: Of the corners, row by row, shape (8, 8) [px^2].
        correlation: Over the part that was compared.
        visible: Share that was compared and agrees.
    """

    corners: np.ndarray
    covariance: np.ndarray
    correlation: float
    visible: float


def align(
    picture: np.ndarray, reference: np.ndarray, corners: np.ndarray, matches: Matches
) -> Alignment | None:
    """Improve a square's corners.

    Args:
        picture: Grey, shape (height, width), float32.
        reference: What the square shows, shape (n, n), float32.
        corners: First guess, shape (4, 2) [px].
        matches: Points on the square: they mark the part that is certainly visible, and anchor the
            corners if that part is small.

    Returns:
        None if the square degenerates, or too little of it is in the picture.
    """
    sides = np.hypot(*(np.roll(corners, -1, axis=0) - corners).T)
    size = int(np.clip(round(float(sides.max())), _COARSEST, _FINEST))
    template = cv2.resize(reference, (size, size), interpolation=cv2.INTER_AREA)
    steps = (np.arange(size) + 0.5) / size
    places = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    wanted = template.reshape(-1).astype(float)
    near = KDTree(matches.place).query(places)[0] < _NEAR
    judged = None
    for _ in range(_STEPS):
        homography = homography_of(corners)
        if not is_sane(homography, corners):
            return None
        seen, slopes, inside = _sample(picture, homography, places, size)
        if np.count_nonzero(inside) < _LEAST_INSIDE * len(places):
            return None
        # In the picture's counts: template * contrast + brightness = seen.
        jacobian = _motion_of_corners(homography, corners, places, slopes)
        weights, fitted = _robust(wanted, seen, inside, inside & near)
        design = np.column_stack([jacobian, -wanted, -np.ones(len(wanted))])
        variance = float(weights @ (seen - fitted) ** 2) / max(float(weights.sum()), 1.0)
        sureness = weights / (_TOGETHER * max(variance, _LEAST_NOISE**2))
        weighted = design * sureness[:, None]
        information, pull = weighted.T @ design, weighted.T @ (seen - fitted)
        for along, by in zip(*_anchors(homography, corners, matches), strict=True):
            information[:8, :8] += np.outer(along, along)
            pull[:8] += along * by
        information += 1e-6 * np.diag(np.diag(information)) + 1e-9 * np.eye(10)
        change = -np.linalg.solve(information, pull)[:8].reshape(4, 2)
        judged = information, _correlation(wanted, seen, weights), float(np.mean(weights > _COUNTS))
        longest = _LONGEST * float(sides.mean())
        change *= min(1.0, longest / max(float(np.abs(change).max()), 1e-12))
        corners = corners + change
        if np.abs(change).max() < _ENOUGH:
            break
    if judged is None or not is_sane(homography_of(corners), corners):
        return None
    information, correlation, visible = judged
    covariance = np.linalg.inv(information)[:8, :8] + _RASTER**2 * np.eye(8)
    return Alignment(corners, covariance, correlation, visible)


def _anchors(
    homography: np.ndarray, corners: np.ndarray, matches: Matches
) -> tuple[np.ndarray, np.ndarray]:
    """Matched points as measurements: Jacobian by corners, shape (2 n, 8), and residuals, (2 n,).

    Both are divided by the standard deviation; large residuals count less (Huber 1964).
    """
    miss = map_square(homography, matches.place) - matches.pixel
    axes = [np.broadcast_to(axis, miss.shape) for axis in np.eye(2)]
    slopes = [_motion_of_corners(homography, corners, matches.place, axis) for axis in axes]
    distance = np.hypot(miss[:, 0], miss[:, 1])
    weight = np.sqrt(np.minimum(1.0, _MATCH_NOISE / np.maximum(distance, 1e-9))) / _MATCH_NOISE
    return (
        np.vstack([each * weight[:, None] for each in slopes]),
        np.concatenate([miss[:, 0] * weight, miss[:, 1] * weight]),
    )


def _sample(
    picture: np.ndarray, homography: np.ndarray, places: np.ndarray, size: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Counts and slopes of a picture at places of the square.

    Returns:
        Counts, shape (n,); slopes, shape (n, 2) [counts/px]; inside the frame, shape (n,).
    """
    height, width = picture.shape
    pixels = map_square(homography, places)
    low = np.floor(pixels.min(axis=0)).astype(int) - 3
    high = np.ceil(pixels.max(axis=0)).astype(int) + 4
    left, top = np.clip(low, 0, [width - 1, height - 1])
    right, bottom = np.clip(high, 1, [width, height])
    part = np.ascontiguousarray(picture[top:bottom, left:right])
    # If the template is coarser, blur the picture to match: the template's pixels are means.
    shrink = max(high - low) / size
    if shrink > 1.5:
        part = cv2.GaussianBlur(part, (0, 0), 0.4 * float(shrink))
    layers = cv2.merge(
        [
            part,
            cv2.Scharr(part, cv2.CV_32F, 1, 0, scale=1 / 32),
            cv2.Scharr(part, cv2.CV_32F, 0, 1, scale=1 / 32),
        ]
    )
    where = (pixels - [left, top]).astype(np.float32).reshape(size, size, 2)
    columns, rows = cv2.split(where)
    sampled = cv2.remap(layers, columns, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    sampled = sampled.reshape(-1, 3).astype(float)
    inside = np.all((pixels >= 0) & (pixels <= [width - 1, height - 1]), axis=1)
    return sampled[:, 0], sampled[:, 1:], inside


def _motion_of_corners(
    homography: np.ndarray, corners: np.ndarray, places: np.ndarray, slopes: np.ndarray
) -> np.ndarray:
    """How the counts at each place change with each corner's coordinate, shape (n, 8)."""
    step = 1e-3
    change = np.empty((9, 8))
    for k in range(8):
        moved = np.zeros(8)
        moved[k] = step
        ahead, behind = (
            homography_of(corners + sign * moved.reshape(4, 2)).ravel() for sign in (1, -1)
        )
        change[:, k] = (ahead - behind) / (2 * step)
    lifted = np.column_stack([places, np.ones(len(places))])
    depth = lifted @ homography[2]
    pixels = (lifted @ homography[:2].T) / depth[:, None]
    x, y = slopes.T / depth
    away = -(x * pixels[:, 0] + y * pixels[:, 1])
    rates = np.hstack([lifted * each[:, None] for each in (x, y, away)])
    return rates @ change


def _robust(
    wanted: np.ndarray, seen: np.ndarray, inside: np.ndarray, sure: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Weights of the pixels, and what the template predicts of them, shapes (n,).

    Contrast, brightness and the usual error are estimated from the pixels around matched points, so
    that an occluder has no influence, even if it hides the greater part.

    Args:
        wanted: The template.
        seen: The picture.
        inside: Whether each pixel is inside the frame.
        sure: Whether it is also near a matched point.
    """
    design = np.column_stack([wanted, np.ones(len(wanted))])
    if np.count_nonzero(sure) < _FEWEST:
        sure = inside
    weights, fitted = sure.astype(float), seen
    for _ in range(3):
        gain, *_ = np.linalg.lstsq(design * weights[:, None], seen * weights, rcond=None)
        fitted = design @ gain
        # Judge a pixel by the errors around it: parts of an occluder look right by chance.
        size = math.isqrt(len(seen))
        window = (max(3, size // _WINDOWS) | 1,) * 2
        squares = np.where(inside, (seen - fitted) ** 2, 0.0).reshape(size, size)
        counted = cv2.boxFilter(inside.reshape(size, size).astype(float), -1, window)
        around = cv2.boxFilter(squares, -1, window) / np.maximum(counted, 1e-9)
        # By rounding, the box filter can leave small negative numbers.
        error = np.sqrt(np.maximum(around, 0.0)).ravel()
        spread = float(np.median(error[sure]))
        ratio = error / (_TUKEY * max(spread, _LEAST_NOISE))
        weights = inside * np.maximum(1 - ratio**2, 0.0) ** 2
    return weights, fitted


def _correlation(a: np.ndarray, b: np.ndarray, weights: np.ndarray) -> float:
    total = max(float(weights.sum()), 1e-12)
    a, b = a - weights @ a / total, b - weights @ b / total
    size = math.sqrt(float(weights @ a**2) * float(weights @ b**2))
    return float(weights @ (a * b)) / max(size, 1e-12)
