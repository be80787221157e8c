"""Rings round holes: how combines cut their way to them and drive them."""

from dataclasses import dataclass

import numpy as np
import shapely

from ...planning.car_paths import dubins_lengths, dubins_paths
from ..paths.machine_path import MachinePath
from .driver import Driver, NoWay, curve_path
from .header_curves import cutting_radius, drive_line
from .loops import Loop
from .swaths import Swath

# Spacing of the poses of rings and roads between which entries are looked for [m].
SPACING = 6.0

# Entries that are compared with obstacles, the shortest first.
MOST_CHECKS = 60

# How far a ring is driven on beyond where it began [m].
OVERLAP = 1.0


@dataclass(frozen=True, eq=False)
class Gate:
    """A way that is cut to the outermost of some rings.

    Attributes:
        group: The rings, the outermost first.
        node: Swath and direction that are driven before, 2 i or 2 i + 1; None: no swath.
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
    """Rings, those inside of one another together, the outermost first."""
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
        groups: Those of all holes.
        swaths: Behind which they may be reached.
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


def drive_rings(driver: Driver, group: tuple[Loop, ...], work: int) -> int:
    """Drive rings from the outermost inwards; the number of the next work.

    Raises:
        NoWay: A ring cannot be entered from the one outside of it.
    """
    radius = cutting_radius(driver.combine)
    for number, ring in enumerate(group):
        begin = ring.station(driver.pose)
        if number > 0:
            begin = _next_ring(driver, ring, radius)
        points = ring.part(begin, begin + ring.length + OVERLAP)
        path = drive_line(points, cutting=True, work=work)
        path = _from_pose(path, driver.pose)
        driver.drive(path)
        work += 1
    return work


def _next_ring(driver: Driver, ring: Loop, radius: float) -> float:
    stations = np.arange(0.0, ring.length, SPACING / 2)
    goals = np.array([ring.pose(s) for s in stations])
    lengths = dubins_lengths(tuple(driver.pose), goals, radius)
    for k in np.argsort(lengths):
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
