"""Distance from points to the nearest wall."""

import numpy as np

from ..compiled import compiled
from .edge_index import EdgeIndex, edge_distance


@compiled
def clearances(index: EdgeIndex, points: np.ndarray) -> np.ndarray:
    """Distance from each point to the nearest edge, shape (n, 2) [m] -> (n,) [m]."""
    edges = index.edges
    distances = np.full(len(points), np.inf)
    for i in range(len(points)):
        for e in range(len(edges)):
            distances[i] = min(distances[i], edge_distance(edges, e, points[i, 0], points[i, 1]))
    return distances
