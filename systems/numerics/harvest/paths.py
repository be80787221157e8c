"""Paths of machines, when a machine is where on its own, and the fastest way to drive it.

Between poses a machine moves by a constant twist, between times by a constant acceleration.

**The fastest way** within speed limits and an acceleration: before each station the machine has
to be slow enough for all limits and stops ahead of it, and no faster than it can have become since
those behind. The squared speeds at which it can pass the stations where limits change follow from
one pass forwards and one backwards; between two of them it speeds up, drives at the limit where it
reaches it, and slows down.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from ..compiled import compiled
from ..errors import require, require_non_negative, require_positive

# The number of work of what is driven between two pieces of work.
TRANSIT = -1


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
        work: Number of the piece of work that each piece belongs to, or TRANSIT; shape (n - 1,).

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
        work: int = TRANSIT,
    ) -> Self:
        """A path on which the header is up or down all the way, for one piece of work.

        Args:
            poses: x, y, theta, shape (n, 3) [m], [m], [rad].
            gears: Of each piece, or of all.
            cutting: Whether the header is down.
            work: Number of the piece of work.
        """
        count = len(poses) - 1
        told = np.full(count, gears, dtype=int), np.full(count, cutting), np.full(count, work)
        return cls(np.asarray(poses, dtype=float), *told)

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
        piece = self.piece_at(at)
        length = self.lengths[piece]
        driven = at - self.stations[piece]
        share = np.divide(driven, length, out=np.zeros(at.shape), where=length > 0)
        begin, end = self.poses[piece], self.poses[piece + 1]
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

    def stations_every(self, spacing: float) -> np.ndarray:
        """Evenly spaced stations from the first to the last, no farther apart than told.

        Args:
            spacing: [m].
        """
        count = max(1, int(np.ceil(self.length / spacing - 1e-9)))
        return np.linspace(0.0, self.length, count + 1)


def join_paths(paths: Sequence[MachinePath]) -> MachinePath:
    """Paths of which each begins where the one before it ends, as one.

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
        path: Where.
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
    path: MachinePath,
    limits: np.ndarray | float,
    acceleration: float,
    *,
    stops: Sequence[float] | np.ndarray = (),
    dwells: Sequence[float] | np.ndarray | float = 0.0,
    end_speeds: tuple[float, float] = (0.0, 0.0),
    begin: float = 0.0,
) -> TimedPath:
    """Drive a path in the least time; it is exact.

    Args:
        path: Where; the machine stops at its cusps.
        limits: Largest speed on each piece, one number or shape (n - 1,) [m/s].
        acceleration: Largest, speeding up and slowing down [m/s^2].
        stops: Stations at which it stops as well, shape (k,) [m].
        dwells: How long it stands at each of the stops, one number or shape (k,) [s].
        end_speeds: At the first and the last station [m/s].
        begin: When it is at the first station [s].

    Raises:
        InvalidInput: A limit or the acceleration is not positive, a stop is not on the path, a
            dwell is negative, or the machine cannot slow down from its first speed, or speed up to
            its last one.
    """
    require_positive("acceleration", acceleration)
    count = len(path.lengths)
    fastest = np.broadcast_to(np.asarray(limits, dtype=float), (count,))
    require(bool((fastest > 0).all()), "limits", "be positive", fastest.min(initial=np.inf))
    halts = np.asarray(stops, dtype=float)
    outside = halts[(halts < 0) | (halts > path.length)]
    require(not len(outside), "stops", f"be from 0 to {path.length:.6g} m", outside[:1])
    standing = np.broadcast_to(np.asarray(dwells, dtype=float), halts.shape)
    require(bool((standing >= 0).all()), "dwells", "be zero or positive", standing.min(initial=0))
    for speed in end_speeds:
        require_non_negative("end_speeds", speed)
    stations = np.unique(np.concatenate([path.stations, halts]))
    middles = (stations[:-1] + stations[1:]) / 2
    allowed = fastest[path.piece_at(middles)] if count else np.zeros(0)
    squares = _largest_squares(path, stations, allowed, halts)
    squares[[0, -1]] = np.minimum(squares[[0, -1]], np.square(end_speeds))
    keep_acceleration(squares, 2 * acceleration * np.diff(stations))
    told = np.array(end_speeds)
    reached = np.sqrt(squares[[0, -1]])
    possible = bool((np.abs(reached - told) <= 1e-9).all())
    require(possible, "end_speeds", "be within the limits", f"{told}, {reached} can be reached")
    waits = np.zeros(len(stations))
    np.add.at(waits, np.searchsorted(stations, halts), standing)
    return _timed(path, stations, squares, allowed, acceleration, waits, begin)


def cornering_limits(
    path: MachinePath, speed: float, lateral_acceleration: float = np.inf
) -> np.ndarray:
    """Speed at which each piece may be driven for what it bends, shape (n - 1,) [m/s].

    Args:
        path: Its pieces.
        speed: On straights [m/s].
        lateral_acceleration: Largest across the way [m/s^2].

    Raises:
        InvalidInput: The speed is not positive.
    """
    require_positive("speed", speed)
    bends = np.abs(path.curvatures)
    square = np.divide(
        lateral_acceleration, bends, out=np.full(len(bends), np.inf), where=bends > 0
    )
    return np.minimum(speed, np.sqrt(square))


def _largest_squares(path, stations, allowed, halts) -> np.ndarray:
    """Squared speeds that the limits and the stops allow at the stations."""
    least = np.full(len(stations), np.inf)
    least[:-1] = allowed
    least[1:] = np.minimum(least[1:], allowed)
    least[np.searchsorted(stations, np.concatenate([path.cusps, halts]))] = 0.0
    return least**2


@compiled
def keep_acceleration(squares, gains):
    """Lower squared speeds to what can be reached from before and braked for what comes.

    Args:
        squares: At stations, lowered, shape (n,) [m^2/s^2].
        gains: Most that they change from each to the next, shape (n - 1,) [m^2/s^2].
    """
    for k in range(len(gains)):
        squares[k + 1] = min(squares[k + 1], squares[k] + gains[k])
    for k in range(len(gains) - 1, -1, -1):
        squares[k] = min(squares[k], squares[k + 1] + gains[k])


def _timed(path, stations, squares, allowed, acceleration, waits, begin) -> TimedPath:
    """Times, stations and speeds of the phases between stations: faster, even, slower, standing."""
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
            waits[1:],
        ],
        axis=1,
    )
    ends = np.stack(
        [
            stations[:-1] + faster,
            np.maximum(stations[1:] - slower, stations[:-1] + faster),
            stations[1:],
            stations[1:],
        ],
        axis=1,
    )
    passed = np.stack([peaks, peaks, speeds[1:], speeds[1:]], axis=1)
    # Phases that take no time are left out.
    kept = lasting.ravel() > 0
    lasting, ends, passed = lasting.ravel()[kept], ends.ravel()[kept], passed.ravel()[kept]
    if waits[0] > 0:
        lasting = np.append(waits[0], lasting)
        ends, passed = np.append(stations[0], ends), np.append(speeds[0], passed)
    return TimedPath(
        path,
        begin + np.append(0.0, np.cumsum(lasting)),
        np.append(stations[0], ends),
        np.append(speeds[0], passed),
    )
