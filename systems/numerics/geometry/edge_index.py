"""A uniform grid over a world's edges, so that a query reads only the edges near it.

The tables are plain arrays in a named tuple: Numba kernels take it whole. Each cell knows the
edges that come within a margin of it, and whether one point inside it is free; a point's own
status then follows from the edges of its cell alone.
"""

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ..compiled import compiled, kernel
from ..errors import require, require_type
from .world import World

# Columns of `EdgeIndex.edges`: an edge runs from START to END with free space on its left.
BEFORE, START, END = 0, 2, 4

# Entries of `EdgeIndex.frame`.
X_MIN, Y_MIN, CELL, TOLERANCE, COLUMNS, ROWS = range(6)


class EdgeIndex(NamedTuple):
    """Edges of a world with a grid over them; make one with `build_edge_index`.

    Attributes:
        edges: Shape (n, 6): the vertex before the edge, its start and its end,
            x and y each [m].
        frame: x_min, y_min, cell size, tolerance [m]; columns, rows.
        starts: Where each cell's list begins in `items`, shape (columns * rows + 1,).
        items: Edge numbers, cell by cell, shape (m,).
        probes: One point of each cell and 1 where it is free, else 0; shape (cells, 3) [m, m, -].
    """

    edges: np.ndarray
    frame: np.ndarray
    starts: np.ndarray
    items: np.ndarray
    probes: np.ndarray


def build_edge_index(*worlds: World) -> EdgeIndex:
    """Index the edges of one world, or of several that do not overlap, as one free region.

    Results are cached: the same worlds give the same arrays, which must not be written to.

    The grid has about five cells per edge, the fastest choice between 1 and 16 for segments in
    worlds of 200 edges.

    Raises:
        InvalidInput: No world is given, or an argument is not a world.
    """
    require(len(worlds) > 0, "world", "be given", "none")
    for world in worlds:
        require_type("world", world, World)
    return _index(*worlds)


def index_regions(name: str, regions: Sequence[World]) -> EdgeIndex:
    """Index the edges of all regions of a team; see `build_edge_index`.

    Args:
        name: Name of the parameter, for the error message.
        regions: Worlds in which the team may be.

    Raises:
        InvalidInput: `regions` is a single world, is empty, or contains something else.
    """
    require(not isinstance(regions, World), name, "be a list of worlds", "one World")
    require_type(name, regions, Sequence)
    require(len(regions) > 0, name, "have one world at least", "none")
    for number, world in enumerate(regions):
        require_type(f"{name}[{number}]", world, World)
    return _index(*regions)


# A small cache: the systems of one diagram ask for the same two or three indices repeatedly.
@lru_cache(maxsize=8)
def _index(*worlds: World) -> EdgeIndex:
    rings = [ring for world in worlds for ring in world.rings]
    edges = np.concatenate(
        [np.hstack([np.roll(r, 1, axis=0), r, np.roll(r, -1, axis=0)]) for r in rings]
    )
    low = np.min([world.bounds[:2] for world in worlds], axis=0)
    high = np.max([world.bounds[2:] for world in worlds], axis=0)
    tolerance = max(world.tolerance for world in worlds)
    cell = float(np.sqrt(np.prod(high - low) / (5.0 * len(edges))))
    # Wider than any tolerance, so that an edge touched from the next cell is still found.
    margin = 1e-6 * cell + 4.0 * tolerance
    low = low - 2.0 * margin
    columns, rows = (np.floor((high + 2.0 * margin - low) / cell).astype(int) + 1).tolist()
    frame = np.array([low[0], low[1], cell, tolerance, columns, rows], dtype=float)
    starts, items = _fill_cells(edges, frame, margin)
    probes = _probe_cells(edges, frame, starts, items)
    return EdgeIndex(edges, frame, starts, items, probes)


@kernel
def cell_of(frame: np.ndarray, x: float, y: float) -> int:
    """Number of the cell that holds a point, or -1 outside the grid.

    Args:
        frame: Of an `EdgeIndex`, shape (6,) [m].
        x, y: The point [m].
    """
    i = int(np.floor((x - frame[X_MIN]) / frame[CELL]))
    j = int(np.floor((y - frame[Y_MIN]) / frame[CELL]))
    if i < 0 or j < 0 or i >= frame[COLUMNS] or j >= frame[ROWS]:
        return -1
    return j * int(frame[COLUMNS]) + i


@kernel
def edge_distance(edges: np.ndarray, e: int, x: float, y: float) -> float:
    """Distance from a point to an edge [m].

    Args:
        edges: Of an `EdgeIndex`, shape (n, 6) [m].
        e: Number of the edge.
        x, y: The point [m].
    """
    dx = edges[e, END] - edges[e, START]
    dy = edges[e, END + 1] - edges[e, START + 1]
    px = x - edges[e, START]
    py = y - edges[e, START + 1]
    t = min(1.0, max(0.0, (px * dx + py * dy) / (dx * dx + dy * dy)))
    return np.hypot(px - t * dx, py - t * dy)


@kernel
def point_is_free(index: EdgeIndex, x: float, y: float) -> bool:
    """Whether a point is in the closed free region, the tolerance included.

    Args:
        index: The world's edges.
        x, y: The point [m].
    """
    edges, frame, starts, items, probes = index
    cell = cell_of(frame, x, y)
    if cell < 0:
        return False
    tolerance = frame[TOLERANCE]
    free = probes[cell, 2] > 0.5
    for k in range(starts[cell], starts[cell + 1]):
        e = items[k]
        if (
            min(edges[e, START], edges[e, END]) <= x + tolerance
            and max(edges[e, START], edges[e, END]) >= x - tolerance
            and min(edges[e, START + 1], edges[e, END + 1]) <= y + tolerance
            and max(edges[e, START + 1], edges[e, END + 1]) >= y - tolerance
            and edge_distance(edges, e, x, y) <= tolerance
        ):
            return True
        if _separates(edges, e, x, y, probes[cell, 0], probes[cell, 1]):
            free = not free
    return free


@kernel
def _separates(edges: np.ndarray, e: int, ax: float, ay: float, bx: float, by: float) -> bool:
    """Whether an edge crosses the segment a-b, with each vertex assigned to one side only."""
    cx, cy, dx, dy = edges[e, START], edges[e, START + 1], edges[e, END], edges[e, END + 1]
    side_c = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax) >= 0.0
    side_d = (bx - ax) * (dy - ay) - (by - ay) * (dx - ax) >= 0.0
    if side_c == side_d:
        return False
    side_a = (dx - cx) * (ay - cy) - (dy - cy) * (ax - cx) >= 0.0
    side_b = (dx - cx) * (by - cy) - (dy - cy) * (bx - cx) >= 0.0
    return side_a != side_b


@kernel
def _near_cell(edges: np.ndarray, e: int, x: float, y: float, half: float) -> bool:
    """Whether an edge comes into the square of half-width `half` around a point."""
    cx, cy = edges[e, START] - x, edges[e, START + 1] - y
    dx, dy = edges[e, END] - x, edges[e, END + 1] - y
    if min(cx, dx) > half or max(cx, dx) < -half or min(cy, dy) > half or max(cy, dy) < -half:
        return False
    # Separating axis along the edge's normal.
    nx, ny = cy - dy, dx - cx
    return abs(cx * nx + cy * ny) <= half * (abs(nx) + abs(ny))


@compiled
def _fill_cells(
    edges: np.ndarray, frame: np.ndarray, margin: float
) -> tuple[np.ndarray, np.ndarray]:
    """Count, then list, the edges near each cell."""
    cell, columns, rows = frame[CELL], int(frame[COLUMNS]), int(frame[ROWS])
    half = 0.5 * cell + margin
    starts = np.zeros(columns * rows + 1, dtype=np.uint32)
    items = np.zeros(0, dtype=np.uint32)
    fill = starts[:-1].copy()
    for listing in range(2):
        if listing:
            starts = np.cumsum(starts).astype(np.uint32)
            items = np.zeros(starts[-1], dtype=np.uint32)
            fill = starts[:-1].copy()
        for e in range(len(edges)):
            x_low = min(edges[e, START], edges[e, END]) - margin - frame[X_MIN]
            x_high = max(edges[e, START], edges[e, END]) + margin - frame[X_MIN]
            y_low = min(edges[e, START + 1], edges[e, END + 1]) - margin - frame[Y_MIN]
            y_high = max(edges[e, START + 1], edges[e, END + 1]) + margin - frame[Y_MIN]
            for j in range(max(0, int(y_low / cell)), min(rows, int(y_high / cell) + 1)):
                for i in range(max(0, int(x_low / cell)), min(columns, int(x_high / cell) + 1)):
                    x = frame[X_MIN] + (i + 0.5) * cell
                    y = frame[Y_MIN] + (j + 0.5) * cell
                    if not _near_cell(edges, e, x, y, half):
                        continue
                    if listing:
                        items[fill[j * columns + i]] = e
                        fill[j * columns + i] += 1
                    else:
                        starts[j * columns + i + 1] += 1
    return starts, items


@compiled
def _probe_cells(
    edges: np.ndarray, frame: np.ndarray, starts: np.ndarray, items: np.ndarray
) -> np.ndarray:
    """Choose in each cell the point farthest from its edges, among a few, and classify it."""
    columns, rows = int(frame[COLUMNS]), int(frame[ROWS])
    probes = np.zeros((columns * rows, 3))
    for j in range(rows):
        for i in range(columns):
            cell = j * columns + i
            best = -1.0
            for candidate in range(9):
                x = frame[X_MIN] + (i + 0.23 + 0.27 * (candidate % 3)) * frame[CELL]
                y = frame[Y_MIN] + (j + 0.23 + 0.27 * (candidate // 3)) * frame[CELL]
                nearest = np.inf
                for k in range(starts[cell], starts[cell + 1]):
                    nearest = min(nearest, edge_distance(edges, items[k], x, y))
                if nearest > best:
                    best = nearest
                    probes[cell, 0], probes[cell, 1] = x, y
            crossings = 0
            for e in range(len(edges)):
                # Crossings of a ray to the right, with each vertex assigned to one side only.
                y = probes[cell, 1]
                if (edges[e, START + 1] > y) == (edges[e, END + 1] > y):
                    continue
                t = (y - edges[e, START + 1]) / (edges[e, END + 1] - edges[e, START + 1])
                if edges[e, START] + t * (edges[e, END] - edges[e, START]) > probes[cell, 0]:
                    crossings += 1
            probes[cell, 2] = crossings % 2
    return probes


@compiled
def clearances(index: EdgeIndex, points: np.ndarray) -> np.ndarray:
    """Distance from each point to the nearest edge, shape (n, 2) [m] -> (n,) [m]."""
    edges = index.edges
    distances = np.full(len(points), np.inf)
    for i in range(len(points)):
        for e in range(len(edges)):
            distances[i] = min(distances[i], edge_distance(edges, e, points[i, 0], points[i, 1]))
    return distances
