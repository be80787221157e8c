"""Who sees whom, and who sees which corner: sight between two sets of points."""

import math

import numpy as np
from numba import njit

from .edge_index import START, TOLERANCE, EdgeIndex
from .segment_sight import leaves_through_obstacle, segment_is_clear


def sight_matrix(index: EdgeIndex, viewers: np.ndarray, targets: np.ndarray) -> np.ndarray:
    """Which target each viewer sees.

    Args:
        index: The world's edges.
        viewers: Shape (2 n,), x and y of each viewer [m].
        targets: Shape (2 m,) [m].

    Returns:
        Shape (n m,), row by row of viewers: 1.0 where the line between the two is clear, else 0.
    """
    return _sight_matrix(*index, viewers, targets)


# Numba takes the arrays one by one in a fraction of the time that it takes a named tuple.
@njit(cache=True)
def _sight_matrix(
    edges: np.ndarray,
    frame: np.ndarray,
    starts: np.ndarray,
    items: np.ndarray,
    probes: np.ndarray,
    viewers: np.ndarray,
    targets: np.ndarray,
) -> np.ndarray:
    index = EdgeIndex(edges, frame, starts, items, probes)
    n, m = len(viewers) // 2, len(targets) // 2
    seen = np.zeros(n * m)
    for i in range(n):
        x, y = viewers[2 * i], viewers[2 * i + 1]
        for j in range(m):
            seen[i * m + j] = segment_is_clear(index, x, y, targets[2 * j], targets[2 * j + 1])
    return seen


def corner_sight(
    index: EdgeIndex, viewers: np.ndarray, corners: np.ndarray, numbers: np.ndarray
) -> np.ndarray:
    """Which corner each viewer sees: as `sight_matrix`, faster where the targets are vertices.

    Args:
        index: The world's edges.
        viewers: Shape (2 n,), x and y of each viewer [m].
        corners: Shape (2 k,) [m].
        numbers: The edge that starts at each corner, shape (k,), from `edges_at`.

    Returns:
        Shape (n k,), row by row of viewers, of 1.0 and 0.0.
    """
    return _corner_sight(*index, viewers, corners, numbers)


def edges_at(index: EdgeIndex, points: np.ndarray) -> np.ndarray:
    """Number of the edge that starts at each vertex, shape (k, 2) -> (k,)."""
    offsets = index.edges[None, :, START : START + 2] - points[:, None, :]
    return np.argmin(np.abs(offsets).sum(axis=2), axis=1)


@njit(cache=True)
def _corner_sight(
    edges: np.ndarray,
    frame: np.ndarray,
    starts: np.ndarray,
    items: np.ndarray,
    probes: np.ndarray,
    viewers: np.ndarray,
    corners: np.ndarray,
    numbers: np.ndarray,
) -> np.ndarray:
    index = EdgeIndex(edges, frame, starts, items, probes)
    n, k = len(viewers) // 2, len(corners) // 2
    seen = np.zeros(n * k)
    for i in range(n):
        x, y = viewers[2 * i], viewers[2 * i + 1]
        for c in range(k):
            dx, dy = x - corners[2 * c], y - corners[2 * c + 1]
            length = math.sqrt(dx * dx + dy * dy)
            # Most corners that are not seen are hidden by their own obstacle.
            if length > frame[TOLERANCE] and leaves_through_obstacle(
                edges, numbers[c], dx / length, dy / length, length, frame[TOLERANCE]
            ):
                continue
            seen[i * k + c] = segment_is_clear(index, x, y, corners[2 * c], corners[2 * c + 1])
    return seen
