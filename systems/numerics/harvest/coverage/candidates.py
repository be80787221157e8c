"""Ways to cut a field: how many rounds, which direction of swaths; told quickly what they take."""

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ..field.field import Field
from .arcs import CORNER_TIME
from .cut_ground import CutGround
from .loops import Loop, lay_out_loops
from .swaths import Swath, lay_out_swaths

# Numbers of rounds before swaths, and most rounds where they cut the field alone.
ROUNDS = (1, 2, 3)
MOST_ROUNDS = 6

# Directions of swaths besides those of edges [deg].
DIRECTIONS = range(0, 180, 15)

# Edges shorter than this tell no direction [m]; directions nearer than this are one [rad].
EDGE = 40.0
SAME = math.radians(4.0)

# What it takes to turn from swath to swath, to compare candidates [s].
TURN_TIME = 18.0


@dataclass(frozen=True, eq=False)
class Candidate:
    """A number of rounds and a direction of swaths.

    Attributes:
        region: What rounds are offsets of.
        rounds: Loops of each round.
        inside: What is left for swaths.
        swaths: They.
        time: Estimate for all of it with one combine [s].
    """

    region: BaseGeometry
    rounds: tuple[tuple[Loop, ...], ...]
    inside: BaseGeometry
    swaths: tuple[Swath, ...]
    time: float


def find_candidates(
    field: Field, region: BaseGeometry, ground: CutGround, *, inwards: bool = False
) -> list[Candidate]:
    """Candidates, those that take the least time first.

    Args:
        field: The field.
        region: What rounds are offsets of.
        ground: Before anything is cut, for the combine.
        inwards: Rounds as far as they go, and swaths for nothing but what they leave; the most
            rounds first.
    """
    combine = ground.combine
    every = list(itertools.islice(_all_rounds(region, ground), None if inwards else MOST_ROUNDS))
    directions = _directions(field)
    found = []
    for count in range(1, len(every) + 1):
        loops = tuple(map(tuple, every[:count]))
        driven = sum(loop.length for each in loops for loop in each)
        corners = sum(len(loop.corners) for each in loops for loop in each)
        rounds_time = driven / combine.speed + CORNER_TIME * corners
        inside = region.buffer(-count * combine.header_width, quad_segs=24)
        if inside.area < 1.0:
            found.append(Candidate(region, loops, shapely.Polygon(), (), rounds_time))
            break
        for direction in directions if inwards or count in ROUNDS else ():
            swaths = tuple(lay_out_swaths(inside, direction, combine))
            way = sum(swath.length for swath in swaths)
            time = rounds_time + way / combine.speed + TURN_TIME * len(swaths)
            found.append(Candidate(region, loops, inside, swaths, time))
    if inwards:
        return sorted(found, key=lambda candidate: (-len(candidate.rounds), candidate.time))
    return sorted(found, key=lambda candidate: candidate.time)


def _all_rounds(region: BaseGeometry, ground: CutGround) -> Iterator[list[Loop]]:
    """Loops of each round, until there is no room for a next one."""
    for number in itertools.count():
        loops = lay_out_loops(region, ground.combine, number, ground.has_room)
        if number > 0 and not loops:
            return
        yield loops


def _directions(field: Field) -> list[float]:
    ring = shapely.get_coordinates(field.outline.simplify(1.0))
    steps = np.diff(ring, axis=0)
    lengths = np.hypot(*steps.T)
    angles = np.arctan2(steps[:, 1], steps[:, 0]) % math.pi
    chosen: list[float] = []
    edges = [angles[k] for k in np.argsort(-lengths) if lengths[k] > EDGE]
    for angle in [*edges[:8], *np.radians(DIRECTIONS)]:
        if all(
            abs((angle - other + math.pi / 2) % math.pi - math.pi / 2) > SAME for other in chosen
        ):
            chosen.append(float(angle))
    return chosen
