"""What a machine covers, in a form that compiles: rectangles, and discs for quick answers."""

import math
from typing import NamedTuple

import numpy as np

from ..machines.outlines import CombineOutline
from .standing_crop import CELL


class Footprint(NamedTuple):
    """Of a combine, in the frame of its pose; parts are the header and the body.

    Attributes:
        corners: Of each part, counterclockwise, shape (parts, 4, 2) [m].
        around: Of each part a disc that covers it: x, y, radius; shape (parts, 3) [m].
        inside: Discs that the parts cover: x, y, radius; shape (discs, 3) [m].
        body: Points of the body, at most a cell of standing crop apart, shape (points, 2) [m].
        reach: Farthest corner from the pose [m].
    """

    corners: np.ndarray
    around: np.ndarray
    inside: np.ndarray
    body: np.ndarray
    reach: float


def make_footprint(outline: CombineOutline) -> Footprint:
    """The footprint of a combine, whose header and body are rectangles along its heading."""
    parts = np.array(outline)
    low, high = parts.min(axis=1), parts.max(axis=1)
    around = np.column_stack([(low + high) / 2, np.hypot(*(high - low).T) / 2])
    inside = [_discs(*pair) for pair in zip(low, high, strict=True)]
    sides = [_spread(*pair) for pair in zip(low[1], high[1], strict=True)]
    body = np.stack(np.meshgrid(*sides), axis=-1).reshape(-1, 2)
    reach = float(np.hypot(*np.moveaxis(parts, -1, 0)).max())
    return Footprint(parts, around, np.concatenate(inside), np.ascontiguousarray(body), reach)


def _discs(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """A row of discs along the longer side of a rectangle, as wide as the shorter one."""
    radius = float((high - low).min() / 2)
    count = max(2, math.ceil(float((high - low).max()) / (2 * radius)))
    row = np.linspace(low + radius, high - radius, count)
    return np.column_stack([row, np.full(count, radius)])


def _spread(low: float, high: float) -> np.ndarray:
    """Points along a side, half a cell from its ends: an edge of the raster is no fault."""
    room = min(CELL / 2, (high - low) / 2)
    count = math.ceil((high - low - 2 * room) / CELL) + 1
    return np.linspace(low + room, high - room, count)
