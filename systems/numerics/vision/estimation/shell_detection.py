"""Coloured shells in a picture of the omni-camera: where their bases are, and how wide they look.

A colour is a range of hues: hue hardly changes with light and shadow, unlike red, green and blue.

The edge of a blob is known to a pixel only, which at 60 inches is 7 cm. The colours across the
edge tells more: along lines from the mirror's axis outwards, the edge is where the picture is half
as colourful as the shell. Brightness will not do: below the shell there is a dark robot, which may
be thinner than a pixel.

Colour threshold, dilation and erosion, connected components; then the blob's edge towards the
mirror's axis, which is the bottom edge of the shell (Figure 2.7).

Source: Zhang 2014, 2.2.4.1-2.2.4.2; the sub-pixel edge and the refusals are ours.
"""

import colorsys
import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

import cv2
import numpy as np

from ...errors import require
from ..surroundings import SHELL_COLOURS
from .pictures import as_rgb


class Outcome(IntEnum):
    """What came of looking for one colour of shell in one picture.

    The first three come with an estimate, the others with none.
    """

    SEEN = 0
    # Narrower than a shell at its range: something hides a side of it.
    PARTLY_HIDDEN = 1
    # A little outside the calibrated range: the estimate is an extrapolation.
    OUTSIDE_CALIBRATION = 2
    # An empty picture: the camera dropped the frame.
    NO_PICTURE = 3
    NO_BLOB = 4
    TWO_BLOBS = 5
    # The blob reaches the border of the picture.
    CUT_OFF = 6
    # No shell has that outline: a box, a mat or a poster has the colour, or the base is hidden.
    NO_SHELL_SHAPE = 7
    # Wider than a shell at its range: its base is hidden and it is nearer, or it is two shells.
    TOO_WIDE = 8
    # So narrow that there is no telling where its middle is.
    MOSTLY_HIDDEN = 9
    # Far outside the calibrated range, or above the model's horizon.
    OUT_OF_RANGE = 10
    # Of several shells of one colour fewer are seen than there are; all that is seen is measured.
    NOT_ANOTHER = 11
    # The picture is so blurred that an outline tells nothing.
    BLURRED = 12

    @property
    def has_estimate(self) -> bool:
        """Whether an estimate comes with it."""
        return self <= Outcome.OUTSIDE_CALIBRATION

    @property
    def words(self) -> str:
        """For people: as "two blobs"."""
        return self.name.lower().replace("_", " ")


@dataclass(frozen=True, kw_only=True)
class ShellColour:
    """Which pixels count as one colour of shell.

    Attributes:
        name: What the colour is called.
        hue: Middle of the hues, 0 red, 120 green, 240 blue [deg].
        hue_tolerance: How far a pixel's hue may be from it [deg].
        min_saturation: Least saturation, from 0 (grey) to 1.
        min_value: Least brightness of the strongest part, from 0 (black) to 1.

    Raises:
        InvalidInput: A number is out of its range.
    """

    name: str
    hue: float
    hue_tolerance: float = 22.0
    min_saturation: float = 0.4
    min_value: float = 0.18

    def __post_init__(self) -> None:
        require(0 <= self.hue < 360, "hue", "lie in [0, 360) degrees", self.hue)
        require(
            0 < self.hue_tolerance < 180,
            "hue_tolerance",
            "lie between 0 and 180 degrees",
            self.hue_tolerance,
        )
        for key in ("min_saturation", "min_value"):
            require(
                0 < getattr(self, key) < 1, key, "lie strictly between 0 and 1", getattr(self, key)
            )


COLOURS: dict[str, ShellColour] = {
    name: ShellColour(name=name, hue=360 * colorsys.rgb_to_hsv(*paint)[0])
    for name, paint in SHELL_COLOURS.items()
}


def chosen_colours(names: Sequence[str]) -> list[ShellColour]:
    """The colours of some names, in their order.

    Raises:
        InvalidInput: No name, an unknown one, or one that comes twice.
    """
    known = ", ".join(COLOURS)
    require(len(names) > 0, "colours", "name at least one colour", "none")
    for name in names:
        require(name in COLOURS, "colour", f"be one of {known}", name)
    require(len(set(names)) == len(names), "colours", "differ from each other", ", ".join(names))
    return [COLOURS[name] for name in names]


def hue_saturation_value(picture: np.ndarray) -> np.ndarray:
    """Hue (256 steps round the circle), saturation and value, each uint8, as `colour_mask` wants.

    Args:
        picture: Red, green, blue, shape (height, width, 3), uint8.
    """
    return cv2.cvtColor(picture, cv2.COLOR_RGB2HSV_FULL)


def colour_mask(hsv: np.ndarray, colour: ShellColour, light: float = 1.0) -> np.ndarray:
    """Pixels of a colour, 255 where they have it and else 0, shape (height, width), uint8.

    Args:
        hsv: The picture as hue, saturation and value, shape (height, width, 3).
        colour: Which.
        light: How bright the picture is, as a share of usual; the least value falls with it.
    """
    low = (colour.hue - colour.hue_tolerance) / 360 * 256
    high = (colour.hue + colour.hue_tolerance) / 360 * 256
    least = (255 * colour.min_saturation, 255 * light * colour.min_value)
    mask = np.zeros(hsv.shape[:2], np.uint8)
    # Red lies on both sides of the seam of the circle.
    for turn in (-256, 0, 256):
        if high + turn >= 0 and low + turn <= 255:
            bounds = (max(low + turn, 0), *least), (min(high + turn, 255), 255, 255)
            np.maximum(mask, cv2.inRange(hsv, *bounds), out=mask)
    return mask


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
