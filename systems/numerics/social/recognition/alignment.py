"""Corners to a fraction of a pixel: the stored picture laid over the one that was taken.

Least squares over all pixels of the square (Lucas and Kanade 1981; Baker and Matthews 2004), with
brightness and contrast free, and weights that forget what hides a part of it (Beaton and Tukey
1974). How steep the sum of squares is says how sure each corner is.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from .verification import homography_of, is_sane, map_square

# Side of the compared pictures: the square's own in the picture, between these [px].
_FINEST, _COARSEST = 72, 20
_STEPS, _ENOUGH = 15, 0.01
# Tukey's constant, in deviations; and the least deviation of a pixel [counts].
_TUKEY, _LEAST_NOISE = 4.0, 2.0
# Neighbouring errors go together: so many pixels count as one.
_TOGETHER = 6.0
# Doubt of each corner that remains whatever the picture [px].
_RASTER = 0.1
# A step of all corners at once is at most this share of the square [of its side].
_LONGEST = 0.15


@dataclass(frozen=True, eq=False)
class Alignment:
    """Where a square is, from all its pixels.

    Attributes:
        corners: Shape (4, 2) [px].
        covariance: Of the corners, row by row, shape (8, 8) [px^2].
        correlation: Over the part that was compared.
        visible: Share that was compared with more than half its weight.
    """

    corners: np.ndarray
    covariance: np.ndarray
    correlation: float
    visible: float


def align(picture: np.ndarray, reference: np.ndarray, corners: np.ndarray) -> Alignment | None:
    """Improve a square's corners.

    Args:
        picture: Grey, shape (height, width), float32.
        reference: What the square shows, shape (n, n), float32.
        corners: First guess, shape (4, 2) [px].

    Returns:
        None if the square comes apart, or too little of it is in the picture.
    """
    sides = np.hypot(*(np.roll(corners, -1, axis=0) - corners).T)
    size = int(np.clip(round(float(sides.max())), _COARSEST, _FINEST))
    template = cv2.resize(reference, (size, size), interpolation=cv2.INTER_AREA)
    steps = (np.arange(size) + 0.5) / size
    places = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    wanted = template.reshape(-1)
    for step in range(_STEPS):
        homography = homography_of(corners)
        if not is_sane(homography, corners):
            return None
        seen, slopes, inside = _sample(picture, homography, places, size)
        if np.count_nonzero(inside) < 0.2 * len(places):
            return None
        # In the picture's counts: template * contrast + brightness = seen.
        jacobian = _motion_of_corners(homography, corners, places, slopes)
        weights, fitted = _robust(wanted, seen, inside, last=step > 2)
        design = np.column_stack([jacobian, -wanted, -np.ones(len(wanted))])
        weighted = design * weights[:, None]
        normal = weighted.T @ design
        damped = normal + 1e-6 * np.diag(np.diag(normal)) + 1e-9 * np.eye(10)
        change = -np.linalg.solve(damped, weighted.T @ seen)[:8].reshape(4, 2)
        longest = _LONGEST * float(sides.mean())
        change *= min(1.0, longest / max(float(np.abs(change).max()), 1e-12))
        corners = corners + change
        if step > 3 and np.abs(change).max() < _ENOUGH:
            break
    if not is_sane(homography_of(corners), corners):
        return None
    variance = float(np.sum(weights * (seen - fitted) ** 2) / max(np.sum(weights), 1.0))
    variance = max(variance, _LEAST_NOISE**2)
    covariance = _TOGETHER * variance * np.linalg.inv(damped)[:8, :8] + _RASTER**2 * np.eye(8)
    kept = weights > 0.5
    return Alignment(
        corners=corners,
        covariance=covariance,
        correlation=_correlation(wanted[inside], seen[inside]),
        visible=float(np.mean(kept)),
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
    # As blurred as the template, whose pixels are means, if that is the coarser one.
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
    sampled = cv2.remap(layers, where, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
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
    wanted: np.ndarray, seen: np.ndarray, inside: np.ndarray, *, last: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Weights of the pixels, and what the template predicts of them, shapes (n,).

    Args:
        wanted: The template.
        seen: The picture.
        inside: The frame.
        last: Forget outliers: not before the square is about where it should be.
    """
    weights = inside.astype(float)
    design = np.column_stack([wanted, np.ones(len(wanted))])
    fitted = seen
    for _ in range(3 if last else 1):
        gain, *_ = np.linalg.lstsq(design * weights[:, None], seen * weights, rcond=None)
        fitted = design @ gain
        if not last:
            break
        error = seen - fitted
        spread = 1.48 * float(np.median(np.abs(error[inside])))
        ratio = error / (_TUKEY * max(spread, _LEAST_NOISE))
        weights = inside * np.maximum(1 - ratio**2, 0.0) ** 2
    return weights, fitted


def _correlation(a: np.ndarray, b: np.ndarray) -> float:
    a, b = a - a.mean(), b - b.mean()
    return float(a @ b / max(float(np.linalg.norm(a) * np.linalg.norm(b)), 1e-12))
