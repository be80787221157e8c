"""Square cells: which of them lie in polygons, and which lie under points of a machine."""

import math

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ..compiled import compiled, kernel


def cells_inside(
    region: BaseGeometry, corner: np.ndarray, side: float, shape: tuple[int, int]
) -> np.ndarray:
    """Whether the middle of each cell is in polygons, shape (rows, columns).

    Each row is scanned from the left by the even-odd rule.

    Args:
        region: Polygons that do not overlap each other.
        corner: x, y of the corner of the first cell, shape (2,) [m].
        side: Side of the cells [m].
        shape: Numbers of rows and columns.
    """
    flips = np.zeros((shape[0], shape[1] + 1), dtype=np.int32)
    for ring in shapely.get_rings(shapely.get_parts(region)):
        _flip(flips, shapely.get_coordinates(ring), corner, side)
    return (np.cumsum(flips, axis=1)[:, :-1] % 2).astype(bool)


@compiled
def _flip(flips, ring, corner, side):
    rows, columns = flips.shape
    for k in range(len(ring) - 1):
        (ax, ay), (bx, by) = ring[k], ring[k + 1]
        if ay > by:
            ax, ay, bx, by = bx, by, ax, ay
        # A row through an end belongs to the edge above it alone.
        first = max(math.ceil((ay - corner[1]) / side - 0.5), 0)
        behind = min(math.ceil((by - corner[1]) / side - 0.5), rows)
        for row in range(first, behind):
            y = corner[1] + (row + 0.5) * side
            x = ax + (bx - ax) * (y - ay) / (by - ay)
            column = math.ceil((x - corner[0]) / side - 0.5)
            flips[row, min(max(column, 0), columns - 1)] += 1


def lattice(rear: float, front: float, half: float, spacing: float) -> np.ndarray:
    """Grid points on a box in the frame of a machine, edges included, shape (n, 2) [m].

    Args:
        rear, front: Ends of the box along the heading [m].
        half: Half of its width [m].
        spacing: Largest distance between neighbouring points [m].
    """
    along, across = math.ceil((front - rear) / spacing), math.ceil(2 * half / spacing)
    ahead = rear + (front - rear) * np.arange(along + 1) / max(along, 1)
    aside = -half + 2 * half * np.arange(across + 1) / max(across, 1)
    return np.stack(np.meshgrid(ahead, aside, indexing="ij"), axis=-1).reshape(-1, 2)


@kernel
def cell_under(corner, side, pose, c, s, point):
    """Row and column of the cell under a point of a machine; they may be off the raster.

    Args:
        corner: x, y of the corner of the first cell, shape (2,) [m].
        side: Side of the cells [m].
        pose: Of the machine, shape (3,) [m], [m], [rad].
        c, s: Cosine and sine of its heading.
        point: The point in its frame, shape (2,) [m].
    """
    x = pose[0] + c * point[0] - s * point[1]
    y = pose[1] + s * point[0] + c * point[1]
    return math.floor((y - corner[1]) / side), math.floor((x - corner[0]) / side)
