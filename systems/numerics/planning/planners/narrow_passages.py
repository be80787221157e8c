"""Passages among walls that are too narrow for a table's grid, and a cart that fits through them.

A line of nodes lies in a passage wherever it is, and however it runs, if the cart has half a step
of room on either side. A cart that is slimmer by that much has it in every passage that the cart
itself fits through. Where its way leads, that of the cart is near.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import shapely

from ...geometry.world import World, make_world
from ..footprint import Discs
from ..minimum_time.seeds import detours

# Share of the room by which routes keep off the edge of the region that has enough room.
_LITTLE = 1e-3


def saved_by_narrow_passages(
    world: World, discs: Discs, step: float, start: Sequence[float], end: Sequence[float]
) -> float:
    """How much passages that are too narrow for the grid would shorten the shortest route.

    Routes are those of a point that keeps the largest disc's radius off walls, with and without
    half a step of the grid more: that is the room a passage needs for a line of nodes to lie in it.
    The cart itself may be too long for a passage that its discs fit through one by one.

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


def slimmed(discs: Discs, step: float) -> Discs:
    """The discs of a cart that is slimmer by half a step on either side, but not by half.

    Args:
        discs: What the cart covers.
        step: Distance of nodes [m].
    """
    return replace(discs, radii=tuple(max(r - step / 2, r / 2) for r in discs.radii))


def _length(world: World, room: float, start: Sequence[float], end: Sequence[float]) -> float:
    """Length of the shortest route that keeps so much room, except at its ends; or infinite."""
    parts = shapely.get_parts(world.polygon.buffer(-room, join_style="mitre"))
    if not len(parts):
        return math.inf
    places = shapely.points([start, end])
    # An end that has less room is moved to the nearest place that has enough.
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
