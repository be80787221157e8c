"""Straight passes over crop that the loops leave: middle rows, tips and necks."""

from dataclasses import dataclass

import numpy as np
import shapely
from scipy import ndimage
from shapely.geometry.base import BaseGeometry

from .swept_cells import CropCells


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
    labels, count = ndimage.label(standing, structure=np.ones((3, 3)))
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
        found = _rows_over(middles, areas, cells.size, header, least_area, ground)
        if found:
            blocks.append(Block(tuple(found)))
    return blocks


def _rows_over(
    middles: np.ndarray,
    areas: np.ndarray,
    size: float,
    header: float,
    least_area: float,
    ground: BaseGeometry,
) -> list[Pass]:
    box = shapely.MultiPoint(middles).buffer(size / 2, cap_style="square").minimum_rotated_rectangle
    corners = np.array(shapely.get_coordinates(box))
    sides = np.diff(corners[:3], axis=0)
    along = sides[np.argmax(np.hypot(*sides.T))]
    along = along / np.hypot(*along)
    across = np.array([-along[1], along[0]])
    u, v = (middles - corners[0]) @ along, (middles - corners[0]) @ across
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
        line = shapely.LineString(corners[0] + span[:, None] * along + aside * across)
        inside = line.intersection(ground)
        parts = [part for part in shapely.get_parts(inside).tolist() if part.length > 0]
        if parts:
            longest = max(parts, key=lambda part: part.length)
            found.append(Pass(np.array(longest.coords), float(areas[row].sum())))
    return found
