"""Straight passes over crop that the loops leave: middle rows, tips and necks."""

from dataclasses import dataclass

import numpy as np
import shapely
from scipy import ndimage
from shapely.geometry.base import BaseGeometry

from .swept_cells import CropCells

# Places tried for a parting along either side, and what the way has to come down to.
CUTS = 16
WORTH_PARTING = 0.85


@dataclass(frozen=True, eq=False)
class Pass:
    """A straight over left crop.

    Attributes:
        ends: Of the line, in the order of driving, shape (2, 2) [m].
        area: Crop on it [m^2].
    """

    ends: np.ndarray
    area: float


@dataclass(frozen=True, eq=False)
class Block:
    """A piece of left crop with the rows over it, from one side to the other.

    Attributes:
        rows: Passes, all in one direction; the first has the rest of them on its right.
    """

    rows: tuple[Pass, ...]


def find_blocks(
    cells: CropCells, header: float, least_area: float, ground: BaseGeometry
) -> list[Block]:
    """Passes over every piece of standing crop that is worth some.

    Each piece is covered by parallel rows along the longer side of its smallest rectangle, evenly
    spaced and no farther apart than the header is wide.

    Args:
        cells: What has been cut so far.
        header: Width of the header [m].
        least_area: Crop that a pass is worth driving for [m^2].
        ground: Where combines may be.
    """
    standing = cells.has_crop & (cells.cut_by < 0)
    labels = np.zeros(standing.shape, dtype=np.int32)
    count = int(np.asarray(ndimage.label(standing, np.ones((3, 3)), output=labels)))
    x, y = cells.middles()
    blocks: list[Block] = []
    for number, window in enumerate(ndimage.find_objects(labels, count), start=1):
        if window is None:
            continue
        rows, columns = np.nonzero(labels[window] == number)
        rows, columns = rows + window[0].start, columns + window[1].start
        areas = cells.crop_area[rows, columns]
        if areas.sum() < least_area:
            continue
        middles = np.stack([x[columns], y[rows]], axis=1)
        for part in _straight_parts(middles, cells.size, header):
            found = _rows_over(middles[part], areas[part], cells.size, header, least_area, ground)
            if found:
                blocks.append(Block(tuple(found)))
    return blocks


def _straight_parts(middles: np.ndarray, size: float, header: float) -> list[np.ndarray]:
    """Part a piece of crop across where that saves driving, as at the bend of an L.

    Returns:
        Numbers of the cells in each part.
    """
    parts, pending = [], [np.arange(len(middles))]
    while pending:
        part = pending.pop()
        frame = _frame(middles[part], size)
        local = (middles[part] - frame[0]) @ np.stack(frame[1:], axis=1)
        best = (WORTH_PARTING * _driving(middles[part], size, header), None)
        for axis in (0, 1):
            low, high = local[:, axis].min(), local[:, axis].max()
            for cut in low + (high - low) * np.arange(1, CUTS) / CUTS:
                side = local[:, axis] < cut
                if min(side.sum(), (~side).sum()) * size**2 < header**2 / 2:
                    continue
                way = _driving(middles[part][side], size, header)
                way += _driving(middles[part][~side], size, header)
                if way < best[0]:
                    best = way, side
        if best[1] is None:
            parts.append(part)
        else:
            pending += [part[best[1]], part[~best[1]]]
    return parts


def _frame(middles: np.ndarray, size: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Corner of the smallest rectangle round cells, and directions along and across it."""
    hull = shapely.MultiPoint(middles).convex_hull.buffer(size / 2, cap_style="square")
    corners = shapely.get_coordinates(hull.minimum_rotated_rectangle)
    sides = np.diff(corners[:3], axis=0)
    along = sides[np.argmax(np.hypot(*sides.T))]
    along = along / np.hypot(*along)
    return corners[0], along, np.array([-along[1], along[0]])


def _driving(middles: np.ndarray, size: float, header: float) -> float:
    """Way that rows along the rectangle round cells take, a turn counted as three headers [m]."""
    corner, along, across = _frame(middles, size)
    length, width = np.ptp((middles - corner) @ np.stack([along, across], axis=1), axis=0) + size
    return float(np.ceil(width / header - size / header) * (length + 3.0 * header))


def _rows_over(
    middles: np.ndarray,
    areas: np.ndarray,
    size: float,
    header: float,
    least_area: float,
    ground: BaseGeometry,
) -> list[Pass]:
    corner, along, across = _frame(middles, size)
    u, v = (middles - corner) @ along, (middles - corner) @ across
    low, high = v.min() - size / 2, v.max() + size / 2
    count = max(1, int(np.ceil((high - low) / header - size / header)))
    spacing = (high - low) / count
    found = []
    # From the left of their direction to the right.
    for k in reversed(range(count)):
        row = (v >= low + k * spacing) & (v < low + (k + 1) * spacing + 1e-9)
        if areas[row].sum() < least_area:
            continue
        aside = low + (k + 0.5) * spacing
        span = np.array([u[row].min() - size, u[row].max() + size])
        line = shapely.LineString(corner + span[:, None] * along + aside * across)
        inside = line.intersection(ground)
        parts = [part for part in shapely.get_parts(inside).tolist() if part.length > 0]
        if parts:
            longest = max(parts, key=lambda part: part.length)
            found.append(Pass(np.array(longest.coords), float(areas[row].sum())))
    return found
