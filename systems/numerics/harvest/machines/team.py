"""A team of combines at work, for one step."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...compiled import compiled
from ..field.combine_path import CombinePath
from ..field.pace.holds import limits_of
from .filling import MODE, STATION, WAITING, advance_combine


class PackedPaths(NamedTuple):
    """The paths of a team, one after the other.

    Attributes:
        starts: Where each path's samples begin, shape (N + 1,).
        stations: Shape (n,) [m].
        poses: x, y, theta, theta unwrapped, shape (n, 3).
        grain: Cut from each sample to the next; 0 from a path to the next; shape
            (n,) [kg].
    """

    starts: np.ndarray
    stations: np.ndarray
    poses: np.ndarray
    grain: np.ndarray


def pack_paths(paths: Sequence[CombinePath], density: float) -> PackedPaths:
    """Paths in arrays, with the grain of a crop of a density [kg/m^2]."""
    starts = np.cumsum([0, *(len(path.stations) for path in paths)]).astype(np.int64)
    poses = [np.column_stack([path.points, np.unwrap(path.headings)]) for path in paths]
    grain = [np.append(density * path.cut_area, 0.0) for path in paths]
    stations = np.concatenate([path.stations for path in paths])
    return PackedPaths(starts, stations, np.concatenate(poses), np.concatenate(grain))


@compiled
def advance_team(
    accounts,
    paths,
    holds,
    begins,
    speed,
    capacity,
    unload_rate,
    alongside,
    room,
    halt,
    spill,
    time,
    step,
):
    """Let a team of combines work for a step.

    Args:
        accounts: Of the combines, changed, shape (N, 8).
        paths: Packed.
        holds: Packed.
        begins: When each sets out, shape (N,) [s].
        speed: [m/s].
        capacity: Of a tank [kg].
        unload_rate: Of an auger [kg/s].
        alongside: Number of the cart that each one unloads into, or -1, shape (N,).
        room: In each cart, shape (K,) [kg].
        halt: 1 for those that have to stop, shape (N,).
        spill: Whether full combines go on.
        time: At the beginning [s].
        step: [s].

    Returns:
        What each cart took over, shape (K,) [kg].
    """
    given = np.zeros(len(room))
    limits = limits_of(holds, accounts[:, STATION].copy())
    for n in range(len(accounts)):
        if time + 1e-9 < begins[n]:
            accounts[n, MODE] = WAITING
            continue
        low, high = paths.starts[n], paths.starts[n + 1]
        if halt[n] > 0.5:
            limits[n] = accounts[n, STATION]
        cart = int(alongside[n])
        rate = unload_rate if cart >= 0 else 0.0
        free = room[cart] - given[cart] if cart >= 0 else 0.0
        amount = advance_combine(
            accounts[n],
            paths.stations[low:high],
            paths.grain[low:high],
            speed,
            max(limits[n], accounts[n, STATION]),
            capacity,
            rate,
            free,
            spill,
            step,
        )
        if cart >= 0:
            given[cart] += amount
    return given


@compiled
def poses_of(paths, stations):
    """x, y, theta of every combine at its station, shape (N,) -> (3 N,).

    Args:
        paths: Packed.
        stations: Shape (N,) [m].
    """
    poses = np.empty(3 * len(stations))
    for n in range(len(stations)):
        low, high = paths.starts[n], paths.starts[n + 1]
        k = low + np.searchsorted(paths.stations[low:high], stations[n], side="right") - 1
        k = min(max(k, low), high - 2)
        step = paths.stations[k + 1] - paths.stations[k]
        share = min(max((stations[n] - paths.stations[k]) / step, 0.0), 1.0)
        poses[3 * n : 3 * n + 3] = paths.poses[k] + share * (paths.poses[k + 1] - paths.poses[k])
    return poses
