"""How far it is round standing crop: distances over cut ground, on a coarse raster."""

import heapq

import numpy as np

from ...compiled import compiled
from .ground import BARRED, FREE, station_at

# Cells of the raster in a row that make one coarse cell.
COARSE = 3
# Crop that is gone so soon counts as gone [s].
SOON = 20.0


@compiled
def coarse_ground(ground, traffic):
    """Coarse cells all of which may be driven on, now or soon; shape (rows, columns)."""
    rows, columns = ground.code.shape
    free = np.ones((rows // COARSE + 1, columns // COARSE + 1), dtype=np.bool_)
    reached = np.empty(len(traffic.progress))
    for n in range(len(reached)):
        reached[n] = station_at(traffic, n, traffic.time + SOON)
    for j in range(rows):
        for i in range(columns):
            code = ground.code[j, i]
            if code == BARRED or (code != FREE and ground.cut_at[j, i] > reached[code]):
                free[j // COARSE, i // COARSE] = False
    return free


@compiled
def distances_to(free, side, corner, goals):
    """Ways over free coarse cells to the nearest of some goals.

    Args:
        free: Shape (rows, columns).
        side: Of a coarse cell [m].
        corner: Lower left corner of the raster, shape (2,) [m].
        goals: x, y, shape (m, 2) [m].

    Returns:
        Infinite where there is no way, shape (rows, columns) [m].
    """
    rows, columns = free.shape
    away = np.full((rows, columns), np.inf)
    queue = [(0.0, 0, 0)]
    queue.pop()
    for k in range(len(goals)):
        i = int((goals[k, 0] - corner[0]) / side)
        j = int((goals[k, 1] - corner[1]) / side)
        if 0 <= i < columns and 0 <= j < rows and away[j, i] > 0.0:
            away[j, i] = 0.0
            heapq.heappush(queue, (0.0, j, i))
    while queue:
        far, j, i = heapq.heappop(queue)
        if far > away[j, i]:
            continue
        for dj in range(-1, 2):
            for di in range(-1, 2):
                b, a = j + dj, i + di
                if b < 0 or a < 0 or b >= rows or a >= columns or not free[b, a]:
                    continue
                further = far + side * np.sqrt(float(di * di + dj * dj))
                if further < away[b, a]:
                    away[b, a] = further
                    heapq.heappush(queue, (further, b, a))
    return away
