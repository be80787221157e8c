"""The machines of a plan, packed for compiled functions: where they are when, and what they cut.

Also: poses of machines on their paths, and the controls that keep tractors on theirs.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...compiled import compiled, kernel
from ..carts.cart_plan import Trip
from ..paths import MachinePath, TimedPath, cornering_limits, fastest_profile
from .orders import PASSED, last_below
from .planned_work import PIECE, PlannedWork

# How far ahead a tractor aims back at its path when it is beside it [m].
AIM = 4.0
# Part of an error along the path that is corrected in a step, and the largest part of the step that
# this may come to, so that speeds hardly change; no unit.
ALONG, MOST = 0.3, 0.1


class Pieces(NamedTuple):
    """Motions of constant acceleration, machine by machine.

    Attributes:
        starts: Where those of each machine begin, shape (M + 1,).
        times: Shape (k,) [s].
        stations: Shape (k,) [m].
        speeds: Shape (k,) [m/s].
    """

    starts: np.ndarray
    times: np.ndarray
    stations: np.ndarray
    speeds: np.ndarray


class FleetArrays(NamedTuple):
    """M machines, N of them combines, as `advance` needs them.

    Attributes:
        combines: Their number N.
        planned: Their plans.
        fastest: How they could drive their paths if they were alone.
        halts_at: Where the halts of each machine begin, shape (M + 1,).
        halts: Stations at which it changes gear, and its last, shape (h,) [m].
        brakes: Largest acceleration of each, shape (M,) [m/s^2].
        trips_at: Where the trips of each machine begin, shape (M + 1,).
        trips: Stations at trucks, one for each truck that takes from a cart, shape (j,) [m].
        flows: When grain begins and ceases to flow there; infinite if it flows as soon as the cart
            is there, or until it is empty, shape (j, 2) [s].
        grain_at: Where the grain of each combine begins, shape (N + 1,).
        grain: Cut up to stations PIECE apart, shape (g,) [kg].
        capacities: Of the tanks, shape (N,) [kg].
        unload_rates: Of the augers, shape (N,) [kg/s].
        spill: Whether each combine goes on when it is full, shape (N,).
    """

    combines: int
    planned: Pieces
    fastest: Pieces
    halts_at: np.ndarray
    halts: np.ndarray
    brakes: np.ndarray
    trips_at: np.ndarray
    trips: np.ndarray
    flows: np.ndarray
    grain_at: np.ndarray
    grain: np.ndarray
    capacities: np.ndarray
    unload_rates: np.ndarray
    spill: np.ndarray


def pack_fleet(work: PlannedWork) -> FleetArrays:
    """Pack the machines of a plan."""
    combines, cart, timed = work.combines, work.cart, work.timed
    count = len(work.plans)
    fastest = []
    for m, each in enumerate(timed):
        if m < count:
            limits, rate = combines[m].speed, combines[m].acceleration
        else:
            limits = cornering_limits(each.path.curvatures, cart.speed, cart.lateral_acceleration)
            rate = cart.acceleration
        fastest.append(fastest_profile(each.path, limits, rate))
    halts = [np.append(each.path.cusps, each.path.length) for each in timed]
    trips, flows = [], []
    for m, path in enumerate(timed):
        own = [trip for trip in work.trips if trip.cart == m - count]
        at = [float(path.station_at(trip.begin)) for trip in own for _ in trip.fillings]
        trips.append(np.array(at, dtype=float))
        flows.append(np.array([flow for trip in own for flow in _flows(trip)]).reshape(-1, 2))
    return FleetArrays(
        count,
        _packed(timed),
        _packed(fastest),
        _starts(halts),
        np.concatenate(halts),
        np.array([*(c.acceleration for c in combines), *[cart.acceleration] * len(work.motions)]),
        _starts(trips),
        np.concatenate(trips),
        np.concatenate(flows),
        _starts(work.grain),
        np.concatenate(work.grain).astype(float),
        np.array([c.capacity for c in combines], dtype=float),
        np.array([c.unload_rate for c in combines], dtype=float),
        np.array([c.when_full == "spill" for c in combines]),
    )


def _flows(trip: Trip) -> list[tuple[float, float]]:
    """When grain begins and ceases to flow from a cart into each truck [s]."""
    found = [(each.begin, each.end) for each in trip.fillings]
    if found[0][0] <= trip.begin:
        found[0] = (-np.inf, found[0][1])
    found[-1] = (found[-1][0], np.inf)
    return found


def _starts(arrays: Sequence[np.ndarray]) -> np.ndarray:
    return np.concatenate([[0], np.cumsum([len(each) for each in arrays])]).astype(np.int64)


def _packed(timed: Sequence[TimedPath]) -> Pieces:
    names = ("times", "stations", "speeds")
    columns = [np.concatenate([getattr(each, name) for each in timed]) for name in names]
    return Pieces(_starts([each.times for each in timed]), *columns)


@kernel
def cut_up_to(fleet, n, station):
    """Grain that a combine has cut by a station [kg].

    Args:
        fleet: The machines.
        n: Number of the combine.
        station: [m].
    """
    low, last = fleet.grain_at[n], fleet.grain_at[n + 1] - 1
    at = min(max(station / PIECE, 0.0), float(last - low))
    k = min(int(at), last - low - 1)
    if k < 0:
        return fleet.grain[low]
    length = PIECE
    if low + k + 1 == last:
        length = fleet.halts[fleet.halts_at[n + 1] - 1] - PIECE * k
    share = min(max((station - PIECE * k) / length, 0.0), 1.0) if length > 0 else 1.0
    return fleet.grain[low + k] + share * (fleet.grain[low + k + 1] - fleet.grain[low + k])


@kernel
def planned_at(pieces, m, time):
    """Station and speed of machine m at a time [m], [m/s].

    Args:
        pieces: Of all machines.
        m: Number of the machine.
        time: [s].
    """
    low, high = pieces.starts[m], pieces.starts[m + 1]
    k = last_below(pieces.times, low, high, time)
    if k < low:
        return pieces.stations[low], 0.0
    if k == high - 1:
        return pieces.stations[k], 0.0
    lasting = pieces.times[k + 1] - pieces.times[k]
    since = time - pieces.times[k]
    rate = (pieces.speeds[k + 1] - pieces.speeds[k]) / lasting
    speed = max(pieces.speeds[k] + rate * since, 0.0)
    way = pieces.stations[k] + since * (pieces.speeds[k] + rate * since / 2)
    return min(max(way, pieces.stations[k]), pieces.stations[k + 1]), speed


@kernel
def planned_time(pieces, m, station):
    """When machine m leaves a station [s].

    Args:
        pieces: Of all machines.
        m: Number of the machine.
        station: [m].
    """
    low, high = pieces.starts[m], pieces.starts[m + 1]
    k = max(last_below(pieces.stations, low, high, station + PASSED), low)
    time = pieces.times[k]
    way = station - pieces.stations[k]
    if k == high - 1 or way <= 0.0:
        return time
    lasting = pieces.times[k + 1] - time
    rate = (pieces.speeds[k + 1] - pieces.speeds[k]) / lasting if lasting > 0.0 else 0.0
    root = pieces.speeds[k]
    root += np.sqrt(max(pieces.speeds[k] ** 2 + 2 * rate * way, 0.0))
    return time + (min(2 * way / root, lasting) if root > 0.0 else lasting)


@kernel
def fastest_at(pieces, m, station):
    """Speed at which machine m may be at a station, if it is alone [m/s].

    Args:
        pieces: How machines drive alone.
        m: Number of the machine.
        station: [m].
    """
    low, high = pieces.starts[m], pieces.starts[m + 1]
    k = last_below(pieces.stations, low, high, station)
    if k < low or k == high - 1:
        return 0.0
    way = pieces.stations[k + 1] - pieces.stations[k]
    first, last = pieces.speeds[k] ** 2, pieces.speeds[k + 1] ** 2
    return np.sqrt(first + (last - first) * (station - pieces.stations[k]) / way)


@compiled
def at_trucks(fleet, stations, load, now):
    """Whether each cart stands with grain where a truck takes it now, 1 or 0, shape (K,).

    Trucks come when they are to, and wait for carts that are late.

    Args:
        fleet: The machines.
        stations: Of carts, shape (K,) [m].
        load: In each, shape (K,) [kg].
        now: [s].
    """
    found = np.zeros(len(stations))
    for k in range(len(stations)):
        m = fleet.combines + k
        for j in range(fleet.trips_at[m], fleet.trips_at[m + 1]):
            here = abs(fleet.trips[j] - stations[k]) <= 2 * PASSED
            if here and load[k] > 0.0 and fleet.flows[j, 0] <= now < fleet.flows[j, 1]:
                found[k] = 1.0
    return found


@compiled
def lateness(fleet, stations, now):
    """How long ago each machine should have left where it is, shape (M,) [s].

    It is zero once a machine has arrived.

    Args:
        fleet: The machines.
        stations: Of all machines, shape (M,) [m].
        now: [s].
    """
    found = np.zeros(len(stations))
    for m in range(len(stations)):
        if stations[m] >= fleet.planned.stations[fleet.planned.starts[m + 1] - 1] - PASSED:
            continue
        time = planned_time(fleet.planned, m, stations[m])
        found[m] = max(now - time, 0.0)
    return found


class Tracks(NamedTuple):
    """Paths of machines, one after the other; see `MachinePath`.

    Attributes:
        starts: Index of the first pose of each, and the total number last, shape (M + 1,).
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
    """Pack paths into one set of arrays."""

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
def steer(tracks, states, stations, after, period, across_most):
    """Speeds and turn rates that bring tractors along their paths in a step.

    Held for the step, they drive the arc of the path. To that is added a turn back to the path of
    atan(e / AIM) for an error e across it, and a correction of the error along it. In a bend that
    is driven as fast as allowed, no faster turn is possible: the error is corrected after the bend.

    Args:
        tracks: Of the tractors' rear axles.
        states: x, y, theta, beta of each, shape (K, 4) [m], [m], [rad], [rad].
        stations: Where they should be, shape (K,) [m].
        after: Where they should be after the step, shape (K,) [m].
        period: Of the step [s].
        across_most: Largest acceleration across the heading [m/s^2].

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
        speed = (way + mended) / period
        quickest = across_most / speed
        control[2 * k] = gear * speed
        control[2 * k + 1] = min(max(turn / period, -quickest), quickest)
    return control
