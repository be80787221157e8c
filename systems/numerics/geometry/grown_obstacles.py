"""Where the centre of a round robot may be: the free region shrunk by its radius.

Obstacles grow by mitred corners (the orange boxes of Zhang 2014, 2.2.8), which contain the exact
rounded offset, so that a centre outside them keeps at least the radius from every obstacle.
"""

from functools import lru_cache

import shapely

from ..errors import InvalidInput, require_non_negative
from .world import World, world_from_polygon

# A mitre reaches at most this many radii from its corner; sharper corners are cut off there.
MITRE_LIMIT = 2.0


@lru_cache(maxsize=8)
def shrink_world(world: World, radius: float) -> tuple[World, ...]:
    """Shrink a free region by a radius [m]; narrow passages may split it into several.

    Games in one world are given the same parts, so that they share what is solved for them.

    Returns:
        The parts, largest first; the world itself for radius 0.

    Raises:
        InvalidInput: The radius is negative or leaves no free space.
    """
    require_non_negative("robot_radius", radius)
    if radius == 0.0:
        return (world,)
    shrunk = world.polygon.buffer(-radius, join_style="mitre", mitre_limit=MITRE_LIMIT)
    parts = [part for part in shapely.get_parts(shrunk) if part.area > world.tolerance**2]
    if not parts:
        raise InvalidInput(f"`robot_radius` must leave free space in the world; got {radius}")
    parts.sort(key=lambda part: -part.area)
    return tuple(world_from_polygon(part) for part in parts)
