"""Passages that a cart fits through and a grid may not see."""

import math
from collections.abc import Sequence

import shapely

from ...geometry.world import World, make_world
from ..minimum_time.detours import detours
from ..vehicle.footprint import Discs

# Of the room, what routes keep off the edge of where there is enough.
_LITTLE = 1e-3


def saved_by_narrow_passages(
    world: World, discs: Discs, step: float, start: Sequence[float], end: Sequence[float]
) -> float:
    """How much shorter the shortest route is that leads through passages less than a cell wider.

    Routes are those of a point that keeps the largest disc's radius off walls, and half a step of
    the grid more: so much room a passage needs for a line of nodes to lie in it. The cart itself
    may be too long for a passage that its discs fit through one by one.

    Args:
        world: The walls.
        discs: What the cart covers.
        step: Distance of nodes [m].
        start, end: x, y [m].

    Returns:
        Length; zero: there is no such passage, or it saves nothing; infinite: there is no other way
        [m].
    """
    radius = max(discs.radii)
    narrow, wide = (_length(world, room, start, end) for room in (radius, radius + step / 2))
    return 0.0 if math.isinf(narrow) else max(wide - narrow, 0.0)


def _length(world: World, room: float, start: Sequence[float], end: Sequence[float]) -> float:
    """Of the shortest route that keeps so much room, but for ends that have less; or infinite."""
    parts = shapely.get_parts(world.polygon.buffer(-room, join_style="mitre"))
    if not len(parts):
        return math.inf
    places = shapely.points([start, end])
    # An end that has less room begins where there is.
    first, last = (int(shapely.distance(parts, place).argmin()) for place in places)
    if first != last:
        return math.inf
    free = parts[first]
    inside = make_world(
        shapely.get_coordinates(free.exterior)[:-1],
        [shapely.get_coordinates(ring)[:-1] for ring in free.interiors],
    )
    ends = [shapely.shortest_line(free, place).coords[0] for place in places]
    routes = detours(inside, _LITTLE * room, *ends)
    return float(shapely.length(shapely.LineString(routes[0]))) if routes else math.inf
