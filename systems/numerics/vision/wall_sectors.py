"""Which walls can be met in which direction: lists of edges by sectors of bearing."""

import math

import numpy as np

from ..compiled import compiled


@compiled
def edges_by_sector(edges: np.ndarray, sectors: int) -> tuple[np.ndarray, np.ndarray]:
    """List the edges that each sector of bearing may meet.

    An edge is in every sector that it crosses, and in one more on either side for rounding; so
    looking in one sector only loses nothing.

    Args:
        edges: x0, y0, x1, y1 seen from the camera, shape (k, 4) [m].
        sectors: Number of equal sectors, from bearing -pi on.

    Returns:
        Starts of the sectors' lists, shape (sectors + 1,), and the lists, numbers of edges.
    """
    first = np.empty(len(edges), dtype=np.int64)
    count = np.empty(len(edges), dtype=np.int64)
    starts = np.zeros(sectors + 1, dtype=np.int64)
    scale = sectors / (2 * math.pi)
    for k in range(len(edges)):
        ax, ay, bx, by = edges[k, 0], edges[k, 1], edges[k, 2], edges[k, 3]
        turn = math.atan2(ax * by - ay * bx, ax * bx + ay * by)
        low = math.atan2(ay, ax) + min(turn, 0.0)
        if abs(turn) > math.pi - 1e-6:
            # The camera is on the edge, to rounding: any direction may meet it.
            first[k], count[k] = 0, sectors
        else:
            begin = math.floor((low + math.pi) * scale) - 1
            end = math.floor((low + abs(turn) + math.pi) * scale) + 1
            first[k], count[k] = begin, min(end - begin + 1, sectors)
        for step in range(count[k]):
            starts[(first[k] + step) % sectors + 1] += 1
    for sector in range(sectors):
        starts[sector + 1] += starts[sector]
    lists = np.empty(starts[-1], dtype=np.int64)
    filled = starts[:-1].copy()
    for k in range(len(edges)):
        for step in range(count[k]):
            sector = (first[k] + step) % sectors
            lists[filled[sector]] = k
            filled[sector] += 1
    return starts, lists
