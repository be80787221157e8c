"""The loops of a field, in the order in which they are begun."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ..field import Field
from .drivable_loop import drivable_loop
from .gates import Gate, find_gates
from .ring_regions import (
    fill_holes,
    polygons,
    round_convex_corners,
    round_reflex_corners,
    shrink,
    union,
)

# Radius that loops are laid out with, over the least one: what is left spreads their kinks.
DESIGN = 1.1


@dataclass(frozen=True, eq=False)
class Loop:
    """A closed line that one combine drives, clockwise.

    Attributes:
        ring: Number of rings between it and the edge of the field.
        points: Without the first repeated, shape (n, 2) [m].
        headings: Continuous, shape (n,) [rad].
        crop: The piece of crop at whose edge it works, as it is before.
        inside: What its line goes round; crop that is left when the loop is done lies in there.
        waiting: Other crop that stands when it is begun.
        gates: Ways cut from it to obstacles.
    """

    ring: int
    points: np.ndarray
    headings: np.ndarray
    crop: shapely.Polygon
    inside: shapely.Polygon
    waiting: BaseGeometry
    gates: tuple[Gate, ...]

    def poses(self, places: Sequence[int] | np.ndarray) -> np.ndarray:
        """x, y, theta at some of its points, shape (m,) -> (m, 3).

        Args:
            places: Numbers of the points, shape (m,).
        """
        return np.column_stack([self.points[places], self.headings[places]])

    @property
    def step(self) -> float:
        """Way from each of its points to the next [m]."""
        return float(np.hypot(*(self.points[1] - self.points[0])))

    def nearest(self, point: np.ndarray) -> int:
        """Number of its point that is nearest to one, shape (2,) [m]."""
        return int(np.argmin(np.hypot(*(self.points - point).T)))


def lay_out_loops(field: Field, header: float, radius: float) -> list[Loop]:
    """Lay out all loops, depth first: a piece of crop is finished before the next is begun.

    Obstacles that the first ring does not touch get a way cut to them from it, one header wide;
    after that they are part of the crop's edge.

    Args:
        field: The field.
        header: Width of the header [m].
        radius: Least turning radius [m].

    Returns:
        Empty if no loop has room; the crop is left for straight passes then.
    """
    design = DESIGN * radius
    keep_off = max(design, header / 2)
    zones = union([each.buffer(keep_off, quad_segs=24) for each in field.obstacles])
    loops: list[Loop] = []
    pending: list[tuple[int, shapely.Polygon]] = [(0, field.outline)]
    while pending:
        ring, crop = pending.pop()
        waiting = union([other for _, other in pending])
        children: list[shapely.Polygon] = []
        for middle in shrink(crop, header / 2):
            # An obstacle that the ring does not touch is no business of this ring's.
            for part in polygons(middle.difference(zones)):
                rounded = round_reflex_corners(fill_holes(part), design, header, field.ground)
                cut: list[BaseGeometry] = []
                for region in round_convex_corners(rounded, design):
                    points, headings = drivable_loop(region, radius)
                    gates = find_gates(points, headings, region, field.obstacles, header, design)
                    loops.append(Loop(ring, points, headings, crop, region, waiting, gates))
                    for gate in gates:
                        obstacle = field.obstacles[gate.obstacle]
                        cut.append(gate.line.buffer(header / 2, cap_style="flat"))
                        cut.append(obstacle.buffer(keep_off - header / 2, quad_segs=24))
                left = [child.difference(union(cut)) for child in shrink(rounded, header / 2)]
                children += [fill_holes(child) for each in left for child in polygons(each)]
        pending += [(ring + 1, child) for child in sorted(children, key=lambda c: -c.area)]
    return loops
