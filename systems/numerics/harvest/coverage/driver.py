"""One combine that is led over a field: where it has been, and what is cut by then."""

import math

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ...planning.car_paths import CarPath, dubins_paths
from ..machines.combine import Combine
from ..paths.machine_path import TRANSIT, MachinePath, join_paths
from .cut_ground import CutGround
from .header_curves import cutting_radius, drive_line
from .loops import SPARE, Loop

# Where a loop is joined, ahead of and behind the nearest point [m].
JOINS = (10.0, 18.0, 28.0, 0.0, 45.0)

# Ways to poses farther off than this are looked for along loops first [m].
FAR = 70.0


class NoWay(Exception):
    """No way was found on ground that is cut."""


def curve_path(curve: CarPath) -> MachinePath:
    """A curve that is driven forwards with the header down."""
    at = np.concatenate([[0.0], np.cumsum(curve.lengths)])
    at = np.unique(np.concatenate([at, np.arange(0.0, at[-1], 4.0)]))
    at = at[np.concatenate([[True], np.diff(at) > 1e-6])]
    poses = curve.poses(at)
    count = len(poses) - 1
    return MachinePath(
        poses, np.ones(count, dtype=int), np.ones(count, dtype=bool), np.full(count, TRANSIT)
    )


def stop_time(combine: Combine) -> float:
    """What a change of gear costs against driving on [s]."""
    return combine.speed / combine.acceleration


class Driver:
    """A combine that is led from work to work.

    Attributes:
        ground: What it may drive on, as it knows by now.
        paths: Driven so far.
        roads: Loops on cut ground along which it gets about.
    """

    def __init__(self, ground: CutGround, combine: Combine, roads: list[Loop]) -> None:
        self.ground, self.combine, self.roads = ground, combine, roads
        self.paths: list[MachinePath] = []

    @property
    def pose(self) -> np.ndarray:
        """Where it is: x, y, theta, shape (3,) [m], [m], [rad].

        Raises:
            NoWay: It has not begun: there is no work for as many combines.
        """
        if not self.paths:
            raise NoWay("a combine has nothing to cut")
        return self.paths[-1].poses[-1]

    @property
    def path(self) -> MachinePath:
        """All that was driven.

        Raises:
            NoWay: Nothing was: there is no work for as many combines.
        """
        if not self.paths:
            raise NoWay("a combine has nothing to cut")
        return join_paths(self.paths)

    def drive(self, path: MachinePath) -> None:
        """Drive a path that begins where the combine is."""
        if path.length > 1e-6:
            self.paths.append(path)
            self.ground.cut(path)

    def go(self, goal: np.ndarray) -> None:
        """Drive to a pose on cut ground.

        Args:
            goal: x, y, theta, shape (3,) [m], [m], [rad].

        Raises:
            NoWay: None was found.
        """
        if not self.paths:
            self.paths.append(_stand(goal))
            return
        self.drive(self.way_to(self.pose, goal))

    def way_to(self, start: np.ndarray, goal: np.ndarray) -> MachinePath:
        """The quickest way found between two poses.

        Args:
            start: x, y, theta, shape (3,) [m], [m], [rad].
            goal: The same, shape (3,).

        Raises:
            NoWay: None was found.
        """
        apart = goal - start
        if np.abs(apart[:2]).max() < 1e-6 and abs(_wrap(apart[2])) < 1e-6:
            return _stand(start)
        distance = float(np.hypot(apart[0], apart[1]))
        direct = None
        if distance < FAR:
            direct = self.ground.turn(start, goal)
        if direct is not None and direct.length < 2.5 * distance + 60.0:
            return direct
        ways = [self._along(road, side, start, goal) for road in self.roads for side in (1, -1)]
        found = [way for way in [direct, *ways] if way is not None]
        if not found:
            direct = self.ground.turn(start, goal, search=True)
            found = [] if direct is None else [direct]
        if not found:
            raise NoWay(f"from {np.round(start, 1)} to {np.round(goal, 1)}")
        return min(found, key=lambda way: way.length + len(way.cusps) * stop_time(self.combine))

    def cut_towards(self, goal: np.ndarray, longest: float) -> bool:
        """Cut a way straight to a pose, in curves in which the body keeps to what is cut.

        Args:
            goal: x, y, theta, shape (3,) [m], [m], [rad].
            longest: Longer ways are not driven [m].
        """
        radius = cutting_radius(self.combine)
        paths = dubins_paths(tuple(self.pose), tuple(goal), radius)
        if not paths or paths[0].length > longest:
            return False
        path = curve_path(paths[0])
        if not self.ground.admits(path, cutting=True):
            return False
        self.drive(path)
        return True

    def _along(
        self, road: Loop, side: int, start: np.ndarray, goal: np.ndarray
    ) -> MachinePath | None:
        first, last = road.station(start), road.station(goal)
        on = self._join(road, side, first, start, leaving=False)
        off = self._join(road, side, last, goal, leaving=True)
        if on is None or off is None:
            return None
        begin, onto = on
        end, from_road = off
        way = (end - begin) * side % road.length
        if way < 1.0:
            return None
        if side > 0:
            points = road.part(begin % road.length, begin % road.length + way)
        else:
            points = road.part(end % road.length, end % road.length + way)[::-1]
        middle = drive_line(points, cutting=False)
        # Its ends lean as the line does there; the poses joined are those of the line.
        try:
            path = join_paths(
                [onto, _between(onto.poses[-1], middle, from_road.poses[0]), from_road]
            )
        except ValueError:
            return None
        if not self.ground.admits(path):
            return None
        return path

    def _join(
        self, road: Loop, side: int, station: float, pose: np.ndarray, *, leaving: bool
    ) -> tuple[float, MachinePath] | None:
        for ahead in JOINS:
            at = station + side * (-ahead if leaving else ahead)
            on_road = road.pose(at, side, arriving=leaving)
            begin, end = (on_road, pose) if leaving else (pose, on_road)
            if np.hypot(*(begin - end)[:2]) > FAR:
                continue
            way = self.ground.turn(begin, end)
            if way is not None and way.length < 120.0:
                return at, way
        return None


def _between(begin: np.ndarray, middle: MachinePath, end: np.ndarray) -> MachinePath:
    poses = middle.poses.copy()
    poses[0, :2], poses[-1, :2] = begin[:2], end[:2]
    poses[:, 2] += 2 * math.pi * round((begin[2] - poses[0, 2]) / (2 * math.pi))
    poses[0, 2] = begin[2]
    poses[-1, 2] = end[2] + 2 * math.pi * round((poses[-1, 2] - end[2]) / (2 * math.pi))
    return MachinePath(poses, middle.gears, middle.cutting, middle.work)


def _stand(pose: np.ndarray) -> MachinePath:
    return MachinePath(
        np.array([pose], dtype=float),
        np.zeros(0, dtype=int),
        np.zeros(0, dtype=bool),
        np.zeros(0, dtype=int),
    )


def _wrap(angle: float) -> float:
    return (angle + math.pi) % (2 * math.pi) - math.pi


def lay_out_roads(region: BaseGeometry, depths: list[float], radius: float) -> list[Loop]:
    """Loops on the headland and round holes along which combines get about, both ways.

    Args:
        region: What was offset to the rounds.
        depths: Distances from its edge, of which the first is taken that parts nothing [m].
        radius: Least, of turns [m].
    """
    best: list[Loop] = []
    rounded = SPARE * radius
    for depth in depths:
        loops = []
        for part in shapely.get_parts(region.buffer(-depth, quad_segs=24)):
            if part.geom_type != "Polygon" or part.is_empty:
                continue
            for place, ring in enumerate((part.exterior, *part.interiors)):
                shape = shapely.Polygon(ring)
                hole = place > 0
                if not hole:
                    shape = shape.buffer(-rounded, quad_segs=24).buffer(rounded, quad_segs=24)
                for each in shapely.get_parts(shape):
                    if each.area > 1.0:
                        points = np.array(each.exterior.simplify(0.01).coords)
                        if shapely.LinearRing(points).is_ccw != hole:
                            points = points[::-1]
                        none = np.zeros(0)
                        loops.append(Loop(shapely.LineString(points), none, none, 0, hole))
        best = best or loops
        if len([loop for loop in loops if not loop.hole]) == 1:
            return loops
    return best
