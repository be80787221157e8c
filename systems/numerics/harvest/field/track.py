"""A track: a line that is driven forwards and backwards, as points with headings."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...planning.car_path import CarPath

# Two poses closer than this are one [m].
SAME = 1e-9


@dataclass(frozen=True, eq=False)
class Track:
    """Poses in the order in which they are driven through.

    Attributes:
        points: Shape (n, 2) [m].
        headings: Continuous, not wrapped, shape (n,) [rad].
        gears: Of each piece: 1 forwards, -1 backwards; shape (n - 1,).
    """

    points: np.ndarray
    headings: np.ndarray
    gears: np.ndarray

    @property
    def length(self) -> float:
        """Way driven, forwards and backwards [m]."""
        return float(np.hypot(*np.diff(self.points, axis=0).T).sum())

    @property
    def start(self) -> tuple[float, float, float]:
        """Its first pose [m], [m], [rad]."""
        return float(self.points[0, 0]), float(self.points[0, 1]), float(self.headings[0])

    @property
    def end(self) -> tuple[float, float, float]:
        """Its last pose [m], [m], [rad]."""
        return float(self.points[-1, 0]), float(self.points[-1, 1]), float(self.headings[-1])

    def reversed(self) -> "Track":
        """The same way back, in the other gear."""
        return Track(self.points[::-1], self.headings[::-1], -self.gears[::-1])


def forward_track(points: np.ndarray, headings: np.ndarray) -> Track:
    """A track driven forwards all the way.

    Args:
        points: Shape (n, 2) [m].
        headings: Shape (n,) [rad].
    """
    return Track(points, np.unwrap(headings), np.ones(len(points) - 1, dtype=int))


def straight_track(start: Sequence[float], length: float) -> Track:
    """A straight from a pose: x, y, theta; backwards if the length is negative [m].

    Args:
        start: x, y, theta [m], [m], [rad].
        length: [m].
    """
    x, y, theta = start
    points = np.array([[x, y], [x + length * np.cos(theta), y + length * np.sin(theta)]])
    return Track(points, np.full(2, theta), np.array([1 if length >= 0 else -1]))


def car_track(path: CarPath, step: float) -> Track:
    """A car's path with its arcs in pieces of one step at most [m]."""
    points, headings, gears = [np.array([path.start[:2]])], [np.array([path.start[2]])], []
    driven = 0.0
    for turn, length in zip(path.turns, path.lengths, strict=True):
        if abs(length) <= SAME:
            continue
        count = max(1, int(np.ceil(abs(length) / step))) if turn else 1
        poses = path.poses(driven + abs(length) * np.arange(1, count + 1) / count)
        points.append(poses[:, :2])
        headings.append(poses[:, 2])
        gears.append(np.full(count, 1 if length > 0 else -1))
        driven += abs(length)
    if not gears:
        return Track(np.array([path.start[:2]]), np.array([path.start[2]]), np.zeros(0, dtype=int))
    return Track(np.concatenate(points), np.concatenate(headings), np.concatenate(gears))


def join_tracks(tracks: Sequence[Track]) -> Track:
    """Tracks of which each begins where the one before it ends, as one."""
    points, headings, gears = [tracks[0].points], [tracks[0].headings], [tracks[0].gears]
    for track in tracks[1:]:
        whole_turns = np.round((headings[-1][-1] - track.headings[0]) / (2 * np.pi))
        points.append(track.points[1:])
        headings.append(track.headings[1:] + 2 * np.pi * whole_turns)
        gears.append(track.gears)
    return Track(np.concatenate(points), np.concatenate(headings), np.concatenate(gears))


def split_track(track: Track, longest: float) -> tuple[Track, np.ndarray]:
    """A track with its pieces cut so that none is longer than told.

    Args:
        track: Which.
        longest: Length of a piece [m].

    Returns:
        The track, and of each of its pieces the number of the piece that it was, shape (n - 1,).
    """
    lengths = np.hypot(*np.diff(track.points, axis=0).T)
    counts = np.maximum(1, np.ceil(lengths / longest - 1e-9)).astype(int)
    old = np.repeat(np.arange(len(counts)), counts)
    within = np.concatenate([np.arange(count) / count for count in counts] or [np.zeros(0)])
    at = np.append(old + within, len(counts))
    number = np.arange(len(track.points))
    points = np.stack([np.interp(at, number, column) for column in track.points.T], axis=1)
    return Track(points, np.interp(at, number, track.headings), track.gears[old]), old


def turn_track(start: Sequence[float], turn: float, radius: float) -> Track:
    """An arc forwards from a pose, to the left if the turn is positive [rad].

    Args:
        start: x, y, theta [m], [m], [rad].
        turn: [rad].
        radius: [m].
    """
    x, y, theta = map(float, start)
    way = radius * abs(turn)
    path = CarPath((x, y, theta), (1 if turn > 0 else -1,), (way,), radius)
    return car_track(path, radius / 16)
