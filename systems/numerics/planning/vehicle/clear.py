"""Ends that overlap a wall, and goals that walls part from the start."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely

from ...errors import require
from ...geometry.world import World
from ..goal import Goal
from .footprint import TRACTOR, Discs
from .overlap import deepest_overlap


def require_clear_ends(world: World, discs: Discs, start: Sequence[float], goal: Goal) -> None:
    """Refuse ends that overlap a wall; a goal box may reach into one, if its middle does not.

    Raises:
        InvalidInput: The cart overlaps a wall at the start, or in the middle of the goal.
    """
    for name, state in (("start", start), ("goal", goal.state)):
        overlap = deepest_overlap(world, discs, np.array([state], dtype=float))
        require(overlap <= 0, name, "keep the vehicle clear of walls", list(map(float, state)))


def walls_part(world: World, discs: Discs, start: Sequence[float], goal: Goal) -> bool:
    """Whether not even the disc around the tractor's axle can get from a start to a goal.

    Then there is no path at all. The other way about it is no promise: the cart is longer than
    that disc, and cannot turn on the spot.
    """
    radii = [
        radius
        for body, offset, radius in zip(discs.bodies, discs.offsets, discs.radii, strict=True)
        if body == TRACTOR and offset == 0.0
    ]
    free = world.polygon.buffer(-max(radii, default=0.0))
    # A buffer is a polygon with many corners: they must not leave an end outside.
    near = 1e-3 * max(radii, default=0.0) + world.tolerance
    x, y = float(start[0]), float(start[1])
    wide, high = (min(width, 2 * world.size) + near for width in goal.tolerance[:2])
    box = shapely.Polygon(replace(goal, tolerance=(wide, high, 0.0, 0.0)).corners())
    place = shapely.Point(x, y).buffer(near)
    return not any(
        part.intersects(place) and part.intersects(box) for part in shapely.get_parts(free)
    )
