"""Where the bottom edge of a shell lies in a picture, to a fraction of a pixel.

An edge of a blob is known to a pixel only, which at 60 inches is 7 cm. The colours across the
edge tells more: along lines from the mirror's axis outwards, the edge is where the picture is half
as colourful as the shell. Brightness will not do: below the shell there is a dark robot, which may
be thinner than a pixel.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np

# Pixels before and behind a blob's inner edge that a line covers, and its steps.
_BEFORE, _BEHIND, _STEP = 6.0, 3.0, 0.25
# Where the floor has its own colour, and how far in the shell has reached its own, in pixels from
# the coarse edge.
_FLOOR, _SHELL = (-5.0, -2.5), 3.0
# Part of a blob's width whose edge is looked at: its corners are rounded by the closing.
_PART = 0.6
_LINES = (5, 41)
# Edges of lines that are further off the fitted curve than this many deviations are left out.
_OUTLIER = 3.0


@dataclass(frozen=True, kw_only=True)
class BaseEdge:
    """The point of a shell's bottom edge that is nearest to the mirror's axis.

    Attributes:
        radius: Its distance from the axis in the picture [px].
        radius_std: Standard error of it, and what its two halves differ by [px].
    """

    radius: float
    radius_std: float


def find_base_edge(
    picture: np.ndarray,
    mask: np.ndarray,
    axis: np.ndarray,
    *,
    bearing: float,
    width: float,
    radii: tuple[float, float],
) -> BaseEdge | None:
    """Find the bottom edge of a blob.

    Args:
        picture: Red, green, blue, shape (height, width, 3), uint8.
        mask: Not 0 in the blob, shape (height, width), uint8.
        axis: Pixel of the mirror's axis (column, row).
        bearing: Of the blob's middle, as in `omni_optics` [rad].
        width: Of the blob as seen from the axis [rad].
        radii: Least and greatest distance of the blob's pixels from the axis [px].

    Returns:
        The edge, or None where fewer than three lines have one.
    """
    half = 0.5 * _PART * width
    count = int(np.clip(round(2 * half * radii[0]), *_LINES)) | 1
    angles = np.linspace(-half, half, count)
    steps = np.arange(max(radii[0] - _BEFORE, 0.0), radii[1] + _BEHIND, _STEP)
    directions = bearing + angles[:, None]
    columns = (axis[0] + steps * np.sin(directions)).astype(np.float32)
    rows = (axis[1] - steps * np.cos(directions)).astype(np.float32)
    colours = cv2.remap(picture, columns, rows, cv2.INTER_LINEAR).astype(np.float32)
    inside = cv2.remap(mask, columns, rows, cv2.INTER_NEAREST) > 0
    lines = inside.any(axis=1)
    angles, colours, inside = angles[lines], colours[lines], inside[lines]
    if len(angles) < 3:
        return None
    offsets = steps - steps[np.argmax(inside, axis=1)][:, None]
    before = (offsets >= _FLOOR[0]) & (offsets <= _FLOOR[1])
    if not before.any():
        return None
    # Colourfulness, of which grey floor and dark robot have none, along that of the shell.
    chroma = colours - colours.mean(axis=2, keepdims=True)
    floor = chroma[before].mean(axis=0)
    across = chroma[inside].mean(axis=0) - floor
    strength = (chroma - floor) @ across
    near = (offsets >= _FLOOR[1]) & (offsets <= _SHELL)
    full = float(np.median(np.where(near, strength, -np.inf).max(axis=1)))
    if not full > 0:
        return None
    edges = np.array([_first_half(*line) for line in zip(strength / full, near, strict=True)])
    found = ~np.isnan(edges)
    return _nearest_point(angles[found], steps[0] + _STEP * edges[found])


def _first_half(share: np.ndarray, near: np.ndarray) -> float:
    """Place, in steps, at which a line's share of the shell's colour first reaches half, or NaN."""
    above = np.flatnonzero(near & (share >= 0.5))
    if len(above) == 0 or above[0] == 0 or not near[above[0] - 1]:
        return math.nan
    k = int(above[0])
    return k - 1 + float((0.5 - share[k - 1]) / (share[k] - share[k - 1]))


def _nearest_point(angles: np.ndarray, edges: np.ndarray) -> BaseEdge | None:
    """Fit the edge by an even parabola over the angle: the round base is symmetric."""
    terms = np.column_stack([np.ones_like(angles), angles**2])
    left, right = edges[angles < 0], edges[angles > 0]
    if min(len(left), len(right)) < 2:
        return None
    lopsided = 0.5 * abs(float(np.median(left) - np.median(right)))
    curve = np.linalg.lstsq(terms, edges, rcond=None)[0]
    off = np.abs(edges - terms @ curve)
    # The median keeps a few wild lines from hiding themselves.
    keep = off <= _OUTLIER * max(1.5 * float(np.median(off)), 0.05)
    terms, edges = terms[keep], edges[keep]
    if len(edges) < 3:
        return None
    curve = np.linalg.lstsq(terms, edges, rcond=None)[0]
    off = edges - terms @ curve
    scatter = math.sqrt(float(off @ off) / (len(edges) - 2))
    # The standard error of the curve's value at angle zero.
    error = scatter * math.sqrt(np.linalg.pinv(terms.T @ terms)[0, 0])
    return BaseEdge(radius=float(curve[0]), radius_std=math.hypot(error, lopsided))
