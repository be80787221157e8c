"""A plan as lines: the swaths that combines cut, the ways that machines drive, and when."""

from typing import NamedTuple

import numpy as np

from ..paths.machine_path import TRANSIT, MachinePath
from ..paths.timed_path import TimedPath
from ..plan.harvest_plan import HarvestPlan

# Between an arc and the chords that stand for it [m].
CHORD_ERROR = 0.005
# Turned by less than this a line is straight [rad].
STRAIGHT = 1e-6


class Swath(NamedTuple):
    """What a combine cuts at a stretch.

    Attributes:
        combine: Its number, from 0.
        number: Of the swath among those of the combine, from 1, in the order of driving.
        points: Of the middle of the header, shape (n, 2) [m].
        straight: Whether it is a straight line, of two points.
        begin, end: When the header is at its ends [s].
        length: [m].
    """

    combine: int
    number: int
    points: np.ndarray
    straight: bool
    begin: float
    end: float
    length: float


def swaths_of(plan: HarvestPlan) -> list[Swath]:
    """The swaths of all combines, combine by combine, in the order of driving."""
    found = []
    for combine, timed in enumerate(plan.service.plans):
        path = timed.path
        # What is cut on the way from one piece of work to the next is a swath as well.
        kinds = np.where(path.cutting, path.work, TRANSIT - 1)
        edges = np.flatnonzero(np.diff(kinds)) + 1
        firsts, lasts = [0, *edges.tolist()], [*edges.tolist(), len(kinds)]
        number = 0
        for first, last in zip(firsts, lasts, strict=True):
            if last == first or kinds[first] < TRANSIT:
                continue
            number += 1
            stations = path.stations[first], path.stations[last]
            turned = np.abs(path.poses[first : last + 1, 2] - path.poses[first, 2]).max()
            straight = bool(turned < STRAIGHT)
            points = path.poses[[first, last], :2] if straight else path_points(path, first, last)
            found.append(
                Swath(
                    combine,
                    number,
                    points,
                    straight,
                    leaving_time(timed, stations[0]),
                    arrival_time(timed, stations[1]),
                    float(stations[1] - stations[0]),
                )
            )
    return found


def path_points(path: MachinePath, first: int, last: int) -> np.ndarray:
    """Points along some pieces of a path, on arcs so many that chords hardly cut them short.

    Args:
        path: Where.
        first, last: Numbers of the first pose and the last.

    Returns:
        Shape (n, 2) [m].
    """
    stations = [path.stations[first : first + 1]]
    for piece in range(first, last):
        length, bend = path.lengths[piece], abs(path.curvatures[piece])
        parts = int(np.ceil(length * np.sqrt(bend / (8 * CHORD_ERROR)))) if bend > 0 else 1
        begin, end = path.stations[piece], path.stations[piece + 1]
        stations.append(np.linspace(begin, end, max(parts, 1) + 1)[1:])
    return path.pose_at(np.concatenate(stations))[:, :2]


def way_points(timed: TimedPath, step: float) -> np.ndarray:
    """Where a machine is, on its way, at times that are evenly spaced.

    Args:
        timed: When it is where.
        step: Between two points [s].

    Returns:
        x, y and time, shape (n, 3) [m], [m], [s]; of a time in which it stands, both ends only.
    """
    count = max(2, int(np.ceil((timed.end - timed.times[0]) / step)) + 1)
    times = np.linspace(timed.times[0], timed.end, count)
    points = np.column_stack([timed.pose_at(times)[:, :2], times])
    moved = np.hypot(*np.diff(points[:, :2], axis=0).T) > 1e-3
    keep = np.concatenate([[True], moved]) | np.concatenate([moved, [True]])
    return points[keep]


def leaving_time(timed: TimedPath, station: float) -> float:
    """When a machine is at a station for the last time [s]."""
    return _bisect(timed, station, leaving=True)


def arrival_time(timed: TimedPath, station: float) -> float:
    """When a machine is at a station for the first time [s]."""
    return _bisect(timed, station, leaving=False)


def _bisect(timed: TimedPath, station: float, *, leaving: bool) -> float:
    # Stations are told by sums of many lengths.
    off = 1e-6 if leaving else -1e-6
    low, high = float(timed.times[0]), timed.end
    for _ in range(60):
        middle = (low + high) / 2
        if timed.station_at(middle) < station + off:
            low = middle
        else:
            high = middle
    return high
