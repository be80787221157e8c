"""All that two teams see, in one vector: each other, and the corners behind which to hide.

It is one signal instead of three, because in a diagram reading a signal costs as much as the
geometry behind it.
"""

import numpy as np

from ..compiled import compiled
from ..geometry.edge_index import TOLERANCE, EdgeIndex
from ..geometry.segment_sight import CornerIndex, see_corners, segment_is_clear
from ..geometry.team_sight import hide_behind_bodies, require_a_radius_each


def sight_size(pursuers: int, evaders: int, corners: int) -> int:
    """Length of the vector for n pursuers, m evaders and k corners: n m + n k + m k."""
    return pursuers * evaders + (pursuers + evaders) * corners


@compiled
def split_sight(
    sight: np.ndarray, pursuers: int, evaders: int, corners: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The blocks of the vector as matrices of 1.0 (sees) and 0.0, without copying.

    Args:
        sight: Shape (n m + n k + m k,).
        pursuers, evaders, corners: n, m, k.

    Returns:
        Which evader each pursuer sees (n, m), which corner each pursuer sees (n, k), which corner
        each evader sees (m, k).
    """
    first = pursuers * evaders
    second = first + pursuers * corners
    return (
        sight[:first].reshape((pursuers, evaders)),
        sight[first:second].reshape((pursuers, corners)),
        sight[second:].reshape((evaders, corners)),
    )


def observe(
    index: EdgeIndex,
    corners: CornerIndex,
    pursuers: np.ndarray,
    evaders: np.ndarray,
    radii: np.ndarray | None = None,
) -> np.ndarray:
    """Compute which evaders each pursuer sees, and which corners each agent sees.

    Bodies block only the sight between a pursuer and an evader. Corners are seen past bodies: they
    are the places where an evader may hide for good, while a body moves on.

    Args:
        index: The world's edges.
        corners: The world's corners.
        pursuers, evaders: Positions, shapes (2 n,) and (2 m,) [m].
        radii: Of the bodies that block sight, pursuers first, shape (n + m,) [m]; None: none does.

    Returns:
        The vector, to be taken apart by `split_sight`.

    Raises:
        InvalidInput: There is not one radius for each robot.
    """
    sight = _observe(*index, *corners, pursuers, evaders)
    if radii is not None:
        require_a_radius_each(radii, pursuers, evaders)
        hide_behind_bodies(sight, pursuers, evaders, radii, index.frame[TOLERANCE])
    return sight


# Passing the arrays one by one costs Numba a fraction of the time of a named tuple.
@compiled
def _observe(
    edges: np.ndarray,
    frame: np.ndarray,
    starts: np.ndarray,
    items: np.ndarray,
    probes: np.ndarray,
    points: np.ndarray,
    numbers: np.ndarray,
    lines: np.ndarray,
    heights: np.ndarray,
    pursuers: np.ndarray,
    evaders: np.ndarray,
) -> np.ndarray:
    index = EdgeIndex(edges, frame, starts, items, probes)
    corners = CornerIndex(points, numbers, lines, heights)
    n, m, k = len(pursuers) // 2, len(evaders) // 2, len(points)
    sight = np.zeros(n * m + (n + m) * k)
    visibility, pursuer_corners, evader_corners = split_sight(sight, n, m, k)
    for i in range(n):
        x, y = pursuers[2 * i], pursuers[2 * i + 1]
        for j in range(m):
            visibility[i, j] = segment_is_clear(index, x, y, evaders[2 * j], evaders[2 * j + 1])
    own = np.empty(lines.shape[1])
    see_corners(index, corners, pursuers, own, pursuer_corners)
    see_corners(index, corners, evaders, own, evader_corners)
    return sight
