"""Borders of ground, on a raster of distances and in buckets, and the crop that still stands.

The raster shows at once where a machine is well clear of a border; where it is not, its outline is
compared with the edges themselves, which are sorted into buckets.

Standing crop is a raster as well: what is cut is marked as the harvest goes on.
"""

import math
from typing import NamedTuple

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ...compiled import compiled, kernel
from ..raster import cells_inside

# Spacing of the raster's nodes, and side of the buckets [m].
CELL = 0.5
BUCKET = 4.0

# Distances are cut off at this value [m].
FARTHEST = 12.0

# Largest error of distances between nodes: they change by no more than the place does [m].
RASTER_ERROR = CELL * math.sqrt(0.5)

# Edges are cut into pieces no longer than this, for which the raster round them is small [m].
_PIECE = 20.0

# Side of the cells of standing crop [m].
CROP_CELL = 0.5


class Borders(NamedTuple):
    """Where ground ends; make one with `make_borders`.

    Attributes:
        distances: To the next edge, positive on the ground, negative off it, at most FARTHEST;
            shape (rows, columns) [m].
        origin: x, y of the first node, shape (2,) [m].
        edges: Their ends, shape (n, 4) [m].
        starts: Where each bucket's list begins in `items`, row by row, shape (buckets + 1,).
        items: Numbers of the edges that come into each bucket, shape (m,).
    """

    distances: np.ndarray
    origin: np.ndarray
    edges: np.ndarray
    starts: np.ndarray
    items: np.ndarray


def edges_of(region: BaseGeometry) -> np.ndarray:
    """All edges of polygons, cut where they are long, shape (n, 4) [m]."""
    rings = shapely.get_rings(shapely.get_parts(shapely.normalize(region)))
    found = [np.zeros((0, 4))]
    for ring in rings:
        points = shapely.get_coordinates(shapely.segmentize(ring, _PIECE))
        found.append(np.hstack([points[:-1], points[1:]]))
    return np.ascontiguousarray(np.concatenate(found))


def make_borders(region: BaseGeometry) -> Borders:
    """Borders of polygons, which must not be empty; errors are at most RASTER_ERROR."""
    x_min, y_min, x_max, y_max = region.bounds
    edges = edges_of(region)
    columns, rows = (math.ceil(way / CELL) + 3 for way in (x_max - x_min, y_max - y_min))
    origin = np.array([x_min - CELL, y_min - CELL])
    distances = np.full((rows, columns), FARTHEST, dtype=np.float32)
    _brush(distances, origin, edges)
    # Nodes are the middles of cells round them.
    outside = ~cells_inside(region, origin - CELL / 2, CELL, distances.shape)
    np.negative(distances, out=distances, where=outside)
    return Borders(distances, origin, edges, *_fill_buckets(origin, distances.shape, edges))


@compiled
def _brush(distances, origin, edges):
    """Lower the distances of nodes near each edge to their distance to that edge."""
    rows, columns = distances.shape
    for k in range(len(edges)):
        ax, ay, bx, by = edges[k]
        dx, dy = bx - ax, by - ay
        square = dx * dx + dy * dy
        low_i = max(0, int((min(ax, bx) - FARTHEST - origin[0]) / CELL))
        high_i = min(columns - 1, int((max(ax, bx) + FARTHEST - origin[0]) / CELL) + 1)
        low_j = max(0, int((min(ay, by) - FARTHEST - origin[1]) / CELL))
        high_j = min(rows - 1, int((max(ay, by) + FARTHEST - origin[1]) / CELL) + 1)
        for j in range(low_j, high_j + 1):
            py = origin[1] + j * CELL - ay
            for i in range(low_i, high_i + 1):
                px = origin[0] + i * CELL - ax
                share = (px * dx + py * dy) / square if square > 0 else 0.0
                share = min(max(share, 0.0), 1.0)
                away = math.hypot(px - share * dx, py - share * dy)
                if away < distances[j, i]:
                    distances[j, i] = away


@compiled
def _fill_buckets(origin, shape, edges):
    columns = int(shape[1] * CELL / BUCKET) + 1
    rows = int(shape[0] * CELL / BUCKET) + 1
    starts = np.zeros(columns * rows + 1, dtype=np.int64)
    items = np.zeros(0, dtype=np.int64)
    # First how many there are in each bucket, then which.
    for filling in (False, True):
        places = starts.copy()
        for k in range(len(edges)):
            ax, ay, bx, by = edges[k]
            low_i = min(max(int((min(ax, bx) - origin[0]) / BUCKET), 0), columns - 1)
            high_i = min(max(int((max(ax, bx) - origin[0]) / BUCKET), 0), columns - 1)
            low_j = min(max(int((min(ay, by) - origin[1]) / BUCKET), 0), rows - 1)
            high_j = min(max(int((max(ay, by) - origin[1]) / BUCKET), 0), rows - 1)
            for j in range(low_j, high_j + 1):
                for i in range(low_i, high_i + 1):
                    if filling:
                        items[places[j * columns + i]] = k
                        places[j * columns + i] += 1
                    else:
                        starts[j * columns + i + 1] += 1
        if not filling:
            starts = np.cumsum(starts)
            items = np.zeros(starts[-1], dtype=np.int64)
    return starts, items


@kernel
def border_distance(borders, x, y):
    """Distance to the border, bilinear between nodes, -FARTHEST off the raster [m].

    Args:
        borders: From `make_borders`.
        x, y: Where [m].
    """
    u, v = (x - borders.origin[0]) / CELL, (y - borders.origin[1]) / CELL
    i, j = math.floor(u), math.floor(v)
    rows, columns = borders.distances.shape
    if i < 0 or j < 0 or i >= columns - 1 or j >= rows - 1:
        return -FARTHEST
    u, v = u - i, v - j
    below = (1 - u) * borders.distances[j, i] + u * borders.distances[j, i + 1]
    above = (1 - u) * borders.distances[j + 1, i] + u * borders.distances[j + 1, i + 1]
    return (1 - v) * below + v * above


@kernel
def cuts_edge(borders, corners, count, touch):
    """Whether an edge comes deeper than a touch into a convex polygon.

    Args:
        borders: From `make_borders`.
        corners: Counterclockwise, shape (at least count, 2) [m].
        count: How many there are.
        touch: How deep is allowed [m].
    """
    low_x = high_x = corners[0, 0]
    low_y = high_y = corners[0, 1]
    for k in range(1, count):
        low_x, high_x = min(low_x, corners[k, 0]), max(high_x, corners[k, 0])
        low_y, high_y = min(low_y, corners[k, 1]), max(high_y, corners[k, 1])
    rows, columns = borders.distances.shape
    columns = int(columns * CELL / BUCKET) + 1
    rows = int(rows * CELL / BUCKET) + 1
    low_i = min(max(int((low_x - borders.origin[0]) / BUCKET), 0), columns - 1)
    high_i = min(max(int((high_x - borders.origin[0]) / BUCKET), 0), columns - 1)
    low_j = min(max(int((low_y - borders.origin[1]) / BUCKET), 0), rows - 1)
    high_j = min(max(int((high_y - borders.origin[1]) / BUCKET), 0), rows - 1)
    for j in range(low_j, high_j + 1):
        for i in range(low_i, high_i + 1):
            bucket = j * columns + i
            for item in range(borders.starts[bucket], borders.starts[bucket + 1]):
                if _cuts(borders.edges, borders.items[item], corners, count, touch):
                    return True
    return False


@kernel
def _cuts(edges, number, corners, count, touch):
    """Whether a part of an edge is deeper than a touch in a convex polygon."""
    ax, ay = edges[number, 0], edges[number, 1]
    dx, dy = edges[number, 2] - ax, edges[number, 3] - ay
    low, high = 0.0, 1.0
    for k in range(count):
        following = k + 1 if k + 1 < count else 0
        ex, ey = corners[following, 0] - corners[k, 0], corners[following, 1] - corners[k, 1]
        size = math.hypot(ex, ey)
        if size < 1e-9:
            continue
        nx, ny = -ey / size, ex / size
        depth = (ax - corners[k, 0]) * nx + (ay - corners[k, 1]) * ny - touch
        slope = dx * nx + dy * ny
        if slope == 0.0:
            if depth <= 0.0:
                return False
        elif slope > 0.0:
            low = max(low, -depth / slope)
        else:
            high = min(high, -depth / slope)
        if low >= high:
            return False
    return True


class StandingCrop:
    """Where crop stands that a body must not roll over.

    A cell counts by its middle, so that edges are off by at most half a cell's diagonal.

    Attributes:
        origin: x, y of the corner of the first cell [m].
        cells: Whether crop stands in each, shape (rows, columns).
    """

    def __init__(self, region: BaseGeometry) -> None:
        """Crop stands on all of some polygons; none may be empty.

        Args:
            region: The polygons [m].
        """
        x_min, y_min, x_max, y_max = region.bounds
        self.origin = np.array([x_min, y_min])
        rows, columns = (math.ceil(way / CROP_CELL) + 1 for way in (y_max - y_min, x_max - x_min))
        self.cells = cells_inside(region, self.origin, CROP_CELL, (rows, columns))

    def mark(self, region: BaseGeometry, *, stands: bool) -> None:
        """Mark where crop stands again, or has been cut.

        Args:
            region: Polygons that do not overlap each other, within the first ones.
            stands: Whether it stands there.
        """
        self.cells[cells_inside(region, self.origin, CROP_CELL, self.cells.shape)] = stands

    def copy(self) -> "StandingCrop":
        """A copy, in which to try what might be cut."""
        other = object.__new__(StandingCrop)
        other.origin, other.cells = self.origin, self.cells.copy()
        return other

    @property
    def area(self) -> float:
        """What stands [m^2]."""
        return float(np.count_nonzero(self.cells)) * CROP_CELL**2
