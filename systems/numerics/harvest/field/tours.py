"""Tours: which combine drives which loops, and how it gets from one to the next."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from dataclasses import field as attribute

import numpy as np
import shapely

from .field import Field
from .leftovers import Pass
from .links import Passable, link_along, shortest_link
from .rings.laps import corner_runs, lap
from .rings.loops import Loop
from .track import Track, straight_track

# Places of a loop that are tried as its beginning.
PLACES = 96

# Loops driven before that a longer way is looked for along.
MOST_LINES = 6


@dataclass
class Tour:
    """What one combine drives, as it is put together.

    Attributes:
        tracks: One after the other.
        numbers: Of each track: number of the loop or pass; -1 for the way to one.
        order: Of each track: number of the loop or pass that it belongs to or leads to.
    """

    tracks: list[Track] = attribute(default_factory=list)
    numbers: list[int] = attribute(default_factory=list)
    order: list[int] = attribute(default_factory=list)

    def add(self, track: Track, number: int, order: int) -> None:
        """Append a track."""
        self.tracks.append(track)
        self.numbers.append(number)
        self.order.append(order)

    @property
    def length(self) -> float:
        """Way driven [m]."""
        return sum(track.length for track in self.tracks)


def drive_loops(
    field: Field, loops: Sequence[Loop], header: float, radius: float, combines: int
) -> tuple[list[Tour], list[str]]:
    """Deal the loops out in turn, each begun where the way to it is shortest.

    Returns:
        The tours, of which those of combines without a loop are empty, and what went wrong.
    """
    tours = [Tour() for _ in range(combines)]
    reasons = []
    first_pose: np.ndarray | None = None
    for number, loop in enumerate(loops):
        tour = tours[number % combines]
        start = None
        if number < combines and loop.ring == number:
            start, lead = _first_start(field, loop, number, header, radius, first_pose)
            if lead is not None:
                tour.add(lead, number, number)
            if first_pose is None:
                first_pose = _poses(loop, [start])[0]
        else:
            pose = tour.tracks[-1].end if tour.tracks else first_pose
            assert pose is not None
            start, way = _way_to(field, loops, number, pose, radius)
            if way is None:
                reasons.append(f"no clear way to loop {number}: begun without one")
            else:
                tour.add(way, -1, number)
        tour.add(lap(loop, start, header, radius, field.ground), number, number)
    return tours, reasons


def drive_passes(
    field: Field,
    tours: Sequence[Tour],
    loops: Sequence[Loop],
    passes: Sequence[Pass],
    hulls: Sequence[shapely.Polygon],
    radius: float,
) -> list[str]:
    """Append passes to tours, each to the one that is done with it first.

    Returns:
        What went wrong.
    """
    standing = shapely.union_all(list(hulls))
    passable = Passable(field.ground, shapely.Polygon(), standing)
    lines = [(loop.points, loop.headings) for loop in loops[:MOST_LINES]]
    reasons = []
    left = list(passes)
    number = len(loops)
    while left:
        best = None
        for tour in tours:
            for each in left:
                ends = _pass_poses(each)
                if not tour.tracks:
                    link: tuple[int, Track | None] | None = (0, None)
                else:
                    link = shortest_link(tour.tracks[-1].end, ends, radius, passable)
                    if link is None and lines:
                        link = link_along(tour.tracks[-1].end, ends, lines, radius, passable)
                if link is None:
                    continue
                cost = tour.length + (link[1].length if link[1] else 0.0)
                if best is None or cost < best[0]:
                    best = cost, tour, each, ends[link[0]], link[1]
        if best is None:
            reasons.append(f"no clear way to {len(left)} of the passes: left out")
            break
        _, tour, each, pose, way = best
        if way is not None:
            tour.add(way, -1, number)
        length = float(np.hypot(*np.diff(each.ends, axis=0)[0]))
        tour.add(straight_track(pose.tolist(), length), number, number)
        left.remove(each)
        number += 1
    return reasons


def _pass_poses(each: Pass) -> np.ndarray:
    """Where a pass may begin: at either end; shape (2, 3)."""
    course = np.diff(each.ends, axis=0)[0]
    theta = math.atan2(course[1], course[0])
    return np.column_stack([each.ends, [theta, theta + math.pi]])


def _poses(loop: Loop, places: Sequence[int] | np.ndarray) -> np.ndarray:
    return np.column_stack([loop.points[places], loop.headings[places]])


def _first_start(
    field: Field,
    loop: Loop,
    number: int,
    header: float,
    radius: float,
    beside: np.ndarray | None,
) -> tuple[int, Track | None]:
    """Where a combine's first loop begins: at the field's edge, behind a corner.

    The way from the edge up to the loop runs straight on backwards from it.
    """
    runs = corner_runs(loop, radius)
    count = len(loop.points)
    if not runs:
        places = np.arange(0, count, max(1, count // PLACES))
    else:
        places = np.array([last % count for _, last, _ in runs])
    poses = _poses(loop, places)
    if beside is None:
        begins = np.array([first for first, _, _ in runs] or [0])
        straights = [np.min((begins - place - 1) % count) for place in places]
        best = int(np.argmax(straights))
    else:
        turned = np.abs(np.remainder(poses[:, 2] - beside[2] + np.pi, 2 * np.pi) - np.pi)
        away = np.hypot(*(poses[:, :2] - beside[:2]).T) + header * number * turned
        best = int(np.argmin(away))
    x, y, theta = poses[best].tolist()
    longest = 3.0 * header * (number + 1) + 2.0 * radius
    behind = (x - longest * math.cos(theta), y - longest * math.sin(theta))
    edge = shapely.LineString([(x, y), behind]).intersection(field.outline.exterior)
    way = shapely.Point(x, y).distance(edge) if not edge.is_empty else math.inf
    lead = None
    if way <= longest:
        lead = straight_track((x - way * math.cos(theta), y - way * math.sin(theta), theta), way)
        if not field.ground.covers(shapely.LineString(lead.points)):
            lead = None
    return int(places[best]), lead


def _way_to(
    field: Field,
    loops: Sequence[Loop],
    number: int,
    pose: Sequence[float],
    radius: float,
) -> tuple[int, Track | None]:
    """Where a loop is best begun, coming from a pose, and the way there."""
    loop = loops[number]
    count = len(loop.points)
    places = np.arange(0, count, max(1, count // PLACES))
    ends = _poses(loop, places)
    passable = Passable(
        field.ground, loop.inside.union(loop.waiting), loop.crop.union(loop.waiting)
    )
    found = shortest_link(pose, ends, radius, passable)
    if found is None:
        before = loops[max(0, number - MOST_LINES) : number] + loops[: min(1, number)]
        lines = [(each.points, each.headings) for each in before]
        found = link_along(pose, ends, lines, radius, passable)
    if found is None:
        return int(places[np.argmin(np.hypot(*(ends[:, :2] - np.array(pose[:2])).T))]), None
    return int(places[found[0]]), found[1]
