"""Sight between two sets of points."""

import numpy as np

from ..compiled import compiled
from .body_sight import hide_behind_bodies, require_a_radius_each
from .edge_index import TOLERANCE, EdgeIndex
from .segment_sight import segment_is_clear


def sight_matrix(
    index: EdgeIndex, viewers: np.ndarray, targets: np.ndarray, radii: np.ndarray | None = None
) -> np.ndarray:
    """Which target each viewer sees.

    Args:
        index: The world's edges.
        viewers: Shape (2 n,), x and y of each viewer [m].
        targets: Shape (2 m,) [m].
        radii: Of the bodies that block sight, viewers first, shape (n + m,) [m]; None: none does.

    Returns:
        Shape (n m,), row by row of viewers: 1.0 where the line between the two is clear, else 0.

    Raises:
        InvalidInput: There is not one radius for each robot.
    """
    seen = _sight_matrix(index, viewers, targets)
    if radii is not None:
        require_a_radius_each(radii, viewers, targets)
        hide_behind_bodies(seen, viewers, targets, radii, index.frame[TOLERANCE])
    return seen


@compiled
def _sight_matrix(index: EdgeIndex, viewers: np.ndarray, targets: np.ndarray) -> np.ndarray:
    n, m = len(viewers) // 2, len(targets) // 2
    seen = np.zeros(n * m)
    for i in range(n):
        x, y = viewers[2 * i], viewers[2 * i + 1]
        for j in range(m):
            seen[i * m + j] = segment_is_clear(index, x, y, targets[2 * j], targets[2 * j + 1])
    return seen
