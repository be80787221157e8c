"""Evader nodes that may be seen from near each node of a pursuer, as runs along rows.

For the upper bound a node of the pursuer stands for all places within a slack of it, and the evader
is on its node. The evader may be seen from near a pursuer's node if that node is within the slack
of the visibility polygon of the evader's node. So that polygon is rasterised on the pursuer's grid
for each evader node, together with the nodes near its rim. The runs are then sorted by the
pursuer's nodes.

What is seen along a single ray, between obstacles that touch it from either side, does not count.
"""

import numpy as np

from ...compiled import compiled, kernel
from ...geometry.edge_index import EdgeIndex
from ...geometry.visibility_polygon import _visibility_polygon
from .planes import COLUMN, COLUMNS, ROW, ROWS, TILE
from .sight_rows import MOST_CROSSINGS, _see_nodes


@compiled
def see_runs_from_near(
    index: EdgeIndex,
    numbers: np.ndarray,
    pursuer_lattice: tuple,
    lattice: tuple,
    free: np.ndarray,
    slack: float,
    reach: int,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Runs of the evader's nodes that are in sight from somewhere near each node of the pursuer.

    Args:
        index: Edges that block sight.
        numbers: Of the pursuer's nodes, -1 where there is none, shape (rows, columns).
        pursuer_lattice, lattice: The pursuer's grid and the evader's.
        free: Where evaders can be, shape (rows, columns), bool.
        slack: How far a pursuer may be from its node [m].
        reach: Margin of the windows around the runs, on each side [nodes].

    Returns:
        Windows, runs, and where the runs of each node end in them; see `see_runs`.
    """
    x0, y0, h, rows, columns = lattice
    nodes = numbers.max() + 1
    seen = np.zeros(numbers.shape, dtype=np.uint8)
    crossings = np.zeros((numbers.shape[0], MOST_CROSSINGS + 1))
    view = np.array([0, numbers.shape[0] - 1, 0, numbers.shape[1] - 1])
    # Column where the current run of each pursuer node began in the present row, or -1.
    begun = np.full(nodes, -1, dtype=np.int32)
    found = np.empty((1024, 4), dtype=np.int32)
    count = 0
    for j in range(rows):
        for i in range(columns + 1):
            if i < columns and free[j, i]:
                ex, ey = x0 + i * h, y0 + j * h
                polygon = _visibility_polygon(index, ex, ey)
                _see_nodes(index, ex, ey, polygon, pursuer_lattice, crossings, view, seen)
                for k in range(len(polygon)):
                    _see_near_edge(polygon, k, pursuer_lattice, slack * (1.0 + 1e-9), seen)
            else:
                seen[:] = 0
            if count + nodes > len(found):
                more = np.empty((2 * len(found) + nodes, 4), dtype=np.int32)
                more[:count] = found[:count]
                found = more
            count = _begin_and_end(seen, numbers, j, i, begun, found, count)
    return _sort_by_node(found[:count], nodes, reach, rows, columns)


@kernel
def _see_near_edge(polygon, k, lattice, slack, seen):
    """Mark the nodes within a slack of an edge of a polygon."""
    x0, y0, h, rows, columns = lattice
    ax, ay = polygon[k, 0], polygon[k, 1]
    dx, dy = polygon[(k + 1) % len(polygon), 0] - ax, polygon[(k + 1) % len(polygon), 1] - ay
    square = dx * dx + dy * dy
    first = max(0, int(np.ceil((min(ay, ay + dy) - slack - y0) / h)))
    last = min(rows - 1, int(np.floor((max(ay, ay + dy) + slack - y0) / h)))
    for j in range(first, last + 1):
        y = y0 + j * h
        low, high = 0.0, 1.0
        if abs(dy) > slack:
            # The part of the edge within the slack of this row's height.
            a, b = (y - slack - ay) / dy, (y + slack - ay) / dy
            low, high = min(max(min(a, b), 0.0), 1.0), min(max(max(a, b), 0.0), 1.0)
        left = min(ax + low * dx, ax + high * dx) - slack
        right = max(ax + low * dx, ax + high * dx) + slack
        begin = max(0, int(np.ceil((left - x0) / h)))
        for i in range(begin, min(columns, int(np.floor((right - x0) / h)) + 1)):
            if seen[j, i] == 0:
                wx, wy = x0 + i * h - ax, y - ay
                part = (wx * dx + wy * dy) / square if square > 0.0 else 0.0
                part = min(max(part, 0.0), 1.0)
                across = (wx - part * dx) ** 2 + (wy - part * dy) ** 2
                seen[j, i] = across <= slack * slack


@kernel
def _begin_and_end(seen, numbers, j, i, begun, found, count):
    """Begin and end runs of row j at column i; return the total number of ended runs."""
    for row in range(numbers.shape[0]):
        for column in range(numbers.shape[1]):
            p = numbers[row, column]
            if p < 0:
                continue
            if seen[row, column]:
                if begun[p] < 0:
                    begun[p] = i
            elif begun[p] >= 0:
                found[count, 0], found[count, 1] = p, j
                found[count, 2], found[count, 3] = begun[p], i
                begun[p] = -1
                count += 1
    return count


@compiled
def _sort_by_node(found, nodes, reach, rows, columns):
    """Sort runs by pursuer nodes, keeping their order; return windows, runs, and their ends."""
    ends = np.zeros(nodes, dtype=np.int64)
    for k in range(len(found)):
        ends[found[k, 0]] += 1
    ends = np.cumsum(ends)
    filled = np.zeros(nodes, dtype=np.int64)
    filled[1:] = ends[:-1]
    runs = np.empty((len(found), 3), dtype=np.int32)
    low = np.full((nodes, 2), rows + columns)
    high = np.full((nodes, 2), -1)
    for k in range(len(found)):
        p = found[k, 0]
        runs[filled[p]] = found[k, 1:]
        filled[p] += 1
        low[p, 0], high[p, 0] = min(low[p, 0], found[k, 1]), max(high[p, 0], found[k, 1])
        low[p, 1], high[p, 1] = min(low[p, 1], found[k, 2]), max(high[p, 1], found[k, 3] - 1)
    windows = np.zeros((nodes, 5), dtype=np.int64)
    for p in range(nodes):
        if high[p, 0] >= 0:
            windows[p, ROW] = max(low[p, 0] - reach, 0) // TILE
            windows[p, COLUMN] = max(low[p, 1] - reach, 0) // TILE
            windows[p, ROWS] = min(high[p, 0] + reach, rows - 1) // TILE + 1 - windows[p, ROW]
            last = min(high[p, 1] + reach, columns - 1) // TILE
            windows[p, COLUMNS] = last + 1 - windows[p, COLUMN]
    return windows, runs, ends
