"""Poses on the paths of many machines, compiled, and the controls that keep tractors on theirs."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...compiled import compiled, kernel
from ..paths.machine_path import MachinePath
from .last_below import last_below

# How far ahead a tractor aims back at its path when it is beside it [m].
AIM = 4.0
# Part of an error along the path that is made good in a step, and the part of the step that this
# may come to, so that speeds hardly change; no unit.
ALONG, MOST = 0.3, 0.1


class Tracks(NamedTuple):
    """Paths of machines, one after the other; see `MachinePath`.

    Attributes:
        starts: Where the poses of each begin, and their number last, shape (M + 1,).
        stations: Of the poses, shape (p,) [m].
        poses: Shape (p, 3) [m], [m], [rad].
        gears: Of the piece that begins at each pose, shape (p,).
        cutting: Likewise, 1 where the header is down, shape (p,).
    """

    starts: np.ndarray
    stations: np.ndarray
    poses: np.ndarray
    gears: np.ndarray
    cutting: np.ndarray


def pack_tracks(paths: Sequence[MachinePath]) -> Tracks:
    """Paths in one piece."""

    def pieces(values: np.ndarray) -> np.ndarray:
        # At its last pose a machine is as on its last piece.
        last = values[-1:] if len(values) else np.zeros(1)
        return np.append(values, last).astype(float)

    return Tracks(
        np.concatenate([[0], np.cumsum([len(path.poses) for path in paths])]).astype(np.int64),
        np.concatenate([path.stations for path in paths]),
        np.concatenate([path.poses for path in paths]),
        np.concatenate([pieces(path.gears) for path in paths]),
        np.concatenate([pieces(path.cutting) for path in paths]),
    )


@kernel
def _piece(tracks, m, station):
    low, high = tracks.starts[m], tracks.starts[m + 1] - 1
    return max(last_below(tracks.stations, low, high, station), low)


@kernel
def pose_on(tracks, m, station):
    """Pose of machine m at a station: x, y, theta [m], [m], [rad].

    Args:
        tracks: Of all machines.
        m: Number of the machine.
        station: [m].
    """
    k = _piece(tracks, m, station)
    x, y, theta = tracks.poses[k, 0], tracks.poses[k, 1], tracks.poses[k, 2]
    if k + 1 >= tracks.starts[m + 1]:
        return x, y, theta
    length = tracks.stations[k + 1] - tracks.stations[k]
    if length <= 0.0:
        return x, y, theta
    share = min(max((station - tracks.stations[k]) / length, 0.0), 1.0)
    turned = tracks.poses[k + 1, 2] - theta
    along = np.arctan2(tracks.poses[k + 1, 1] - y, tracks.poses[k + 1, 0] - x)
    direction = along - turned * (1 - share) / 2
    half = turned * share / 2
    chord = share * length * (np.sin(half) / half if abs(half) > 1e-12 else 1.0)
    return x + chord * np.cos(direction), y + chord * np.sin(direction), theta + share * turned


@compiled
def poses_on(tracks, stations):
    """Poses of all machines, one after the other, shape (3 M,) [m], [m], [rad].

    Args:
        tracks: Of all machines.
        stations: Where they are, shape (M,) [m].
    """
    poses = np.empty(3 * len(stations))
    for m in range(len(stations)):
        x, y, theta = pose_on(tracks, m, stations[m])
        poses[3 * m], poses[3 * m + 1], poses[3 * m + 2] = x, y, theta
    return poses


@compiled
def cutting_on(tracks, stations):
    """Whether headers are down, 1 or 0, shape (M,).

    Args:
        tracks: Of all machines.
        stations: Where they are, shape (M,) [m].
    """
    found = np.empty(len(stations))
    for m in range(len(stations)):
        found[m] = tracks.cutting[_piece(tracks, m, stations[m])]
    return found


@compiled
def steer(tracks, states, stations, after, period):
    """Speeds and turn rates that bring tractors along their paths in a step.

    Held for the step they drive the arc of the path; to that is added what turns the tractor back
    to the path, atan(e / AIM) for an error e across, and what makes good an error along.

    Args:
        tracks: Of the tractors' rear axles.
        states: x, y, theta, beta of each, shape (K, 4) [m], [m], [rad], [rad].
        stations: Where they should be, shape (K,) [m].
        after: Where they should be after the step, shape (K,) [m].
        period: Of the step [s].

    Returns:
        Tractor by tractor, shape (2 K,) [m/s], [rad/s].
    """
    control = np.zeros(2 * len(stations))
    for k in range(len(stations)):
        way = after[k] - stations[k]
        if way <= 0.0:
            continue
        x, y, theta = pose_on(tracks, k, stations[k])
        there = pose_on(tracks, k, after[k])[2]
        gear = tracks.gears[_piece(tracks, k, (stations[k] + after[k]) / 2)]
        c, s = np.cos(theta), np.sin(theta)
        dx, dy = states[k, 0] - x, states[k, 1] - y
        along, across = c * dx + s * dy, c * dy - s * dx
        mended = min(max(-ALONG * gear * along, -MOST * way), MOST * way)
        back = gear * np.arctan(across / AIM) * min(1.0, way)
        turn = (there - back - states[k, 2] + np.pi) % (2 * np.pi) - np.pi
        control[2 * k] = gear * (way + mended) / period
        control[2 * k + 1] = turn / period
    return control
