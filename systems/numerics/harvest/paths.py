"""Paths of machines, the times at which a machine drives a path, and the fastest way to drive it.

Between two poses a machine moves by a constant twist, between two times at constant acceleration.

**The fastest way** within speed limits and an acceleration: at each station the machine has to be
slow enough to brake for all limits and stops ahead, and no faster than it can have become since
those behind. The squared speeds at the stations where limits change follow from one pass forwards
and one backwards; between two of them the machine speeds up, drives at the limit where it reaches
it, and slows down.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from ..compiled import compiled
from ..errors import require, require_positive


@dataclass(frozen=True, eq=False)
class MachinePath:
    """Poses of a machine's reference point, in the order in which it drives through them.

    From one pose to the next the machine moves by a constant twist, along an arc or a straight. The
    reference point is the middle of a combine's header, which is taken to be on its driven axle,
    and the middle of a tractor's rear axle.

    Attributes:
        poses: x, y, theta, shape (n, 3) [m], [m], [rad]; theta is continuous, not wrapped.
        gears: Of each piece: 1 forwards, -1 backwards; shape (n - 1,).
        cutting: Whether the header is down on each piece, shape (n - 1,).
        work: Number of the piece of work, or of the way to one, that each piece belongs to, shape
            (n - 1,).

    Raises:
        InvalidInput: Shapes do not fit.
    """

    poses: np.ndarray
    gears: np.ndarray
    cutting: np.ndarray
    work: np.ndarray

    def __post_init__(self) -> None:
        shape = self.poses.shape
        require(
            len(shape) == 2 and shape[1] == 3 and len(self.poses) > 0, "poses", "be (n, 3)", shape
        )
        for name in ("gears", "cutting", "work"):
            each = getattr(self, name).shape
            require(each == (len(self.poses) - 1,), name, "be (n - 1,)", each)

    @classmethod
    def of(
        cls,
        poses: Sequence[Sequence[float]] | Sequence[np.ndarray] | np.ndarray,
        *,
        gears: Sequence[int] | int = 1,
        cutting: bool = False,
    ) -> Self:
        """A path on which the header is up or down all the way.

        Args:
            poses: x, y, theta, shape (n, 3) [m], [m], [rad].
            gears: Of each piece, or of all.
            cutting: Whether the header is down.
        """
        count = len(poses) - 1
        told = np.full(count, gears, dtype=int), np.full(count, cutting)
        return cls(np.asarray(poses, dtype=float), *told, np.zeros(count, dtype=int))

    @cached_property
    def lengths(self) -> np.ndarray:
        """Way driven on each piece, shape (n - 1,) [m]."""
        chords = np.hypot(*np.diff(self.poses[:, :2], axis=0).T)
        half = np.diff(self.poses[:, 2]) / 2
        # np.sinc(x) is sin(pi x) / (pi x).
        return chords / np.sinc(half / np.pi)

    @cached_property
    def stations(self) -> np.ndarray:
        """Way driven up to each pose, forwards and backwards, shape (n,) [m]."""
        return np.concatenate([[0.0], np.cumsum(self.lengths)])

    @property
    def length(self) -> float:
        """Way driven in all [m]."""
        return float(self.stations[-1])

    @cached_property
    def curvatures(self) -> np.ndarray:
        """Change of heading per way driven on each piece, shape (n - 1,) [1/m]."""
        turned = np.diff(self.poses[:, 2])
        return np.divide(turned, self.lengths, out=np.zeros(len(turned)), where=self.lengths > 0)

    @cached_property
    def cusps(self) -> np.ndarray:
        """Stations at which the gear changes, shape (c,) [m]."""
        return self.stations[1:-1][np.diff(self.gears) != 0]

    def piece_at(self, stations: np.ndarray | float) -> np.ndarray:
        """Number of the piece that begins at or before each station, shape (...)."""
        piece = np.searchsorted(self.stations, stations, side="right") - 1
        return np.clip(piece, 0, max(len(self.lengths) - 1, 0))

    def pose_at(self, stations: np.ndarray | float) -> np.ndarray:
        """Poses at stations, which are clipped to the path.

        Args:
            stations: Shape (...) [m].

        Returns:
            x, y, theta, shape (..., 3) [m], [m], [rad]; theta is not wrapped.
        """
        at = np.clip(np.asarray(stations, dtype=float), 0.0, self.length)
        if len(self.poses) == 1:
            return np.broadcast_to(self.poses[0], (*at.shape, 3)).copy()
        piece, driven, share = self.share_at(at)
        return poses_between(self.poses[piece], self.poses[piece + 1], share, driven)

    def share_at(self, stations: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Piece of each station, way driven on it [m], and share of its length; shape (...) each.

        Args:
            stations: On the path, which has a piece, shape (...) [m].
        """
        piece = self.piece_at(stations)
        driven, length = stations - self.stations[piece], self.lengths[piece]
        share = np.divide(driven, length, out=np.zeros(np.shape(stations)), where=length > 0)
        return piece, driven, share

    def stations_every(self, spacing: float) -> np.ndarray:
        """Evenly spaced stations from the first to the last, at most a spacing apart.

        Args:
            spacing: Largest distance between two stations [m].
        """
        count = max(1, int(np.ceil(self.length / spacing - 1e-9)))
        return np.linspace(0.0, self.length, count + 1)


def poses_between(
    begin: np.ndarray, end: np.ndarray, share: np.ndarray, driven: np.ndarray
) -> np.ndarray:
    """Poses of a machine that moves by a constant twist, shape (..., 3) [m], [m], [rad].

    Args:
        begin, end: Poses, shape (..., 3) [m], [m], [rad].
        share: Part of the way from the one to the other, shape (...).
        driven: Way driven by then, shape (...) [m].
    """
    turned = end[..., 2] - begin[..., 2]
    along = np.arctan2(end[..., 1] - begin[..., 1], end[..., 0] - begin[..., 0])
    # The chord of a part of an arc: its direction leans as far as the rest of the arc turns.
    direction = along - turned * (1 - share) / 2
    chord = driven * np.sinc(turned * share / (2 * np.pi))
    return np.stack(
        [
            begin[..., 0] + chord * np.cos(direction),
            begin[..., 1] + chord * np.sin(direction),
            begin[..., 2] + share * turned,
        ],
        axis=-1,
    )


def rounded_path(points: np.ndarray, *, cutting: bool = False) -> MachinePath:
    """The forward path along a polyline, its corners rounded by the widest arcs that fit.

    Each corner's arc begins and ends half the shorter edge away from the corner, so that a
    polyline along an arc gives nearly that arc.

    Args:
        points: At least two, shape (n, 2) [m].
        cutting: Whether the header is down.
    """
    steps = np.diff(points, axis=0)
    lengths = np.hypot(*steps.T)
    headings = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
    poses = [(points[0, 0], points[0, 1], headings[0])]

    def drive_to(x: float, y: float, theta: float) -> None:
        last = poses[-1]
        if np.hypot(x - last[0], y - last[1]) > 1e-6:
            poses.append((x, y, theta))

    for k in range(1, len(points) - 1):
        before, after = headings[k - 1], headings[k]
        if abs(after - before) < 1e-6:
            continue
        tangent = min(lengths[k - 1], lengths[k]) / 2
        x, y = points[k]
        drive_to(x - tangent * np.cos(before), y - tangent * np.sin(before), before)
        drive_to(x + tangent * np.cos(after), y + tangent * np.sin(after), after)
    drive_to(points[-1, 0], points[-1, 1], headings[-1])
    if len(poses) == 1:
        poses.append(poses[0])
    return MachinePath.of(poses, cutting=cutting)


def join_paths(paths: Sequence[MachinePath]) -> MachinePath:
    """Join paths, each of which begins where the one before it ends.

    Args:
        paths: At least one; a heading may differ from the one before by whole turns.

    Raises:
        InvalidInput: There is none, or a path begins elsewhere.
    """
    require(len(paths) > 0, "paths", "be at least one", len(paths))
    poses = [paths[0].poses]
    last = paths[0].poses[-1]
    for path in paths[1:]:
        first = path.poses[0]
        turns = np.round((last[2] - first[2]) / (2 * np.pi))
        turned = path.poses + np.array([0.0, 0.0, 2 * np.pi * turns])
        apart = float(np.abs(turned[0] - last).max())
        require(apart < 1e-6, "paths", "begin where the one before ends", f"{apart:.3g} away")
        poses.append(turned[1:])
        last = turned[-1]
    columns = [
        np.concatenate([getattr(path, name) for path in paths])
        for name in ("gears", "cutting", "work")
    ]
    return MachinePath(np.concatenate(poses), *columns)


@dataclass(frozen=True, eq=False)
class TimedPath:
    """A path and the times at which it is driven.

    Between two of its times the acceleration along the path is constant; before the first the
    machine stands at the first station, after the last at the last.

    Attributes:
        path: The path.
        times: Never decreasing, shape (k,) [s].
        stations: At the times, never decreasing, shape (k,) [m].
        speeds: At the times, along the path whatever the gear, zero or positive, shape (k,) [m/s].

    Raises:
        InvalidInput: Shapes do not fit, or times or stations decrease.
    """

    path: MachinePath
    times: np.ndarray
    stations: np.ndarray
    speeds: np.ndarray

    def __post_init__(self) -> None:
        shape = self.times.shape
        require(len(shape) == 1 and len(self.times) > 0, "times", "be (k,)", shape)
        for name in ("stations", "speeds"):
            each = getattr(self, name).shape
            require(each == shape, name, f"have shape {shape}", each)
        for name in ("times", "stations"):
            require(bool((np.diff(getattr(self, name)) >= 0).all()), name, "never decrease", name)

    @property
    def end(self) -> float:
        """When it arrives [s]."""
        return float(self.times[-1])

    def station_at(self, times: np.ndarray | float) -> np.ndarray:
        """Stations at times, shape (...) [s] -> (...) [m]."""
        at = np.clip(np.asarray(times, dtype=float), self.times[0], self.times[-1])
        number, since = self._since(at)
        speed, acceleration = self.speeds[number], self._accelerations()[number]
        way = self.stations[number] + since * (speed + acceleration * since / 2)
        following = np.minimum(number + 1, len(self.stations) - 1)
        return np.clip(way, self.stations[number], self.stations[following])

    def speed_at(self, times: np.ndarray | float) -> np.ndarray:
        """Speeds along the path at times, shape (...) [s] -> (...) [m/s]."""
        asked = np.asarray(times, dtype=float)
        at = np.clip(asked, self.times[0], self.times[-1])
        number, since = self._since(at)
        speed = np.maximum(self.speeds[number] + self._accelerations()[number] * since, 0.0)
        return np.where((asked < self.times[0]) | (asked > self.times[-1]), 0.0, speed)

    def pose_at(self, times: np.ndarray | float) -> np.ndarray:
        """Poses at times, shape (...) [s] -> (..., 3) [m], [m], [rad]."""
        return self.path.pose_at(self.station_at(times))

    def _since(self, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        number = np.clip(np.searchsorted(self.times, at, side="right") - 1, 0, None)
        return number, at - self.times[number]

    def _accelerations(self) -> np.ndarray:
        lasting = np.diff(self.times)
        change = np.diff(self.speeds)
        rates = np.divide(change, lasting, out=np.zeros(len(change)), where=lasting > 0)
        return np.append(rates, 0.0)


def fastest_profile(
    path: MachinePath, limits: np.ndarray | float, acceleration: float
) -> TimedPath:
    """The exact least-time drive along a path from rest to rest, which starts at time zero.

    Args:
        path: The path; the machine stops at its cusps.
        limits: Largest speed on each piece, one number or shape (n - 1,) [m/s].
        acceleration: Largest acceleration, speeding up and slowing down [m/s^2].

    Raises:
        InvalidInput: A limit or the acceleration is not positive.
    """
    require_positive("acceleration", acceleration)
    fastest = np.broadcast_to(np.asarray(limits, dtype=float), path.lengths.shape)
    require(bool((fastest > 0).all()), "limits", "be positive", fastest.min(initial=np.inf))
    stations = np.unique(path.stations)
    allowed = fastest[path.piece_at((stations[:-1] + stations[1:]) / 2)]
    squares = np.minimum(np.append(allowed, np.inf), np.append(np.inf, allowed)) ** 2
    squares[np.searchsorted(stations, [0.0, *path.cusps, path.length])] = 0.0
    keep_acceleration(squares, 2 * acceleration * np.diff(stations))
    return _timed(path, stations, squares, allowed, acceleration)


def cornering_limits(
    curvatures: np.ndarray, speed: float, lateral_acceleration: float
) -> np.ndarray:
    """Speeds at which bends may be driven, shape (...) [m/s].

    Args:
        curvatures: Shape (...) [1/m].
        speed: On straights [m/s].
        lateral_acceleration: Largest across the way [m/s^2].
    """
    bends = np.maximum(np.abs(curvatures), 1e-6)
    return np.minimum(speed, np.sqrt(lateral_acceleration / bends))


def runs_of(flags: np.ndarray) -> list[tuple[int, int]]:
    """Index of the first flag of each run of true flags, shape (n,), and one after its last."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags.astype(bool), [False]])))
    return [(int(first), int(behind)) for first, behind in edges.reshape(-1, 2)]


@compiled
def keep_acceleration(squares, gains):
    """Lower squared speeds until each can be reached from the one before and braked to the next.

    Args:
        squares: Squared speeds at stations, lowered in place, shape (n,) [m^2/s^2].
        gains: Largest change from each station to the next, shape (n - 1,) [m^2/s^2].
    """
    for k in range(len(gains)):
        squares[k + 1] = min(squares[k + 1], squares[k] + gains[k])
    for k in range(len(gains) - 1, -1, -1):
        squares[k] = min(squares[k], squares[k + 1] + gains[k])


def _timed(path, stations, squares, allowed, acceleration) -> TimedPath:
    """The timed path with the phases between stations: speeding up, even speed, slowing down."""
    ways = np.diff(stations)
    first, last = squares[:-1], squares[1:]
    top = np.minimum(allowed**2, (first + last) / 2 + acceleration * ways)
    top = np.maximum(top, np.maximum(first, last))
    peaks, speeds = np.sqrt(top), np.sqrt(squares)
    faster, slower = (top - first) / (2 * acceleration), (top - last) / (2 * acceleration)
    even = np.maximum(ways - faster - slower, 0.0)
    lasting = np.stack(
        [
            (peaks - speeds[:-1]) / acceleration,
            np.divide(even, peaks, out=np.zeros(len(ways)), where=peaks > 0),
            (peaks - speeds[1:]) / acceleration,
        ],
        axis=1,
    ).ravel()
    # Where a machine speeds up all along a piece, rounding could end that phase beyond its end.
    gained = np.minimum(stations[:-1] + faster, stations[1:])
    ends = np.stack([gained, np.maximum(stations[1:] - slower, gained), stations[1:]], axis=1)
    passed = np.stack([peaks, peaks, speeds[1:]], axis=1)
    # Phases that take no time are left out.
    kept = lasting > 0
    return TimedPath(
        path,
        np.append(0.0, np.cumsum(lasting[kept])),
        np.append(stations[0], ends.ravel()[kept]),
        np.append(speeds[0], passed.ravel()[kept]),
    )
