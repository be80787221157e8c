"""Rounds: each divided among combines, or combines on adjacent rounds, one behind the other.

**Adjacent rounds** (Zhang 2014, Figure 3.8): each round begins ahead of where the one outside of it
began, on ground that was cut there by then. So the combine that has finished a round is ahead of
all others, and goes on ahead of them to the round inside of theirs: no combine passes another.
"""

import itertools
import math
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ..machines import Combine
from ..paths import MachinePath
from .cut_ground import GAP, CutGround
from .driver import Driver, NoWay
from .loops import Loop, cutting_radius, drive_edge, room_beyond

# Time that a split corner takes, to balance arcs [s].
CORNER_TIME = 18.0

# An arc begins and ends this far from split corners [m].
FROM_CORNER = 3.0

# Largest angle between an arc's smoothed path and its loop where the arc begins [rad].
LEAN = 0.015

# How many bays are tried, each nearer to the crop.
BAYS = 3

# If the straight before an edge's corner cannot be reached, it is shortened by these in turn [m].
LESS = (0.0, 0.0, 2.0, 4.0, 7.0)

# How far a round begins ahead of the beginning of the next outer one [m], at most this part of the
# outer one's length.
AHEAD, OF_ROUND = 100.0, 0.2
# Distances before that for changing lanes, and before that for coming off a bay [m].
BEFORE, COMING_OFF = 30.0, 45.0
# How far a combine may lag behind, in addition to the distances between where rounds begin [m].
LAG = 60.0


@dataclass(frozen=True, eq=False)
class Arc:
    """A part of a loop that one combine drives.

    Attributes:
        loop: The loop.
        begin: Station [m].
        end: Station, above begin; beyond the loop's length where it passes its first point [m].
        shift: Distance from the lane that the combine comes from, unless it begins at a corner [m].
    """

    loop: Loop
    begin: float
    end: float
    shift: float

    @property
    def from_corner(self) -> bool:
        """Whether it begins at a split corner."""
        return _is_corner(self.loop, self.begin)


def entry_length(shift: float, combine: Combine) -> tuple[float, float]:
    """Way along a lane that a change of lanes takes [m], and the radius of its two arcs [m].

    Args:
        shift: Between the lanes [m].
        combine: The combine.
    """
    radius = max(cutting_radius(combine), shift)
    angle = math.acos(1 - shift / (2 * radius))
    return 2 * radius * math.sin(angle), radius


def entry_path(goal: np.ndarray, shift: float, combine: Combine) -> MachinePath:
    """The change of lanes, from the left, that ends at a pose.

    Args:
        goal: x, y, theta, shape (3,) [m], [m], [rad].
        shift: Between the lanes [m].
        combine: The combine.
    """
    along, _ = entry_length(shift, combine)
    c, s = math.cos(goal[2]), math.sin(goal[2])
    lean = math.atan2(shift, along) * 2

    def behind(way: float, side: float, turn: float) -> list[float]:
        return [goal[0] - way * c - side * s, goal[1] - way * s + side * c, goal[2] + turn]

    poses = [behind(along, shift, 0.0), behind(along / 2, shift / 2, -lean), behind(0.0, 0.0, 0.0)]
    return MachinePath.of(poses, cutting=True)


def bay_shifts(ground: CutGround) -> list[float]:
    """Distances from bays in the margin, beside the crop, to the first lane, the largest first [m].

    In the outermost bay the header is beside the crop, if the margin has room for that; in the
    innermost it reaches over the crop, with the body beside it. Empty if the margin has no room.

    Args:
        ground: Of the combine.
    """
    combine = ground.combine
    half, least = combine.header_width / 2, combine.width / 2 + GAP
    outside = min(half + 3 * GAP, ground.margin - half - GAP)
    return [half + each for each in np.linspace(outside, least, BAYS)] if outside >= least else []


def _shifts(loop: Loop, ground: CutGround) -> list[float]:
    """Distances to a loop from where it may be entered: bays, or the lane outside of it [m]."""
    bays = bay_shifts(ground) if loop.number == 0 and not loop.hole else []
    return bays or [ground.combine.header_width]


def split_loops(
    loops: list[Loop],
    speeds: np.ndarray,
    ground: CutGround,
    *,
    preferred: np.ndarray | None,
    corners: bool,
) -> list[Arc]:
    """Split loops into arcs that take combines nearly equal times.

    Args:
        loops: The loops.
        speeds: Of the combines, shape (count,) [m/s].
        ground: Ground on which combines come to where arcs begin.
        preferred: Where combines would like to begin, shape (count, 2); None: anywhere.
        corners: Whether arcs begin at split corners only.

    Raises:
        NoWay: There is no room to come to a loop.
    """
    combine, count = ground.combine, len(speeds)
    times = np.array([_time(loop, combine) for loop in loops])
    shares = np.maximum(1, np.round(count * times / times.sum())).astype(int)
    arcs: list[Arc] = []
    for loop, share in zip(loops, shares, strict=True):
        begins = _begins(loop, speeds, int(share), ground, preferred, corners=corners)
        overlap = 0.0
        ends = [*(begin for begin, _ in begins[1:]), begins[0][0] + loop.length]
        for (begin, shift), following in zip(begins, ends, strict=True):
            end = following
            if not _is_corner(loop, following):
                overlap = FROM_CORNER - 1.0
                end = following + overlap
            arcs.append(Arc(loop, begin, end, shift))
    return arcs


def drive_arc(driver: Driver, arc: Arc) -> None:
    """Drive an arc, from the bay or from where the combine is.

    Args:
        driver: Who drives.
        arc: The arc.

    Raises:
        NoWay: It cannot be reached, or a corner not be turned.
    """
    loop, combine = arc.loop, driver.combine
    stops = [arc.begin, *loop.corners_within(arc.begin, arc.end), arc.end]
    for number, (begin, end) in enumerate(itertools.pairwise(stops)):
        behind = _room(driver, loop, begin, -1) if _is_corner(loop, begin) else 0.0
        ahead = _room(driver, loop, end, 1) if _is_corner(loop, end) else 0.0
        if number == 0 and not arc.from_corner:
            path = drive_edge(loop, begin, end, (0.0, ahead), combine)
            _enter(driver, path.poses[0], arc.shift)
        else:
            path = _reach(driver, loop, (begin, end), (behind, ahead))
        driver.drive(path)


def _reach(
    driver: Driver,
    loop: Loop,
    stations: tuple[float, float],
    extensions: tuple[float, float],
) -> MachinePath:
    """Drive to where an edge begins, as far before its corner as possible; return its path."""
    behind, ahead = extensions
    faults = []
    for less in LESS:
        if less <= behind:
            path = drive_edge(loop, *stations, (behind - less, ahead), driver.combine)
            try:
                driver.go(path.poses[0])
            except NoWay as fault:
                faults.append(fault)
                driver.ground.give_up_patches()
                continue
            return path
    raise faults[0]


def _enter(driver: Driver, goal: np.ndarray, shift: float) -> None:
    combine = driver.combine
    along, _ = entry_length(shift, combine)
    if driver.paths and driver.cut_towards(goal, 1.5 * along):
        return
    path = entry_path(goal, shift, combine)
    driver.go(path.poses[0])
    driver.drive(path)


def _begins(
    loop: Loop,
    speeds: np.ndarray,
    share: int,
    ground: CutGround,
    preferred: np.ndarray | None,
    *,
    corners: bool,
) -> list[tuple[float, float]]:
    combine = ground.combine
    shifts = _shifts(loop, ground)
    along, _ = entry_length(shifts[0], combine)
    if preferred is not None:
        first = loop.station(preferred[0]) + along
    else:
        first = float(loop.corners[0]) if len(loop.corners) else 0.0
    # Time up to each station, with the time for corners.
    stations = first + np.linspace(0.0, loop.length, 401)
    past = np.array([len(loop.corners_within(first - 1e-3, s)) for s in stations])
    clock = (stations - first) / combine.speed + CORNER_TIME * past
    # Faster combines drive longer parts.
    parts = speeds if share == len(speeds) else np.ones(share)
    begins = []
    for k in range(share):
        ideal = float(np.interp(clock[-1] * parts[:k].sum() / parts.sum(), clock, stations))
        if preferred is not None and len(preferred) == share:
            ideal = loop.station(preferred[k]) + along
        begin, shift = _fitting(loop, ideal, shifts, ground, corners=corners)
        begins.append((round(begin % loop.length, 6), shift))
    return sorted(dict(begins).items())


def _fitting(
    loop: Loop, ideal: float, shifts: list[float], ground: CutGround, *, corners: bool
) -> tuple[float, float]:
    """The station nearest to an ideal one at which an arc may begin, and the shift to it."""
    if corners and len(loop.corners):
        away = (loop.corners - ideal + loop.length / 2) % loop.length - loop.length / 2
        return float(loop.corners[np.argmin(np.abs(away))]), shifts[0]
    for shift in shifts:
        along, _ = entry_length(shift, ground.combine)
        for away in np.arange(0.0, loop.length / 2, 2.0):
            for at in (ideal + away, ideal - away):
                begin, end = at - along - 2 * FROM_CORNER, at + 2 * FROM_CORNER
                if len(loop.corners_within(begin, end)) or not _straight(loop, begin, end):
                    continue
                pose = loop.pose(at)
                leaning = (np.append(pose[:2], pose[2] + lean) for lean in (-LEAN, LEAN))
                entries = [entry_path(goal, shift, ground.combine) for goal in leaning]
                if all(
                    ground.may_stand(entry.poses[0]) and ground.admits(entry, cutting=True)
                    for entry in entries
                ):
                    return float(at), shift
    if len(loop.corners):
        return _fitting(loop, ideal, shifts, ground, corners=True)
    raise NoWay("no room to come to a round")


def _straight(loop: Loop, begin: float, end: float) -> bool:
    headings = np.unwrap([loop.pose(s)[2] for s in np.linspace(begin, end, 5)])
    return bool(np.ptp(headings) < math.radians(25.0))


def _time(loop: Loop, combine: Combine) -> float:
    return loop.length / combine.speed + CORNER_TIME * len(loop.corners)


def _is_corner(loop: Loop, station: float) -> bool:
    if not len(loop.corners):
        return False
    away = (loop.corners - station + loop.length / 2) % loop.length - loop.length / 2
    return bool(np.abs(away).min() < 1e-6)


def _room(driver: Driver, loop: Loop, station: float, side: int) -> float:
    """How far a straight may go on beyond a corner, before something forbidden."""
    room = room_beyond(loop, station, side, driver.combine, driver.ground.has_room)
    if room is None:
        raise NoWay(f"no room at the corner at {np.round(loop.pose(station)[:2], 1)}")
    return room


def ahead_on(loop: Loop) -> float:
    """How far ahead of a round's beginning the next one begins [m]."""
    return min(AHEAD, OF_ROUND * loop.length)


def line_up(drivers: list[Driver], loop: Loop) -> None:
    """Let combines begin one ahead of the other in bays beside the first round.

    The combine that passes first cuts the ground on which the next one comes off its bay.

    Args:
        drivers: Drivers that have driven nothing yet.
        loop: The first round.
    """
    combine = drivers[0].combine
    first = split_loops(
        [loop], np.array([combine.speed]), drivers[0].ground, preferred=None, corners=False
    )[0]
    for number, driver in enumerate(drivers):
        on = number * ahead_on(loop) - (BEFORE + COMING_OFF) * (number > 0)
        goal = loop.pose((first.begin + on) % loop.length)
        driver.go(entry_path(goal, first.shift, combine).poses[0])


def come_ahead(driver: Driver, begun: list[Arc], count: int, region: BaseGeometry) -> None:
    """Drive to where the next round begins, before those outside of it are finished.

    Args:
        driver: The driver of the next round.
        begun: Rounds that are driven before it, from the outside.
        count: Number of combines.
        region: The field.
    """
    crop = driver.ground.crop
    cells = crop.cells.copy()
    half = driver.combine.header_width / 2
    # Its own last round is done; the ends of the rounds inside of that still stand.
    for behind, arc in enumerate(reversed(begun[-(count - 1) :])):
        standing = (count - 1 - behind) * ahead_on(arc.loop) + LAG
        tail = arc.loop.part(max(arc.begin + ahead_on(arc.loop), arc.end - standing), arc.end)
        strip = shapely.LineString(tail).buffer(half, cap_style="flat", quad_segs=4)
        crop.mark(strip.intersection(region), stands=True)
    last = begun[-1]
    driver.go(last.loop.pose((last.begin + ahead_on(last.loop) - BEFORE) % last.loop.length))
    crop.cells[:] = cells
