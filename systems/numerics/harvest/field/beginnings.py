"""Where each loop is begun, and how its combine gets there."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from .field import Field
from .links import Passable, link_along, link_off, shortest_link
from .rings.laps import corner_runs
from .rings.loops import Loop
from .stubble import Stubble
from .track import Track, straight_track

# Places of a loop that are tried as its beginning.
PLACES = 96

# How far from where the loop before was begun places are close by each other, in headers; and
# where, from there on, a combine may leave its own loop, the likeliest places first.
NEARBY, LEAVES = 30.0, 0.5 * np.array([1, 0, -1, 2, -2, 3, -3, 4, -4, 5, -5, 6, -6, 7, -7, -8])

# Part of what a combine should have behind it that is counted on.
LAG = 0.8

# Loops driven before that a longer way is looked for along.
MOST_LINES = 6


@dataclass(frozen=True, eq=False)
class Beginnings:
    """Finds where the loops of a field are begun, and ways there.

    Every metre by which a loop is begun farther on than the one before it is one more for all
    that come after, since nobody may begin where the crop on the left still stands. So each is
    begun as near as can be to where the last one was; its combine drives on along the loop that
    it has just cut until it is beside that place, and only then crosses over to it.

    Attributes:
        field: Which.
        loops: From the edge inwards.
        header: Its width [m].
        radius: Of turns [m].
        combines: How many.
        stubble: What is cut by now.
    """

    field: Field
    loops: Sequence[Loop]
    header: float
    radius: float
    combines: int
    stubble: Stubble

    def first(self, number: int, beside: np.ndarray | None) -> tuple[int, Track | None]:
        """Where a combine's first loop begins: at the field's edge, behind a corner.

        The way from the edge up to the loop runs straight on backwards from it.

        Args:
            number: Of the loop.
            beside: Where loop 0 begins, shape (3,); none: this is it.

        Returns:
            Number of the point, and the way to it if there is one.
        """
        loop = self.loops[number]
        runs = corner_runs(loop, self.radius)
        count = len(loop.points)
        if not runs:
            places = np.arange(0, count, max(1, count // PLACES))
        else:
            places = np.array([last % count for _, last, _ in runs])
        poses = loop.poses(places)
        if beside is None:
            begins = np.array([first for first, _, _ in runs] or [0])
            straights = [np.min((begins - place - 1) % count) for place in places]
            best = int(np.argmax(straights))
        else:
            turned = np.abs(np.remainder(poses[:, 2] - beside[2] + np.pi, 2 * np.pi) - np.pi)
            away = np.hypot(*(poses[:, :2] - beside[:2]).T) + self.header * number * turned
            best = int(np.argmin(away))
        return int(places[best]), self._lead(poses[best], number)

    def _lead(self, pose: np.ndarray, number: int) -> Track | None:
        x, y, theta = pose.tolist()
        longest = 3.0 * self.header * (number + 1) + 2.0 * self.radius
        behind = (x - longest * math.cos(theta), y - longest * math.sin(theta))
        edge = shapely.LineString([(x, y), behind]).intersection(self.field.outline.exterior)
        way = shapely.Point(x, y).distance(edge) if not edge.is_empty else math.inf
        if way > longest:
            return None
        lead = straight_track((x - way * math.cos(theta), y - way * math.sin(theta), theta), way)
        return lead if self.field.ground.covers(shapely.LineString(lead.points)) else None

    def next(
        self, number: int, pose: Sequence[float], starts: Sequence[int]
    ) -> tuple[int, Track | None]:
        """Where a loop is best begun, coming from a pose, and the way there.

        Args:
            number: Of the loop.
            pose: x, y, theta of its combine.
            starts: Where the loops before are begun.

        Returns:
            Number of the point, and the way to it if one is found.
        """
        loop = self.loops[number]
        before = self.loops[number - 1].points[starts[number - 1]]
        places, on = self._places(loop, before)
        ends, costs = loop.poses(places), self.combines * on
        for avoided in (self._cut_late(number, starts), shapely.Polygon()):
            taboo = shapely.union_all([loop.inside, loop.waiting, avoided])
            passable = Passable(self.field.ground, taboo, self.stubble)
            found = self._way(number, pose, before, ends, costs, passable)
            if found is not None:
                return int(places[found[0]]), found[1]
        return int(places[np.argmin(np.hypot(*(ends[:, :2] - np.array(pose[:2])).T))]), None

    def _places(self, loop: Loop, before: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Points at which a loop may be begun, and how far on they are from beside a point [m].

        They are all round, and close by each other just after that point.
        """
        count, step = len(loop.points), loop.step
        close = (np.arange(0.0, NEARBY * self.header, self.header / 3) / step).astype(int)
        all_round = np.arange(0, count, max(1, count // PLACES))
        on = np.unique(np.concatenate([all_round, close % count]))
        return (loop.nearest(before) + on) % count, on * step

    def _way(
        self,
        number: int,
        pose: Sequence[float],
        before: np.ndarray,
        ends: np.ndarray,
        costs: np.ndarray,
        passable: Passable,
    ) -> tuple[int, Track] | None:
        found = None
        if number >= self.combines:
            own = self.loops[number - self.combines]
            first, last = own.nearest(np.array(pose[:2])), own.nearest(before)
            ways = (last - first) % len(own.points) * own.step + self.header * LEAVES
            leaves = [*(int(way / own.step) for way in ways if way > 0), 0]
            line = own.points, own.headings
            found = link_off(line, first, leaves, ends, self.radius, passable, costs)
        if found is None:
            found = shortest_link(pose, ends, self.radius, passable, costs)
        if found is None:
            driven = [*self.loops[max(0, number - MOST_LINES) : number], *self.loops[:1]]
            lines = [(each.points, each.headings) for each in driven]
            found = link_along(pose, ends, lines, self.radius, passable, costs)
        return found

    def _cut_late(self, number: int, starts: Sequence[int]) -> BaseGeometry:
        """Crop that the others will still be at when a combine comes to begin a loop.

        If they follow each other at equal distances, the k-th before it has k of N parts of its
        lap behind it.
        """
        swaths = []
        for k in range(1, min(self.combines, len(starts) + 1)):
            loop, start = self.loops[number - k], starts[number - k]
            done = round(LAG * len(loop.points) * k / self.combines)
            order = (start + np.arange(done, len(loop.points))) % len(loop.points)
            inwards = loop.inside.contains(shapely.Point(self.loops[number].points[0]))
            if inwards and len(order) > 1:
                swaths.append(shapely.LineString(loop.points[order]).buffer(0.7 * self.header))
        return shapely.union_all(swaths)
