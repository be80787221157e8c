"""The places where an evader can be, as a grid of cells with one place each."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import shapely

from ...compiled import kernel
from ...errors import require
from ...geometry.edge_index import EdgeIndex, build_edge_index
from ...geometry.world import World


class PlaceGrid(NamedTuple):
    """A grid over the regions in which evaders' centres can be.

    Attributes:
        edges: Of the regions.
        corner: Lower left corner of the grid, shape (2,) [m].
        cell: Side of a cell [m].
        columns, rows: Size of the grid.
        places: A place of each cell where an evader can be: its middle, or the nearest one to
            that; shape (columns * rows, 2) [m], NaN where the cell has none.
        usable: Whether the cell has a place, shape (columns * rows,).
    """

    edges: EdgeIndex
    corner: np.ndarray
    cell: float
    columns: int
    rows: int
    places: np.ndarray
    usable: np.ndarray

    @property
    def area(self) -> float:
        """Of a cell [m^2]."""
        return self.cell**2


def make_place_grid(regions: Sequence[World], cells: int = 10_000) -> PlaceGrid:
    """Cover regions with square cells.

    Args:
        regions: Where evaders' centres can be.
        cells: Number of cells, about; the memory of all sets of places grows with it.

    Raises:
        InvalidInput: There are fewer than 100 cells.
    """
    require(cells >= 100, "cells", "be at least 100", cells)
    free = shapely.union_all([region.polygon for region in regions])
    west, south, east, north = free.bounds
    cell = float(np.sqrt((east - west) * (north - south) / cells))
    columns, rows = (int(np.ceil(length / cell)) for length in (east - west, north - south))
    row, column = np.divmod(np.arange(columns * rows), columns)
    middles = np.stack([west + (column + 0.5) * cell, south + (row + 0.5) * cell], axis=1)
    shapely.prepare(free)
    left, low = west + column * cell, south + row * cell
    boxes = np.asarray(shapely.box(left, low, left + cell, low + cell))
    points = np.asarray(shapely.points(middles))
    inside = shapely.contains(free, points)
    usable = inside | shapely.intersects(free, boxes)
    places = np.where(inside[:, None], middles, np.nan)
    for k in np.flatnonzero(usable & ~inside):
        part = shapely.intersection(free, boxes[k])
        places[k] = shapely.shortest_line(part, points[k]).coords[0]
    corner = np.array([west, south])
    return PlaceGrid(build_edge_index(*regions), corner, cell, columns, rows, places, usable)


@kernel
def cell_at(grid: PlaceGrid, x: float, y: float) -> int:
    """Number of the cell that holds a point, or of the nearest one for a point outside (kernel).

    Args:
        grid: Of places.
        x, y: The point [m].
    """
    column = int(np.floor((x - grid.corner[0]) / grid.cell))
    row = int(np.floor((y - grid.corner[1]) / grid.cell))
    column = min(max(column, 0), grid.columns - 1)
    row = min(max(row, 0), grid.rows - 1)
    return row * grid.columns + column
