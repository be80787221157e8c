"""A driver that leads one combine over a field, and ways that are cut to rings round holes."""

import math
from dataclasses import dataclass, replace

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ...planning.car_paths import CarPath, dubins_lengths, dubins_paths
from ..machines import Combine
from ..paths import MachinePath, join_paths
from .cut_ground import CutGround
from .loops import SPARE, Loop, cutting_radius, drive_line, rings_inside, turned_ring
from .swaths import Swath

# Where a loop is joined, ahead of and behind the nearest point [m].
JOINS = (10.0, 18.0, 28.0, 0.0, 45.0)

# Ways to poses farther away than this are sought along loops first [m].
FAR = 70.0

# Spacing of the poses of rings and roads between which entries are looked for [m].
SPACING = 6.0

# How many entries are checked against obstacles, the shortest first.
MOST_CHECKS = 60

# How far a ring is driven on beyond where it began [m].
OVERLAP = 1.0

# What it costs to get from loop to loop of the headland, in estimates [s].
OTHER_LOOP = 300.0


class NoWay(Exception):
    """No way was found on ground that is cut."""


def curve_path(curve: CarPath) -> MachinePath:
    """A curve that is driven forwards with the header down."""
    at = np.concatenate([[0.0], np.cumsum(curve.lengths)])
    at = np.unique(np.concatenate([at, np.arange(0.0, at[-1], 4.0)]))
    at = at[np.concatenate([[True], np.diff(at) > 1e-6])]
    return MachinePath.of(curve.poses(at), cutting=True)


def stop_time(combine: Combine) -> float:
    """Time that a change of gear takes over driving on [s]."""
    return combine.speed / combine.acceleration


def path_time(path: MachinePath, combine: Combine) -> float:
    """Time to drive a path, with a stop at each change of gear [s]."""
    return path.length / combine.speed + (len(path.cusps) + 1) * stop_time(combine)


class Driver:
    """A combine that is led from work to work.

    Attributes:
        ground: What it may drive on, with all that it knows to be cut.
        paths: Driven so far, each a piece of work or a way to one.
        roads: Loops on cut ground along which it gets about.
        ways_back: If it is amid standing crop, paths backwards over what it has cut, from where it
            is to where it came in, the shortest first.
    """

    def __init__(self, ground: CutGround, roads: list[Loop]) -> None:
        self.ground, self.combine, self.roads = ground, ground.combine, roads
        self.paths: list[MachinePath] = []
        self.ways_back: list[MachinePath] = []

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
        return join_paths(
            [
                replace(path, work=np.full(len(path.lengths), number))
                for number, path in enumerate(self.paths)
            ]
        )

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
            self.paths.append(MachinePath.of([goal]))
            return
        self.drive(self.way_to(self.pose, goal))
        self.ways_back = []

    def way_to(self, start: np.ndarray, goal: np.ndarray) -> MachinePath:
        """The quickest way found between two poses; if there is none, one that uses a way back.

        Args:
            start: x, y, theta, shape (3,) [m], [m], [rad].
            goal: The same, shape (3,).

        Raises:
            NoWay: None was found.
        """
        way = self._quickest(start, goal)
        for back in self.ways_back if way is None else ():
            onto = self._quickest(start, back.poses[0])
            off = None if onto is None else self._quickest(back.poses[-1], goal)
            if onto is not None and off is not None:
                return join_paths([onto, back, off])
        if way is None:
            raise NoWay(f"from {np.round(start, 1)} to {np.round(goal, 1)}")
        return way

    def _quickest(self, start: np.ndarray, goal: np.ndarray) -> MachinePath | None:
        apart = goal - start
        if np.abs(apart[:2]).max() < 1e-6 and abs(math.remainder(apart[2], math.tau)) < 1e-6:
            return MachinePath.of([start])
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
        return min(found, key=lambda way: path_time(way, self.combine), default=None)

    def cut_towards(self, goal: np.ndarray, longest: float) -> bool:
        """Cut a way directly to a pose, if one is allowed on which the body keeps to what is cut.

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


def lay_out_roads(region: BaseGeometry, depths: list[float], radius: float) -> list[Loop]:
    """Loops on the headland and round holes along which combines get about, both ways.

    Args:
        region: Region of which the rounds are offsets.
        depths: Distances from its edge; the first that leaves it in one part is taken [m].
        radius: Least radius of turns [m].
    """
    best: list[Loop] = []
    rounded = SPARE * radius
    for depth in depths:
        loops = []
        for shape, hole in rings_inside(region, depth):
            if not hole:
                shape = shape.buffer(-rounded, quad_segs=24).buffer(rounded, quad_segs=24)
            for each in shapely.get_parts(shape):
                if each.area > 1.0:
                    points = shapely.get_coordinates(each.exterior.simplify(0.01))
                    line = shapely.LineString(turned_ring(points, hole=hole))
                    loops.append(Loop(line, np.zeros(0), np.zeros(0), 0, hole))
        best = best or loops
        if len([loop for loop in loops if not loop.hole]) == 1:
            return loops
    return best


def detours(exits: np.ndarray, entries: np.ndarray, driver: Driver) -> np.ndarray:
    """Extra time of ways along the headland over straight ones, shape (n, m) [s].

    Args:
        exits: Poses from which they lead, shape (n, 3).
        entries: Poses to which they lead, shape (m, 3).
        driver: The driver, whose roads are used.
    """
    roads = driver.roads

    def places(poses: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        points = np.atleast_1d(np.asarray(shapely.points(poses[:, :2])))
        away = np.array([shapely.distance(road.line, points) for road in roads])
        which = np.argmin(away, axis=0)
        stations = np.array(
            [
                shapely.line_locate_point(roads[k].line, p)
                for k, p in zip(which, points, strict=True)
            ]
        )
        return which, stations

    loops, at = places(exits)
    others, to = places(entries)
    lengths = np.array([road.length for road in roads])[loops][:, None]
    way = np.abs(at[:, None] - to[None])
    way = np.minimum(way, lengths - way)
    chord = np.hypot(*(exits[:, None, :2] - entries[None, :, :2]).transpose(2, 0, 1))
    detour = np.maximum(0.0, way - chord - 10.0) / driver.combine.speed
    return np.where(loops[:, None] == others[None], detour, OTHER_LOOP)


@dataclass(frozen=True, eq=False)
class Gate:
    """A way that is cut to the outermost of some rings.

    Attributes:
        group: The rings, the outermost first.
        node: Swath and direction that are driven before it, 2 i or 2 i + 1; None: no swath.
        start: Where the combine begins, shape (3,).
        path: From the end of the swath, or from the start, to the ring.
        length: Of the path and of the rings [m].
    """

    group: tuple[Loop, ...]
    node: int | None
    start: np.ndarray
    path: MachinePath
    length: float


def ring_groups(rounds: tuple[tuple[Loop, ...], ...]) -> list[tuple[Loop, ...]]:
    """Groups of nested rings, the outermost of each first."""
    loops = [loop for each in reversed(rounds) for loop in each if loop.hole]
    groups: list[list[Loop]] = []
    for loop in loops:
        for group in groups:
            if shapely.Polygon(group[0].line).contains(loop.line):
                group.append(loop)
                break
        else:
            groups.append([loop])
    return [tuple(group) for group in groups]


def find_gate(
    group: tuple[Loop, ...],
    groups: list[tuple[Loop, ...]],
    swaths: tuple[Swath, ...],
    driver: Driver,
    lanes: list[Loop],
) -> Gate:
    """The best way to cut to some rings: behind a swath that ends there, or from the headland.

    Args:
        group: The rings.
        groups: Rings of all holes.
        swaths: Swaths from whose ends they may be reached.
        driver: Who drives.
        lanes: Loops on cut ground from which they may be reached.

    Raises:
        NoWay: There is none.
    """
    combine = driver.combine
    width = combine.header_width
    ring = group[0]
    goals = np.array([ring.pose(s) for s in np.arange(0.0, ring.length, SPACING)])
    holes = shapely.union_all([each[0].line for each in groups])
    starts: list[tuple[int | None, np.ndarray]] = []
    for number, swath in enumerate(swaths):
        for way in (0, 1):
            begin = swath.pose(way, outwards=False)
            if holes.distance(shapely.Point(begin[:2])) < 1.2 * width:
                continue
            end = swath.pose(1 - way, outwards=True)
            if ring.line.distance(shapely.Point(end[:2])) < width:
                starts.append((2 * number + way, end))
            starts.append((None, begin))
    for road in lanes:
        if not road.hole:
            for station in np.arange(0.0, road.length, 2 * SPACING):
                starts += [(None, road.pose(station, side)) for side in (1, -1)]
    radius = cutting_radius(combine)
    found = []
    for node, pose in starts:
        lengths = dubins_lengths(tuple(pose), goals, radius)
        best = np.argsort(lengths)[:2]
        found += [
            (float(lengths[k]), node, pose, goals[k]) for k in best if np.isfinite(lengths[k])
        ]
    found.sort(key=lambda each: each[0])
    rings = sum(loop.length for loop in group)
    for length, node, pose, goal in found[:MOST_CHECKS]:
        path = curve_path(dubins_paths(tuple(pose), tuple(goal), radius)[0])
        if driver.ground.admits(path, cutting=True):
            start = pose
            if node is not None:
                start = swaths[node // 2].pose(node % 2, outwards=False)
            return Gate(group, node, start, path, length + rings)
    raise NoWay("to the rings round a hole")


def drive_gate(driver: Driver, gate: Gate, swath: MachinePath | None, reach: float) -> None:
    """Drive to some rings and round them, from the outermost inwards.

    With a narrow header rings leave little room between the hole and the crop that stands round
    them: the combine may have to go out as it came in. It also goes out before a ring that would
    fill its tank, since no cart comes to it there.

    Args:
        driver: The driver, at the gate's start.
        gate: The way to the rings.
        swath: The swath that is driven before the gate's path, if there is one.
        reach: How far it cuts until its tank is full [m].

    Raises:
        NoWay: A ring cannot be entered from the one outside of it, or from the gate.
    """
    begun = len(driver.paths)
    if swath is not None:
        driver.drive(swath)
    driver.drive(gate.path)
    came_in = len(driver.paths)
    way_in = join_paths(driver.paths[begun:])
    cut = way_in.length
    for number, ring in enumerate(gate.group):
        if number > 0 and cut + ring.length > reach:
            driver.ways_back = [_backwards(way_in)]
            driver.go(way_in.poses[0])
            driver.drive(MachinePath.of(way_in.poses, gears=way_in.gears.tolist()))
            begun, cut = len(driver.paths) - 1, 0.0
            came_in = len(driver.paths)
        begin = _next_ring(driver, ring) if number > 0 else ring.station(driver.pose)
        path = drive_line(ring.part(begin, begin + ring.length + OVERLAP), cutting=True)
        driver.drive(_from_pose(path, driver.pose))
        cut += path.length
    ways = [driver.paths[begun:end] for end in (came_in, len(driver.paths))]
    driver.ways_back = [_backwards(join_paths(way)) for way in ways if way]


def _backwards(path: MachinePath) -> MachinePath:
    """A path driven from its end to its beginning in the other gear, with the header up."""
    return MachinePath.of(path.poses[::-1], gears=(-path.gears[::-1]).tolist())


def _next_ring(driver: Driver, ring: Loop) -> float:
    stations = np.arange(0.0, ring.length, SPACING / 2)
    goals = np.array([ring.pose(s) for s in stations])
    # The tail may swing out, over the ring outside of this one, which is cut.
    for radius in (cutting_radius(driver.combine), SPARE * driver.combine.turning_radius):
        lengths = dubins_lengths(tuple(driver.pose), goals, radius)
        for k in np.argsort(lengths)[: np.count_nonzero(np.isfinite(lengths))]:
            path = curve_path(dubins_paths(tuple(driver.pose), tuple(goals[k]), radius)[0])
            if driver.ground.admits(path, cutting=True):
                driver.drive(path)
                return float(stations[k])
    raise NoWay("to the inner ring round a hole")


def _from_pose(path: MachinePath, pose: np.ndarray) -> MachinePath:
    """The path, beginning with just this pose."""
    poses = path.poses.copy()
    poses[:, 2] += 2 * np.pi * np.round((pose[2] - poses[0, 2]) / (2 * np.pi))
    poses[0] = pose
    return MachinePath(poses, path.gears, path.cutting, path.work)
