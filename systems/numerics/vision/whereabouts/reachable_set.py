"""Where an evader may be: places that it can have reached, and that no camera has seen empty.

Places are cells of a grid. The set is kept as times of arrival. T(c) is the earliest time at which
the evader can be at the place of cell c, and the set at time t is all c with T(c) <= t. Each cell
remembers from where and when it is reached in a straight line, so that distances are Euclidean
along clear segments and turn only at walls (as in any-angle path planning: Daniel, Nash, Koenig
and Felner, Theta*, JAIR 39, 2010). A look at time t that finds nothing empties the cells that it
saw whole; those are reached again from what is left of the set, at t at the earliest. Looks only
take away: no time ever decreases.

Source: ours; the set of a visibility-based search is the contaminated region of Guibas, Latombe,
LaValle, Lin and Motwani, IJCGA 9, 1999, here with a bound on the evader's speed.
"""

import heapq
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import shapely

from ...compiled import compiled, kernel
from ...errors import require
from ...geometry.edge_index import EdgeIndex, index_regions, point_is_free
from ...geometry.segment_sight import segment_is_clear
from ...geometry.visibility_polygon import cast_ray
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
    return PlaceGrid(index_regions("regions", regions), corner, cell, columns, rows, places, usable)


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


# Bearings at which a view's depth is known.
RAYS = 1024


@compiled
def view_depths(index: EdgeIndex, x: float, y: float, bodies: np.ndarray) -> np.ndarray:
    """How far a camera sees at each of RAYS bearings, from -pi on in equal steps.

    Args:
        index: Edges of the world's walls.
        x, y: The camera [m].
        bodies: x, y and radius of what stands in the way, shape (m, 3) [m].

    Returns:
        Distances to walls and bodies, shape (RAYS,) [m]; zero from inside a wall.
    """
    depths = np.zeros(RAYS)
    if not point_is_free(index, x, y):
        return depths
    for k in range(RAYS):
        bearing = -np.pi + 2 * np.pi * k / RAYS
        right, left = cast_ray(index, x, y, np.cos(bearing), np.sin(bearing))
        depths[k] = min(right, left)
    for m in range(len(bodies)):
        dx, dy, radius = bodies[m, 0] - x, bodies[m, 1] - y, bodies[m, 2]
        away = np.hypot(dx, dy)
        if away <= radius:
            continue
        half = np.arcsin(radius / away)
        middle = np.arctan2(dy, dx)
        first = int(np.floor((middle - half + np.pi) / (2 * np.pi) * RAYS))
        last = int(np.ceil((middle + half + np.pi) / (2 * np.pi) * RAYS))
        for k in range(first, last + 1):
            depths[k % RAYS] = min(depths[k % RAYS], away - radius)
    return depths


@compiled
def see_places(
    grid: PlaceGrid,
    depths: np.ndarray,
    x: float,
    y: float,
    radius: float,
    nearest: float,
    farthest: float,
) -> np.ndarray:
    """Which cells a camera sees whole, with all of a shell that stands anywhere in them.

    Args:
        grid: Of places.
        depths: Of `view_depths`, shape (RAYS,) [m].
        x, y: The camera [m].
        radius: Of the shell [m].
        nearest, farthest: Distances between which the camera finds shells for certain [m].

    Returns:
        Shape (cells,), bool.
    """
    seen = np.zeros(len(grid.usable), dtype=np.bool_)
    # A cell's corners are this far from its place, which may be at its side.
    reach = 1.4143 * grid.cell
    wide = radius + reach
    for c in range(len(seen)):
        if not grid.usable[c]:
            continue
        dx, dy = grid.places[c, 0] - x, grid.places[c, 1] - y
        away = np.hypot(dx, dy)
        if not (nearest + reach <= away <= farthest - reach) or away <= wide:
            continue
        half, middle = np.arcsin(wide / away), np.arctan2(dy, dx)
        first = int(np.floor((middle - half + np.pi) / (2 * np.pi) * RAYS))
        last = int(np.ceil((middle + half + np.pi) / (2 * np.pi) * RAYS))
        clear = True
        for k in range(first, last + 1):
            if depths[k % RAYS] < away:
                clear = False
                break
        seen[c] = clear
    return seen


# Rows of a set: place and time from which a cell is reached, and when.
FROM_X, FROM_Y, FROM_TIME, ARRIVAL = range(4)
# Half a cell's diagonal in sides: how far from its place a cell reaches.
_HALF_DIAGONAL = 0.7071
# Arrivals closer than this are one [s].
_SAME = 1e-9


def empty_set(grid: PlaceGrid) -> np.ndarray:
    """A set without a place, shape (4, cells): x and y [m], time and arrival [s]."""
    reach = np.full((4, len(grid.usable)), np.inf)
    reach[:2] = 0.0
    return reach


def fill_everywhere(grid: PlaceGrid, reach: np.ndarray, speed: float, time: float) -> None:
    """Let the evader be anywhere.

    Args:
        grid: Of places.
        reach: The set, shape (4, cells); overwritten.
        speed: Of the evader, at most [m/s].
        time: Since when [s].
    """
    reach[FROM_X:FROM_TIME] = np.nan_to_num(grid.places.T)
    # Anywhere in a cell, not only at its place.
    reach[FROM_TIME] = np.where(grid.usable, time - 2 * _HALF_DIAGONAL * grid.cell / speed, np.inf)
    reach[ARRIVAL] = np.where(grid.usable, time, np.inf)


def members(reach: np.ndarray, time: float) -> np.ndarray:
    """Which cells are in the set, shape (cells,), bool.

    Args:
        reach: The set, shape (4, cells).
        time: [s].
    """
    return reach[ARRIVAL] <= time


@compiled
def fill_disc(
    grid: PlaceGrid,
    reach: np.ndarray,
    x: float,
    y: float,
    radius: float,
    speed: float,
    time: float,
    until: float,
) -> np.ndarray:
    """Let the evader be within a distance of a point, along free ways.

    The cell that holds the point is in the set, however small the distance.

    Args:
        grid: Of places.
        reach: The set, shape (4, cells); overwritten.
        x, y: The point [m].
        radius: The distance [m].
        speed: Of the evader, at most [m/s].
        time: [s].
        until: Until when arrivals are worked out [s].

    Returns:
        The disc for `grow`, about the nearest place to the point if that is in a wall, shape (3,).
    """
    reach[FROM_X:FROM_TIME] = 0.0
    reach[FROM_TIME:] = np.inf
    home = cell_at(grid, x, y)
    if not grid.usable[home]:
        nearest = np.inf
        for c in range(len(grid.usable)):
            if grid.usable[c]:
                away = np.hypot(grid.places[c, 0] - x, grid.places[c, 1] - y)
                if away < nearest:
                    nearest, home = away, c
    hx, hy = grid.places[home, 0], grid.places[home, 1]
    if not segment_is_clear(grid.edges, x, y, hx, hy):
        x, y = hx, hy
    away = np.hypot(hx - x, hy - y)
    reach[FROM_X, home], reach[FROM_Y, home] = x, y
    reach[FROM_TIME, home] = time - radius / speed
    reach[ARRIVAL, home] = min(time, time + (away - radius) / speed)
    nothing = np.zeros(len(grid.usable), dtype=np.bool_)
    disc = np.array([x, y, time - radius / speed])
    grow(grid, reach, np.empty((4, 0)), nothing, disc, speed, time, until)
    return disc


@compiled
def grow(
    grid: PlaceGrid,
    reach: np.ndarray,
    before: np.ndarray,
    seen: np.ndarray,
    disc: np.ndarray,
    speed: float,
    time: float,
    until: float,
) -> None:
    """Work out times of arrival as far as they matter (Dijkstra's algorithm).

    Args:
        grid: Of places.
        reach: The set, shape (4, cells); arrivals up to `until` become right.
        before: The set before a look, whose times no time may undercut, shape (4, cells), or
            (4, 0) without a look.
        seen: Cells that the look saw, shape (cells,).
        disc: Where and when the evader was known to be, x, y [m] and time [s], shape (3,): no
            arrival is earlier than straight from there. A time of minus infinity says nothing.
        speed: Of the evader, at most [m/s].
        time: Of the look, or now [s].
        until: [s].
    """
    looked = before.shape[1] > 0
    heap = [(0.0, 0)]
    heap.pop()
    slack = _HALF_DIAGONAL * grid.cell
    for c in range(len(grid.usable)):
        if reach[ARRIVAL, c] > until:
            continue
        fresh = reach[ARRIVAL, c] > time
        row, column = c // grid.columns, c % grid.columns
        for i in range(max(row - 1, 0), min(row + 2, grid.rows)):
            for j in range(max(column - 1, 0), min(column + 2, grid.columns)):
                n = i * grid.columns + j
                fresh |= grid.usable[n] and np.isinf(reach[ARRIVAL, n])
        if fresh:
            heapq.heappush(heap, (reach[ARRIVAL, c], c))
    while len(heap) > 0:
        arrival, c = heapq.heappop(heap)
        if arrival > until:
            break
        if arrival > reach[ARRIVAL, c]:
            continue
        cx, cy = grid.places[c, 0], grid.places[c, 1]
        row, column = c // grid.columns, c % grid.columns
        for i in range(max(row - 1, 0), min(row + 2, grid.rows)):
            for j in range(max(column - 1, 0), min(column + 2, grid.columns)):
                n = i * grid.columns + j
                if n == c or not grid.usable[n] or reach[ARRIVAL, n] <= arrival:
                    continue
                nx, ny = grid.places[n, 0], grid.places[n, 1]
                step = np.hypot(nx - cx, ny - cy)
                # Straight on from where this cell was reached; else round a corner that is here.
                px, py, start = reach[FROM_X, c], reach[FROM_Y, c], reach[FROM_TIME, c]
                if looked and seen[n] and arrival <= time:
                    # It cannot have been there, but just beside it, anywhere in this cell.
                    px, py, start = cx, cy, time - min(slack, 0.9 * step) / speed
                elif start + np.hypot(nx - px, ny - py) / speed < arrival:
                    # Nearer to where this cell was reached from, and yet not reached from there.
                    px, py, start = cx, cy, arrival
                earliest = disc[2] + np.hypot(nx - disc[0], ny - disc[1]) / speed
                if looked and before[ARRIVAL, n] < np.inf:
                    earliest = max(earliest, before[ARRIVAL, n])
                reached = max(start + np.hypot(nx - px, ny - py) / speed, earliest)
                if reached >= reach[ARRIVAL, n] - _SAME:
                    continue
                if not segment_is_clear(grid.edges, px, py, nx, ny):
                    if (px == cx and py == cy) or not segment_is_clear(grid.edges, cx, cy, nx, ny):
                        continue
                    px, py, start = cx, cy, arrival
                    reached = max(start + step / speed, earliest)
                    if reached >= reach[ARRIVAL, n] - _SAME:
                        continue
                reach[FROM_X, n], reach[FROM_Y, n] = px, py
                reach[FROM_TIME, n] = reached - np.hypot(nx - px, ny - py) / speed
                reach[ARRIVAL, n] = reached
                heapq.heappush(heap, (reach[ARRIVAL, n], n))


@compiled
def look_and_see_nothing(
    grid: PlaceGrid,
    reach: np.ndarray,
    seen: np.ndarray,
    disc: np.ndarray,
    speed: float,
    time: float,
    until: float,
) -> bool:
    """Take away what a camera has seen to be empty.

    Args:
        grid: Of places.
        reach: The set, shape (4, cells); overwritten.
        seen: Cells that were seen whole, shape (cells,).
        disc: As of `grow`, shape (3,).
        speed: Of the evader, at most [m/s].
        time: Of the look [s].
        until: Until when arrivals are worked out [s].

    Returns:
        Whether a place is left. If none is, the set stays as it was.
    """
    left = False
    for c in range(len(seen)):
        left |= reach[ARRIVAL, c] <= time and not seen[c]
    if not left:
        return False
    before = reach.copy()
    for c in range(len(seen)):
        if reach[ARRIVAL, c] > time or seen[c]:
            reach[FROM_TIME, c], reach[ARRIVAL, c] = np.inf, np.inf
            if before[ARRIVAL, c] <= time:
                before[ARRIVAL, c] = np.inf
    grow(grid, reach, before, seen, disc, speed, time, until)
    return True


@compiled
def may_be_at(
    grid: PlaceGrid, reach: np.ndarray, speed: float, time: float, x: float, y: float
) -> bool:
    """Whether the set holds a point, to finer than a cell.

    Args:
        grid: Of places.
        reach: The set, shape (4, cells).
        speed: Of the evader, at most [m/s].
        time: [s].
        x, y: The point [m].
    """
    c = cell_at(grid, x, y)
    row, column = c // grid.columns, c % grid.columns
    for i in range(max(row - 1, 0), min(row + 2, grid.rows)):
        for j in range(max(column - 1, 0), min(column + 2, grid.columns)):
            n = i * grid.columns + j
            if np.isinf(reach[ARRIVAL, n]):
                continue
            px, py = reach[FROM_X, n], reach[FROM_Y, n]
            away = np.hypot(x - px, y - py)
            if reach[FROM_TIME, n] + away / speed > time:
                continue
            # A point just inside a wall, by rounding, counts too.
            if away < grid.cell or segment_is_clear(grid.edges, px, py, x, y):
                return True
    return False
