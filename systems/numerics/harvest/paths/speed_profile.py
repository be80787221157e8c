"""The fastest way to drive a path within speed limits and an acceleration.

Before each station the machine has to be slow enough for all limits and stops ahead of it, and no
faster than it can have become since those behind. The squared speeds at which it can pass the
stations where limits change follow from one pass forwards and one backwards; between two of them it
speeds up, drives at the limit where it reaches it, and slows down.
"""

from collections.abc import Sequence

import numpy as np

from ...compiled import compiled
from ...errors import require, require_non_negative, require_positive
from .machine_path import MachinePath
from .timed_path import TimedPath


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
    _reach(squares, 2 * acceleration * np.diff(stations))
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
def _reach(squares, gains):
    """Lower squared speeds to what can be reached from before and braked for what comes."""
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
