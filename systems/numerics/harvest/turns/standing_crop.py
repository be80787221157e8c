"""Standing crop on a raster: what is cut is marked as the harvest goes on."""

import math

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ...compiled import compiled
from .borders import edges_of

# Side of the raster's cells [m].
CELL = 0.5


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
        shape = math.ceil((y_max - y_min) / CELL) + 1, math.ceil((x_max - x_min) / CELL) + 1
        self.cells = np.zeros(shape, dtype=np.bool_)
        _mark(self.cells, self.origin, edges_of(region), True)

    def stand(self, region: BaseGeometry) -> None:
        """Mark what stands, again.

        Args:
            region: Polygons within the first ones.
        """
        for part in shapely.get_parts(region):
            _mark(self.cells, self.origin, edges_of(part), True)

    def cut(self, region: BaseGeometry) -> None:
        """Mark what has been cut.

        Args:
            region: Polygons that do not overlap each other; what is cut twice is no fault.
        """
        for part in shapely.get_parts(region):
            _mark(self.cells, self.origin, edges_of(part), False)

    def copy(self) -> "StandingCrop":
        """Another of the same cells, for what might be cut."""
        other = object.__new__(StandingCrop)
        other.origin, other.cells = self.origin, self.cells.copy()
        return other

    @property
    def area(self) -> float:
        """What stands [m^2]."""
        return float(np.count_nonzero(self.cells)) * CELL**2


@compiled
def _mark(cells, origin, edges, value):
    """Set the cells whose middles lie inside; rows are crossed from the left, even and odd."""
    if len(edges) == 0:
        return
    rows, columns = cells.shape
    low_y = min(edges[:, 1].min(), edges[:, 3].min())
    high_y = max(edges[:, 1].max(), edges[:, 3].max())
    low_j = max(0, math.ceil((low_y - origin[1]) / CELL - 0.5))
    high_j = min(rows, math.ceil((high_y - origin[1]) / CELL - 0.5))
    if high_j <= low_j:
        return
    low_x = min(edges[:, 0].min(), edges[:, 2].min())
    high_x = max(edges[:, 0].max(), edges[:, 2].max())
    low_i = min(max(0, math.ceil((low_x - origin[0]) / CELL - 0.5)), columns)
    high_i = min(max(0, math.ceil((high_x - origin[0]) / CELL - 0.5)), columns)
    counts = np.zeros((high_j - low_j, high_i - low_i + 1), dtype=np.int32)
    for k in range(len(edges)):
        ax, ay, bx, by = edges[k]
        if ay > by:
            ax, ay, bx, by = bx, by, ax, ay
        low = max(low_j, math.ceil((ay - origin[1]) / CELL - 0.5))
        # A row through an end belongs to the edge above it alone.
        high = min(high_j, math.ceil((by - origin[1]) / CELL - 0.5))
        for j in range(low, high):
            y = origin[1] + (j + 0.5) * CELL
            x = ax + (bx - ax) * (y - ay) / (by - ay)
            i = min(max(math.ceil((x - origin[0]) / CELL - 0.5), low_i), high_i)
            counts[j - low_j, i - low_i] += 1
    for j in range(low_j, high_j):
        crossed = 0
        for i in range(low_i, high_i):
            crossed += counts[j - low_j, i - low_i]
            if crossed % 2 == 1:
                cells[j, i] = value
