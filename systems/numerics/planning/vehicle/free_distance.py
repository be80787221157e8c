"""How far places are from walls."""

import numpy as np
import shapely

from ...geometry.world import World


def signed_distance(world: World, points: np.ndarray) -> np.ndarray:
    """From points, shape (n, 2), to the nearest wall, shape (n,); positive in free space [m]."""
    shapely.prepare(world.polygon)
    inside = shapely.covers(world.polygon, shapely.points(points))
    distance = shapely.distance(world.polygon.boundary, shapely.points(points))
    return np.where(inside, 1.0, -1.0) * distance
