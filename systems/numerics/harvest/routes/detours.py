"""How far it is round standing crop: distances over cut ground, on a coarse raster."""

import heapq

import numpy as np

from ...compiled import compiled
from .ground import BARRED, FREE

# Cells of the raster in a row that make one coarse cell.
COARSE = 3


@compiled
def clear_times(ground, traffic):
    """When each coarse cell may be driven on: all its crop is cut; shape (rows, columns) [s].

    Infinite for those that never may.

    Args:
        traffic: The combines.
    """
    rows, columns = ground.code.shape
    clear = np.full((rows // COARSE + 1, columns // COARSE + 1), -np.inf)
    for j in range(rows):
        for i in range(columns):
            code = ground.code[j, i]
            if code == FREE:
                continue
            at = np.inf
            if code != BARRED:
                to_go = ground.cut_at[j, i] - traffic.progress[code]
                at = traffic.time
                if to_go > 0.0:
                    at += traffic.waits[code] + to_go / traffic.speed
            b, a = j // COARSE, i // COARSE
            clear[b, a] = max(clear[b, a], at)
    return clear


@compiled
def arrivals(clear, side, corner, start, time, speed):
    """When one can be in each coarse cell at the earliest, waiting for crop to be cut.

    Args:
        clear: From `clear_times`.
        side: Of a coarse cell [m].
        corner: Lower left corner of the raster, shape (2,) [m].
        start: x, y, shape (2,) [m].
        time: There [s].
        speed: [m/s].

    Returns:
        Infinite where there is no way, shape (rows, columns) [s].
    """
    rows, columns = clear.shape
    at = np.full((rows, columns), np.inf)
    i, j = int((start[0] - corner[0]) / side), int((start[1] - corner[1]) / side)
    i, j = min(max(i, 0), columns - 1), min(max(j, 0), rows - 1)
    at[j, i] = time
    _spread(at, [(time, j, i)], clear, side, speed)
    return at


@compiled
def nearest_arrival(at, side, corner, x, y):
    """When one can be at a point, or in the best coarse cell beside its own [s].

    Args:
        side: Of a coarse cell [m].
        corner: Of the raster, shape (2,) [m].
        x: Of the point [m].
        y: Of the point [m].
    """
    i, j = int((x - corner[0]) / side), int((y - corner[1]) / side)
    if i < 0 or j < 0 or j >= at.shape[0] or i >= at.shape[1]:
        return np.inf
    least = at[j, i]
    if least == np.inf:
        for b in range(max(j - 1, 0), min(j + 2, at.shape[0])):
            for a in range(max(i - 1, 0), min(i + 2, at.shape[1])):
                least = min(least, at[b, a])
    return least


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
    _spread(away, queue, np.where(free, -np.inf, np.inf), side, 1.0)
    return away


@compiled
def _spread(at, queue, clear, side, speed):
    """Carry values on from the cells of a queue to all others, in place (Dijkstra 1959)."""
    rows, columns = clear.shape
    while queue:
        now, j, i = heapq.heappop(queue)
        if now > at[j, i]:
            continue
        for dj in range(-1, 2):
            for di in range(-1, 2):
                b, a = j + dj, i + di
                if b < 0 or a < 0 or b >= rows or a >= columns:
                    continue
                then = max(now + side * np.sqrt(float(di * di + dj * dj)) / speed, clear[b, a])
                if then < at[b, a]:
                    at[b, a] = then
                    heapq.heappush(queue, (then, b, a))
