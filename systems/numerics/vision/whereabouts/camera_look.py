"""Which places a camera has seen whole: where a shell would have been found, had it been there."""

import numpy as np

from ...compiled import compiled
from ...geometry.edge_index import EdgeIndex, point_is_free
from ...geometry.visibility_polygon import cast_ray
from .place_grid import PlaceGrid

# Bearings at which a view's depth is known.
RAYS = 1024


@compiled
def view_depths(index: EdgeIndex, x: float, y: float, bodies: np.ndarray) -> np.ndarray:
    """How far a camera sees at each of RAYS bearings, from -pi on in equal steps.

    Args:
        index: Edges of the world's walls.
        x, y: The camera [m].
        bodies: x, y and radius of what stands in the way, shape (m, 3) [m].

    Returns:
        Distances to walls and bodies, shape (RAYS,) [m]; zero from inside a wall.
    """
    depths = np.zeros(RAYS)
    if not point_is_free(index, x, y):
        return depths
    for k in range(RAYS):
        bearing = -np.pi + 2 * np.pi * k / RAYS
        right, left = cast_ray(index, x, y, np.cos(bearing), np.sin(bearing))
        depths[k] = min(right, left)
    for m in range(len(bodies)):
        dx, dy, radius = bodies[m, 0] - x, bodies[m, 1] - y, bodies[m, 2]
        away = np.hypot(dx, dy)
        if away <= radius:
            continue
        half = np.arcsin(radius / away)
        middle = np.arctan2(dy, dx)
        first = int(np.floor((middle - half + np.pi) / (2 * np.pi) * RAYS))
        last = int(np.ceil((middle + half + np.pi) / (2 * np.pi) * RAYS))
        for k in range(first, last + 1):
            depths[k % RAYS] = min(depths[k % RAYS], away - radius)
    return depths


@compiled
def see_places(
    grid: PlaceGrid,
    depths: np.ndarray,
    x: float,
    y: float,
    radius: float,
    nearest: float,
    farthest: float,
) -> np.ndarray:
    """Which cells a camera sees whole, with all of a shell that stands anywhere in them.

    Args:
        grid: Of places.
        depths: Of `view_depths`, shape (RAYS,) [m].
        x, y: The camera [m].
        radius: Of the shell [m].
        nearest, farthest: Distances between which the camera finds shells for certain [m].

    Returns:
        Shape (cells,), bool.
    """
    seen = np.zeros(len(grid.usable), dtype=np.bool_)
    # A cell's corners are this far from its place, which may be at its side.
    reach = 1.4143 * grid.cell
    wide = radius + reach
    for c in range(len(seen)):
        if not grid.usable[c]:
            continue
        dx, dy = grid.places[c, 0] - x, grid.places[c, 1] - y
        away = np.hypot(dx, dy)
        if not (nearest + reach <= away <= farthest - reach) or away <= wide:
            continue
        half, middle = np.arcsin(wide / away), np.arctan2(dy, dx)
        first = int(np.floor((middle - half + np.pi) / (2 * np.pi) * RAYS))
        last = int(np.ceil((middle + half + np.pi) / (2 * np.pi) * RAYS))
        clear = True
        for k in range(first, last + 1):
            if depths[k % RAYS] < away:
                clear = False
                break
        seen[c] = clear
    return seen
