"""A world's corners as one array, for the kernels of the tracking story."""

import numpy as np

from ..geometry.world import World


def corner_table(world: World) -> np.ndarray:
    """Corners of a world, shape (k, 4): x, y [m], heading of the frame, interior angle [rad]."""
    corners = world.corners
    return np.column_stack([corners.points, corners.headings, corners.angles])
