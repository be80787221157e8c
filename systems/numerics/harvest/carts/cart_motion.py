"""A cart on its way: its trailer by exact kinematics, and its times among moving machines.

**Times for a given path**, as early, or as late, as accelerations allow: the plane of stations and
times is divided into cells. A cell is closed if the cart would be too near to others there, or on
ground that is not open yet. From one station to the next the acceleration is constant, and both
stations must be open for as long as that takes. A cart waits by standing. From station to station,
the earliest time of each speed in each open interval is kept.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ...compiled import compiled
from ...planning.trailer import half_angle_map, half_angles, trailer_pose
from ..machines import Cart
from ..paths import MachinePath, TimedPath, join_paths

# Distance of stations, and of moments at which they are open or closed [m], [s].
WAY, MOMENT = 0.5, 0.25
# Approximate spacing of the squares of speeds [m^2/s^2].
SQUARES = 0.2
# Open intervals of a station that are kept, at most.
INTERVALS = 12


def trailer_angles(path: MachinePath, cart: Cart, beta: float, stations: np.ndarray) -> np.ndarray:
    """Angles from the trailer's heading to the tractor's at stations, in (-pi, pi] [rad].

    They depend on where the tractor drove, never on how fast.

    Args:
        path: Of the tractor.
        cart: The cart, whose trailer matters.
        beta: The angle at the first station [rad].
        stations: In any order, shape (n,) [m].
    """
    at = np.clip(np.asarray(stations, dtype=float), 0.0, path.length)
    if len(path.lengths) == 0:
        return np.full(at.shape, beta)
    whole = half_angle_map(cart.trailer, path.gears, path.curvatures, path.lengths)
    begins = np.empty((len(whole), 2))
    pair = half_angles(beta)
    for k, each in enumerate(whole):
        begins[k] = pair
        pair = each @ pair
        pair /= math.hypot(*pair)
    piece = path.piece_at(at)
    ways = at - path.stations[piece]
    maps = half_angle_map(cart.trailer, path.gears[piece], path.curvatures[piece], ways)
    pairs = np.einsum("nij,nj->ni", maps, begins[piece])
    return np.remainder(2 * np.arctan2(pairs[:, 0], pairs[:, 1]) + np.pi, 2 * np.pi) - np.pi


def trailer_poses(poses: np.ndarray, betas: np.ndarray, cart: Cart) -> np.ndarray:
    """Poses of the trailer's axle behind tractors, shape (n, 3).

    Args:
        poses: Of the tractor, shape (n, 3).
        betas: From the trailer's heading to the tractor's, shape (n,) [rad].
        cart: The cart, whose trailer matters.
    """
    x, y, theta = poses.T
    return np.stack(trailer_pose(x, y, theta, betas, cart.trailer), axis=-1)


@dataclass(frozen=True, eq=False)
class CartMotion:
    """Where a cart is at any time.

    Attributes:
        timed: Of the tractor's rear axle.
        cart: Its size.
        beta: From the trailer's heading to the tractor's at the beginning [rad].
    """

    timed: TimedPath
    cart: Cart
    beta: float = 0.0

    @cached_property
    def _table(self) -> tuple[np.ndarray, np.ndarray]:
        path = self.timed.path
        at = np.unique(np.concatenate([path.stations, path.stations_every(0.1)]))
        return at, np.unwrap(trailer_angles(path, self.cart, self.beta, at))

    def angles_at(self, times: np.ndarray) -> np.ndarray:
        """Angle from the trailer's heading to the tractor's at times, shape (n,) [rad].

        Interpolated between stations 0.1 m apart, with errors of 1e-3 rad at most.
        """
        return np.interp(self.timed.station_at(times), *self._table)

    def poses_at(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Poses of tractor and trailer at times, shape (n, 3) each."""
        tractor = self.timed.pose_at(times)
        return tractor, trailer_poses(tractor, self.angles_at(times), self.cart)

    @property
    def last_pose(self) -> np.ndarray:
        """Where the tractor comes to stand, shape (3,)."""
        return self.timed.path.pose_at(self.timed.stations[-1])

    @cached_property
    def last_angle(self) -> float:
        """The trailer's angle where it comes to stand [rad]."""
        return float(self.angles_at(np.array([self.timed.end]))[0])


def poses_along(motions: Sequence[CartMotion], times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Poses of tractor and trailer at times in order, shape (n, 3) each.

    Args:
        motions: At least one, each from where the one before it comes to stand; between them the
            cart stands.
        times: Shape (n,) [s].
    """
    begins = [motion.timed.times[0] for motion in motions[1:]]
    parts = np.split(times, np.searchsorted(times, begins))
    poses = [motion.poses_at(part) for motion, part in zip(motions, parts, strict=True)]
    tractor, trailer = (np.concatenate(each) for each in zip(*poses, strict=True))
    return tractor, trailer


def join_motions(motions: Sequence[CartMotion]) -> CartMotion:
    """Join motions, each of which begins where the one before it ends, at that time or later.

    Between them the cart stands. The trailer follows the whole way from the first angle on.

    Args:
        motions: At least one.
    """
    parts = [motion.timed for motion in motions]
    # A single pose, where a cart stands for a while, adds no piece.
    driven = [part.path for part in parts if len(part.path.lengths)]
    path = join_paths(driven) if driven else parts[0].path
    offsets = np.concatenate([[0.0], np.cumsum([part.path.length for part in parts])])[:-1]
    stations = [part.stations + off for part, off in zip(parts, offsets, strict=True)]
    timed = TimedPath(
        path,
        np.concatenate([part.times for part in parts]),
        # Rounding of the sums must not make stations decrease.
        np.maximum.accumulate(np.concatenate(stations)),
        np.concatenate([part.speeds for part in parts]),
    )
    return CartMotion(timed, motions[0].cart, motions[0].beta)


def standing_motion(cart: Cart, pose: np.ndarray, time: float, beta: float = 0.0) -> CartMotion:
    """A cart that stands.

    Args:
        cart: Its size.
        pose: Of the tractor, shape (3,).
        time: From when on it stands [s].
        beta: From the trailer's heading to the tractor's [rad].
    """
    at = np.array([0.0])
    return CartMotion(TimedPath(MachinePath.of([pose]), np.array([time]), at, at), cart, beta)


class Moving(NamedTuple):
    """When and how fast a cart passes a place.

    Attributes:
        time: [s].
        speed: [m/s].
    """

    time: float
    speed: float


class Passage(NamedTuple):
    """When a cart may be at each station of its path.

    Attributes:
        stations: Equally spaced, shape (n,) [m].
        limits: Highest speed at each, shape (n,) [m/s].
        opens: When the ground under the cart at each is open, shape (n,) [s].
        blocked: Whether each is closed at moments MOMENT apart, shape (n, m).
        begin: The first of these moments [s].
    """

    stations: np.ndarray
    limits: np.ndarray
    opens: np.ndarray
    blocked: np.ndarray
    begin: float


class Profile(NamedTuple):
    """When a cart is at which station, with constant accelerations between.

    Attributes:
        times: Shape (k,) [s].
        stations: Shape (k,) [m].
        speeds: Shape (k,) [m/s].
        reached: If planning failed, how far it got from the end of the path at which it began; else
            the length of the path [m].
    """

    times: np.ndarray
    stations: np.ndarray
    speeds: np.ndarray
    reached: float


def plan_profile(passage: Passage, start: Moving, acceleration: float) -> Profile:
    """The earliest profile from a start to standing at the last station.

    Args:
        passage: When the cart may be where.
        start: When and how fast the cart is at the first station.
        acceleration: Largest [m/s^2].

    Returns:
        The profile; if planning failed, `times` is empty and `reached` tells how far it got.
    """
    begins, ends = _intervals(passage, np.inf)
    return _planned(passage.stations, passage.limits, begins, ends, start, -np.inf, acceleration)


def plan_profile_back(
    passage: Passage, end: Moving, acceleration: float, stands_from: float
) -> Profile:
    """The latest profile from standing at the first station to an end that is met exactly.

    Args:
        passage: When the cart may be where.
        end: When and how fast the cart is at the last station.
        acceleration: Largest [m/s^2].
        stands_from: The cart stands at the first station from then on [s].

    Returns:
        The profile; if planning failed, `times` is empty and `reached` tells how far it got.
    """
    begins, ends = _intervals(passage, end.time + 1.0)
    last = passage.stations[-1]
    found = _planned(
        last - passage.stations[::-1],
        passage.limits[::-1],
        -ends[::-1, ::-1],
        -begins[::-1, ::-1],
        Moving(-end.time, end.speed),
        -stands_from,
        acceleration,
    )
    return Profile(
        -found.times[::-1], last - found.stations[::-1], found.speeds[::-1], found.reached
    )


def _intervals(passage: Passage, end: float) -> np.ndarray:
    """Begins and ends of the open intervals of each station, shape (2, n, k); NaN for none."""
    first, begins, ends = free_intervals(passage.blocked, passage.opens, passage.begin, MOMENT)
    station = np.repeat(np.arange(len(passage.stations)), np.diff(first))
    # The last moment counts for all time to come.
    spans = np.stack([begins, np.where(np.isinf(ends), end, ends)])[:, ends > begins]
    station = station[ends > begins]
    number = np.arange(len(station)) - np.searchsorted(station, station)
    kept = number < INTERVALS
    table = np.full((2, len(passage.stations), 1 + number[kept].max(initial=0)), np.nan)
    table[:, station[kept], number[kept]] = spans[:, kept]
    return table


@compiled
def free_intervals(blocked, opens, begin, step):
    """Intervals in which places are free.

    Args:
        blocked: Of each place at equally spaced moments, shape (n, m); the last counts for ever.
        opens: When the ground there opens, shape (n,) [s].
        begin, step: First moment, and time between them [s].

    Returns:
        Number of the first interval of each place, and their total number, shape (n + 1,); begins
        and ends of the intervals, in order, shape (k,) each [s].
    """
    count, moments = blocked.shape
    first = np.zeros(count + 1, dtype=np.int64)
    begins, ends = [0.0 for _ in range(0)], [0.0 for _ in range(0)]
    for n in range(count):
        row = blocked[n]
        k = 0
        while k < moments and begin + k * step < opens[n]:
            k += 1
        while k < moments:
            if row[k]:
                k += 1
                continue
            begins.append(begin + k * step)
            while k < moments and not row[k]:
                k += 1
            ends.append(np.inf if k == moments else begin + k * step - step)
        first[n + 1] = len(begins)
    return first, np.array(begins), np.array(ends)


def _planned(
    stations: np.ndarray,
    limits: np.ndarray,
    begins: np.ndarray,
    ends: np.ndarray,
    start: Moving,
    until: float,
    acceleration: float,
) -> Profile:
    square = start.speed**2
    step = SQUARES if square < 1e-6 else square / max(1, round(square / SQUARES))
    way = float(stations[1] - stations[0])
    most = int(2 * acceleration * way / step + 1e-9)
    assert most >= 1, "speeds are too coarse for the acceleration"
    first = 0 if square < 1e-6 else round(square / step)
    tops = (np.minimum(limits**2, 1e6) / step + 1e-9).astype(np.int64)
    # The given speed is allowed at the station where planning begins, whatever the limit there.
    tops[0] = max(tops[0], first)
    reached, chain = _earliest(begins, ends, tops, way, step, most, start.time, first, until)
    none = np.zeros(0)
    if len(chain) == 0:
        return Profile(none, none, none, float(reached * way))
    times, at, speeds = chain.T
    return Profile(times, stations[at.astype(int)], speeds, float(stations[-1]))


@compiled
def _earliest(begins, ends, tops, way, step, most, time, first, until):
    """How far the cart gets, and times, stations and speeds on its way to the earliest stop."""
    count, kept = begins.shape
    speeds = np.sqrt(step * np.arange(tops.max() + 1))
    # The intervals of each station begin at `low`: when planning runs backwards, empty entries come
    # before them. Labels are numbered station by station, and there speed by speed.
    low, number = np.zeros(count, dtype=np.int64), np.zeros(count, dtype=np.int64)
    row = np.zeros(count + 1, dtype=np.int64)
    for i in range(count):
        while low[i] < kept and math.isnan(begins[i, low[i]]):
            low[i] += 1
        while low[i] + number[i] < kept and not math.isnan(begins[i, low[i] + number[i]]):
            number[i] += 1
        row[i + 1] = row[i] + (tops[i] + 1) * number[i]
    best = np.full(row[-1], np.inf)
    # Of each label: the one before it, and when that was left.
    before = np.full(row[-1], -1)
    left = np.zeros(row[-1])
    empty = np.zeros((0, 3))
    for k in range(number[0]):
        if begins[0, low[0] + k] - 1e-9 <= time <= ends[0, low[0] + k] + 1e-9:
            best[first * number[0] + k] = time
    reached = 0
    for i in range(count - 1):
        begins_after, ends_after = begins[i + 1, low[i + 1] :], ends[i + 1, low[i + 1] :]
        for label in range(row[i], row[i + 1]):
            now = best[label]
            if now == np.inf:
                continue
            reached = i
            level, k = divmod(label - row[i], number[i])
            end = ends[i, low[i] + k] + 1e-9
            for to in range(max(0, level - most, 1 - level), min(tops[i + 1], level + most) + 1):
                lasts = 2 * way / (speeds[level] + speeds[to])
                for j in range(number[i + 1]):
                    if ends_after[j] < now + lasts - 1e-9:
                        continue
                    leave = now
                    if level == 0:
                        leave = max(now, begins_after[j])
                    elif begins_after[j] > now + 1e-9:
                        # Later intervals begin later still, and a moving cart cannot wait.
                        break
                    arrive = leave + lasts
                    if arrive > end or arrive > ends_after[j] + 1e-9:
                        continue
                    onto = row[i + 1] + to * number[i + 1] + j
                    if arrive < best[onto] - 1e-12:
                        best[onto], before[onto], left[onto] = arrive, label, leave
    last = count - 1
    goal = -1
    for k in range(number[last]):
        standing, end = best[row[last] + k], ends[last, low[last] + k]
        stays = end >= until - 1e-9 and (until > -np.inf or end == np.inf)
        if stays and standing < (best[goal] if goal >= 0 else np.inf):
            goal = row[last] + k
    if goal < 0:
        return reached, empty
    chain = np.zeros((2 * count + 2, 3))
    size = 0
    label = goal
    for i in range(last, -1, -1):
        chain[size] = best[label], float(i), speeds[(label - row[i]) // number[i]]
        size += 1
        if i > 0:
            leave, label = left[label], before[label]
            if leave > best[label] + 1e-9:
                chain[size] = leave, float(i - 1), 0.0
                size += 1
    return reached, chain[:size][::-1].copy()
