"""Where robots' centres may be, with round corners: mitred ones would close the maze's passages.

An arc is a polygon round the true circle, so that no centre comes nearer to a wall than it may.
"""

import math

import shapely

from ...errors import InvalidInput, require_positive
from ...geometry.world import World, world_from_polygon

# Sides of a quarter of a circle.
_SIDES = 4
# The polygon of an arc goes round the circle; GEOS simplifies a little before it offsets.
_OUTER = 1.01 / math.cos(math.pi / (4 * _SIDES))


def rounded_regions(world: World, distance: float) -> tuple[World, ...]:
    """The free region without what is nearer to a wall than a distance [m].

    Returns:
        Its parts, largest first.

    Raises:
        InvalidInput: The distance is not positive, or leaves no free space.
    """
    require_positive("distance", distance)
    free = world.polygon.buffer(-_OUTER * distance, quad_segs=_SIDES)
    parts = [part for part in shapely.get_parts(free) if part.area > world.tolerance**2]
    if not parts:
        raise InvalidInput(f"`distance` must leave free space in the world; got {distance}")
    parts.sort(key=lambda part: -part.area)
    return tuple(world_from_polygon(part) for part in parts)
