"""Tours: which combine drives which loops, and how it gets from one to the next."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from dataclasses import field as attribute

import numpy as np
import shapely

from .beginnings import Beginnings
from .field import Field
from .leftovers import Block, Pass
from .links import Passable, link_along, shortest_link
from .rings.laps import lap
from .rings.loops import Loop
from .stubble import Stubble
from .track import Track, join_tracks, straight_track


@dataclass
class Tour:
    """What one combine drives, as it is put together.

    Attributes:
        tracks: One after the other.
        numbers: Of each track: number of the loop or pass; -1 for the way to one.
        order: Of each track: number of the loop or pass that it belongs to or leads to; less than
            0 for the way from the edge of the field to the first one.
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
    field: Field,
    loops: Sequence[Loop],
    stubble: Stubble,
    header: float,
    radius: float,
    combines: int,
) -> tuple[list[Tour], list[str]]:
    """Deal the loops out in turn, each begun where the way to it is shortest.

    Args:
        field: Which.
        loops: From the edge inwards.
        stubble: Kept up.
        header: Its width [m].
        radius: Of turns [m].
        combines: How many.

    Returns:
        The tours, of which those of combines without a loop are empty, and what went wrong.
    """
    beginnings = Beginnings(field, loops, header, radius, combines, stubble)
    tours = [Tour() for _ in range(combines)]
    reasons = []
    starts: list[int] = []
    first_pose: np.ndarray | None = None
    for number, loop in enumerate(loops):
        tour = tours[number % combines]
        start = None
        if number < combines and loop.ring == number:
            start, lead = beginnings.first(number, first_pose)
            if lead is not None:
                # Cut before anything else, since all start from there.
                tour.add(lead, number, number - combines)
            if first_pose is None:
                first_pose = loop.poses([start])[0]
        else:
            assert first_pose is not None
            pose = tour.tracks[-1].end if tour.tracks else first_pose.tolist()
            start, way = beginnings.next(number, pose, starts)
            if way is None:
                reasons.append(f"no clear way to loop {number}: begun without one")
            else:
                tour.add(way, -1, number)
        starts.append(start)
        tour.add(lap(loop, start, header, radius, field.ground), number, number)
        stubble.drive(join_tracks(tour.tracks[-2:]))
    return tours, reasons


def drive_blocks(
    field: Field,
    tours: Sequence[Tour],
    loops: Sequence[Loop],
    blocks: Sequence[Block],
    stubble: Stubble,
    radius: float,
) -> tuple[int, list[str]]:
    """Append the rows over left crop to tours, each to the one that is done with it first.

    Of each block, rows are taken from both sides inwards, with what is left on their right.

    Args:
        field: Which.
        tours: So far.
        loops: Of the field.
        blocks: Of left crop.
        stubble: Kept up.
        radius: Of turns [m].

    Returns:
        How many rows are driven, and what went wrong.
    """
    passable = Passable(field.ground, shapely.Polygon(), stubble)
    lines = [(loop.points, loop.headings) for loop in loops[:1]]
    left = [list(block.rows) for block in blocks]
    known: dict[tuple, tuple[int, Track] | None] = {}

    def way(k: int, poses: np.ndarray) -> tuple[int, Track] | None:
        key = (k, len(tours[k].tracks), *poses.ravel().tolist())
        if key not in known:
            end = tours[k].tracks[-1].end
            known[key] = shortest_link(end, poses, radius, passable) or link_along(
                end, poses, lines, radius, passable
            )
        return known[key]

    number = len(loops)
    reasons = []
    while any(left):
        best = None
        for rows in filter(None, left):
            poses = np.concatenate([_pass_pose(rows[0], 1), _pass_pose(rows[-1], -1)])
            for k, tour in enumerate(tours):
                link = way(k, poses) if tour.tracks else (0, None)
                if link is None:
                    continue
                cost = tour.length + (link[1].length if link[1] else 0.0)
                if best is None or cost < best[0]:
                    best = cost, tour, rows, poses[link[0]], link
        if best is None:
            reasons.append(f"no clear way to {sum(map(len, left))} rows: left out")
            break
        _, tour, rows, pose, (side, track) = best
        if track is not None:
            tour.add(track, -1, number)
        row = rows.pop(-side)
        length = float(np.hypot(*np.diff(row.ends, axis=0)[0]))
        tour.add(straight_track(pose.tolist(), length), number, number)
        stubble.drive(join_tracks(tour.tracks[-2:]))
        number += 1
    return number - len(loops), reasons


def _pass_pose(each: Pass, direction: int) -> np.ndarray:
    """Where a row begins, driven in its direction, 1, or against it, -1; shape (1, 3)."""
    ends = each.ends[::direction]
    course = ends[1] - ends[0]
    return np.array([[*ends[0], math.atan2(course[1], course[0])]])
