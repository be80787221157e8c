"""Where combines go when they have finished: out of the others' way."""

from collections.abc import Sequence

import numpy as np
import shapely

from .beginnings import PLACES
from .field import Field
from .links import Passable, shortest_link
from .rings.loops import Loop
from .stubble import Stubble
from .tours import Tour


def park(
    field: Field,
    tours: Sequence[Tour],
    loops: Sequence[Loop],
    number: int,
    stubble: Stubble,
    header: float,
    radius: float,
) -> list[str]:
    """Send everybody to a place of their own on the first loop, out of the others' way.

    Args:
        field: Which.
        tours: So far.
        loops: Of the field.
        number: Of the loop.
        stubble: Kept up.
        header: Its width [m].
        radius: Of turns [m].

    Returns:
        What went wrong.
    """
    if not loops:
        return []
    line = loops[0]
    places = np.arange(0, len(line.points), max(1, len(line.points) // PLACES))
    poses = line.poses(places)
    reasons = []
    for k, tour in enumerate(tours):
        if not tour.tracks:
            continue
        own = max((n for n in tour.numbers if 0 <= n < len(loops)), default=-1)
        taboo = loops[own].inside if own >= 0 and tour.numbers[-1] == own else shapely.Polygon()
        way = shortest_link(
            tour.tracks[-1].end, poses, radius, Passable(field.ground, taboo, stubble)
        )
        if way is None:
            reasons.append(f"combine {k} stays where it finishes: no clear way to the edge")
            continue
        tour.add(way[1], -1, number)
        away = np.hypot(*(poses[:, :2] - poses[way[0], :2]).T)
        poses = poses[away > 2.0 * header] if (away > 2.0 * header).any() else poses
    return reasons
