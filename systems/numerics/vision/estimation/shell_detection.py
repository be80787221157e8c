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
# Blobs of a colour that are looked at, the largest first.
_MOST = 6
# Pixels around a blob that belong to its window.
_MARGIN = 9
# A usual picture's bright parts, and the share of pixels beyond them: in darker pictures shells are
# darker.
_BRIGHT, _BRIGHT_SHARE = 200.0, 0.01
_KERNEL = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
# A base whose lines scatter more than this has no clear edge [px].
_MAX_EDGE_ERROR = 1.5


@dataclass(frozen=True, kw_only=True)
class Window:
    """The part of a picture around a blob.

    Attributes:
        colours: Red, green, blue, shape (height, width, 3), uint8.
        blob: Not 0 in the blob, shape (height, width), uint8.
        axis: Pixel of the mirror's axis in the window (column, row), mostly outside it, shape (2,).
    """

    colours: np.ndarray
    blob: np.ndarray
    axis: np.ndarray


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
        area: Pixels of the blob, or of the largest of the colour, whatever the outcome.
        window: The picture around the blob, or None without one.
    """

    outcome: Outcome
    pixel: tuple[float, float] = (math.nan, math.nan)
    pixel_radius: float = math.nan
    pixel_radius_std: float = math.nan
    bearing: float = math.nan
    width: float = math.nan
    area: int = 0
    window: Window | None = None


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
    return [_only(blobs) for blobs in detect_blobs(picture, colours, axis)]


def detect_blobs(
    picture: np.ndarray, colours: Sequence[ShellColour], axis: np.ndarray | tuple[float, float]
) -> list[list[ShellDetection]]:
    """Look for all that has a shell's colour.

    Args:
        picture: Red, green, blue and perhaps alpha, shape (height, width, 3 or 4), uint8.
        colours: What to look for.
        axis: Pixel of the mirror's axis (column, row), as `OmniCamera.axis_pixel`.

    Returns:
        For each colour a detection per blob, the largest first; at least one, which says so if
        there is none.

    Raises:
        InvalidInput: The picture has another type or shape.
    """
    picture = as_rgb(picture)
    hsv = hue_saturation_value(picture)
    bright = float(np.quantile(hsv[::8, ::8, 2], 1 - _BRIGHT_SHARE))
    light = min(max(bright, 1.0) / _BRIGHT, 1.0)
    masks = [colour_mask(hsv, colour, light) for colour in colours]
    return [_detect(picture, mask, np.asarray(axis)) for mask in masks]


def _only(blobs: list[ShellDetection]) -> ShellDetection:
    return (
        blobs[0]
        if len(blobs) == 1
        else ShellDetection(outcome=Outcome.TWO_BLOBS, area=blobs[0].area)
    )


def _detect(picture: np.ndarray, mask: np.ndarray, axis: np.ndarray) -> list[ShellDetection]:
    left, top, across, down = cv2.boundingRect(mask)
    if across == 0:
        return [ShellDetection(outcome=Outcome.NO_BLOB)]
    inside = mask[top : top + down, left : left + across]
    # Dilation, then erosion: noisy holes close. The other order would drop noisy specks, and with
    # them the shells far away, which are two pixels high; specks are told by their area instead.
    closed = cv2.morphologyEx(inside, cv2.MORPH_CLOSE, _KERNEL)
    _, labels, boxes, _ = cv2.connectedComponentsWithStats(closed, connectivity=8)
    areas = boxes[:, cv2.CC_STAT_AREA].copy()
    areas[0] = 0
    blobs = [k for k in np.argsort(-areas).tolist() if areas[k] >= _MIN_AREA][:_MOST]
    if not blobs:
        return [ShellDetection(outcome=Outcome.NO_BLOB, area=int(areas.max()))]
    found = []
    for k in blobs:
        box = boxes[k, :4] + [left, top, 0, 0]
        mask[:] = 0
        mask[top : top + down, left : left + across] = labels == k
        found.append(_measure(picture, mask, box, axis))
    return found


def _measure(
    picture: np.ndarray, mask: np.ndarray, box: np.ndarray, axis: np.ndarray
) -> ShellDetection:
    """Bearing, width and base of the blob of a mask, which lies in a box (left, top, sizes)."""
    left, top, across, down = box.tolist()
    rows, columns = np.nonzero(mask[top : top + down, left : left + across])
    rows, columns = rows + top, columns + left
    height, width = mask.shape
    if 0 in (left, top, width - left - across, height - top - down):
        return ShellDetection(outcome=Outcome.CUT_OFF, area=len(rows))
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
    wide = math.sqrt(12 * spread)
    if np.ptp(turn) > math.pi:
        return nothing
    bearing = (middle + mean + math.pi) % (2 * math.pi) - math.pi
    base = find_base_edge(
        picture,
        mask,
        axis,
        bearing=bearing,
        width=wide,
        radii=(float(radius.min()), float(radius.max())),
    )
    if base is None or base.radius_std > _MAX_EDGE_ERROR:
        return nothing
    column, row = axis + base.radius * np.array([math.sin(bearing), -math.cos(bearing)])
    low, high = max(top - _MARGIN, 0), top + down + _MARGIN
    first, last = max(left - _MARGIN, 0), left + across + _MARGIN
    return ShellDetection(
        outcome=Outcome.SEEN,
        pixel=(float(column), float(row)),
        pixel_radius=base.radius,
        pixel_radius_std=base.radius_std,
        bearing=bearing,
        width=wide,
        area=len(rows),
        window=Window(
            colours=picture[low:high, first:last].copy(),
            blob=mask[low:high, first:last].copy(),
            axis=axis - [first, low],
        ),
    )
