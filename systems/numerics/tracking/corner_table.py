"""A world's corners as one array, for the kernels of the tracking story."""

import numpy as np

from ..geometry.world import World


def corner_table(world: World) -> np.ndarray:
    """Corners of a world, one a row.

    Returns:
        Shape (k, 6): x, y [m], heading of the frame, interior angle [rad], lengths of edges A and
        B [m].
    """
    corners = world.corners
    return np.column_stack([corners.points, corners.headings, corners.angles, corners.lengths])
