"""Sight between two sets of points."""

import numpy as np

from ..compiled import compiled
from .edge_index import EdgeIndex
from .segment_sight import segment_is_clear


@compiled
def sight_matrix(index: EdgeIndex, viewers: np.ndarray, targets: np.ndarray) -> np.ndarray:
    """Which target each viewer sees.

    Args:
        index: The world's edges.
        viewers: Shape (2 n,), x and y of each viewer [m].
        targets: Shape (2 m,) [m].

    Returns:
        Shape (n m,), row by row of viewers: 1.0 where the line between the two is clear, else 0.
    """
    n, m = len(viewers) // 2, len(targets) // 2
    seen = np.zeros(n * m)
    for i in range(n):
        x, y = viewers[2 * i], viewers[2 * i + 1]
        for j in range(m):
            seen[i * m + j] = segment_is_clear(index, x, y, targets[2 * j], targets[2 * j + 1])
    return seen
