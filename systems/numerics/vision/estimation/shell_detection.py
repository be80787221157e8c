"""Coloured shells in a picture of the omni-camera: where their bases are, and how wide they look.

Colour threshold, dilation and erosion, connected components; then the blob's edge towards the
mirror's axis, which is the bottom edge of the shell (Figure 2.7).

Source: Zhang 2014, 2.2.4.1-2.2.4.2; the sub-pixel edge and the refusals are ours.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from .base_edge import find_base_edge
from .outcomes import Outcome
from .pictures import as_rgb
from .shell_colours import ShellColour, colour_mask, hue_saturation_value

# Blobs of fewer pixels are noise.
_MIN_AREA = 12
_KERNEL = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
# Half of the part of a blob's width that counts as its middle.
_MIDDLE = 0.1
# A base whose lines scatter more than this has no clear edge [px].
_MAX_EDGE_ERROR = 1.5


@dataclass(frozen=True, kw_only=True)
class ShellDetection:
    """One colour in one picture.

    Attributes:
        outcome: SEEN, or why there is nothing to measure; the numbers are NaN then.
        pixel: Point of the bottom edge nearest to the mirror's axis (column, row).
        pixel_radius: Its distance p from the axis [px].
        pixel_radius_std: Standard error of it [px].
        bearing: Of the shell, counter-clockwise from the robot's front [rad].
        width: Angle that the shell takes up as seen from the axis [rad].
        skew: How far the blob's mean bearing is from the middle between its sides [rad].
        outer_radius: Greatest distance of the pixels in its middle from the axis [px].
        area: Pixels of the largest blob of the colour, whatever the outcome.
    """

    outcome: Outcome
    pixel: tuple[float, float] = (math.nan, math.nan)
    pixel_radius: float = math.nan
    pixel_radius_std: float = math.nan
    bearing: float = math.nan
    width: float = math.nan
    skew: float = math.nan
    outer_radius: float = math.nan
    area: int = 0


def detect_shells(
    picture: np.ndarray, colours: Sequence[ShellColour], axis: np.ndarray | tuple[float, float]
) -> list[ShellDetection]:
    """Look for one shell of each colour.

    Args:
        picture: Red, green, blue and perhaps alpha, shape (height, width, 3 or 4), uint8.
        colours: What to look for.
        axis: Pixel of the mirror's axis (column, row), as `OmniCamera.axis_pixel`.

    Returns:
        A detection per colour, in their order.

    Raises:
        InvalidInput: The picture has another type or shape.
    """
    picture = as_rgb(picture)
    hsv = hue_saturation_value(picture)
    return [_detect(picture, colour_mask(hsv, colour), np.asarray(axis)) for colour in colours]


def _detect(picture: np.ndarray, mask: np.ndarray, axis: np.ndarray) -> ShellDetection:
    left, top, across, down = cv2.boundingRect(mask)
    if across == 0:
        return ShellDetection(outcome=Outcome.NO_BLOB)
    window = (slice(top, top + down), slice(left, left + across))
    # Dilation, then erosion: noisy holes close. The other order would drop noisy specks, and with
    # them the shells far away, which are two pixels high; specks are told by their area instead.
    closed = cv2.morphologyEx(mask[window], cv2.MORPH_CLOSE, _KERNEL)
    _, labels, boxes, _ = cv2.connectedComponentsWithStats(closed, connectivity=8)
    areas = boxes[1:, cv2.CC_STAT_AREA]
    area = int(areas.max())
    blobs = np.flatnonzero(areas >= _MIN_AREA)
    if len(blobs) != 1:
        return ShellDetection(
            outcome=Outcome.TWO_BLOBS if len(blobs) else Outcome.NO_BLOB, area=area
        )
    blob = (labels == int(blobs[0]) + 1).astype(np.uint8)
    rows, columns = np.nonzero(blob)
    rows, columns = rows + top, columns + left
    height, width = mask.shape
    borders = (rows.min(), columns.min(), height - 1 - rows.max(), width - 1 - columns.max())
    if 0 in borders:
        return ShellDetection(outcome=Outcome.CUT_OFF, area=area)
    mask[:] = 0
    mask[window] = blob
    return _measure(picture, mask, columns, rows, axis)


def _measure(
    picture: np.ndarray, blob: np.ndarray, columns: np.ndarray, rows: np.ndarray, axis: np.ndarray
) -> ShellDetection:
    """Bearing, width and base of the only blob."""
    nothing = ShellDetection(outcome=Outcome.NO_SHELL_SHAPE, area=len(rows))
    right, up = columns - axis[0], axis[1] - rows
    radius = np.hypot(right, up)
    if radius.min() < 1:
        return nothing
    # Pixels weigh less further out, where an angle covers more of them.
    weight = 1 / radius
    middle = math.atan2(float(weight @ (right / radius)), float(weight @ (up / radius)))
    turn = np.arctan2(right, up) - middle
    turn = (turn + math.pi) % (2 * math.pi) - math.pi
    mean = float(np.average(turn, weights=weight))
    spread = float(np.average((turn - mean) ** 2, weights=weight))
    # The sides of a shell are lines through the axis: its bearings are spread evenly.
    width = math.sqrt(12 * spread)
    if np.ptp(turn) > math.pi:
        return nothing
    bearing = (middle + mean + math.pi) % (2 * math.pi) - math.pi
    base = find_base_edge(
        picture,
        blob,
        axis,
        bearing=bearing,
        width=width,
        radii=(float(radius.min()), float(radius.max())),
    )
    if base is None or base.radius_std > _MAX_EDGE_ERROR:
        return nothing
    out = np.array([math.sin(bearing), -math.cos(bearing)])
    column, row = axis + base.radius * out
    return ShellDetection(
        outcome=Outcome.SEEN,
        pixel=(float(column), float(row)),
        pixel_radius=base.radius,
        pixel_radius_std=base.radius_std,
        bearing=bearing,
        width=width,
        skew=abs(mean - 0.5 * float(turn.min() + turn.max())),
        outer_radius=float(radius[np.abs(turn - mean) <= _MIDDLE * width + 0.5 * weight].max()),
        area=len(rows),
    )
