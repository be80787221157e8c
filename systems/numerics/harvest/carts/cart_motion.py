"""A cart on its way: the tractor by time, and the trailer behind it by exact kinematics."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...planning.arc_words.words import half_angle_map, half_angles
from ...planning.trailer import trailer_pose
from ..machines.cart import Cart
from ..paths.machine_path import MachinePath, join_paths
from ..paths.timed_path import TimedPath


def trailer_angles(path: MachinePath, cart: Cart, beta: float, stations: np.ndarray) -> np.ndarray:
    """Angles from the trailer's heading to the tractor's at stations, in (-pi, pi] [rad].

    They depend on where the tractor drove, never on how fast.

    Args:
        path: Of the tractor.
        cart: Its trailer counts.
        beta: At the first station [rad].
        stations: In any order, shape (n,) [m].
    """
    at = np.clip(np.asarray(stations, dtype=float), 0.0, path.length)
    pair = half_angles(beta)
    pairs = np.empty((len(at), 2))
    pairs[:] = pair
    piece = path.piece_at(at)
    for k in range(len(path.lengths)):
        gear, curvature = float(path.gears[k]), float(path.curvatures[k])
        chosen = piece == k
        ways = np.append(at[chosen] - path.stations[k], path.lengths[k])
        moved = half_angle_map(cart.trailer, gear, curvature, ways) @ pair
        pairs[chosen] = moved[:-1]
        pair = moved[-1] / np.hypot(*moved[-1])
    return np.remainder(2 * np.arctan2(pairs[:, 0], pairs[:, 1]) + np.pi, 2 * np.pi) - np.pi


def trailer_poses(poses: np.ndarray, betas: np.ndarray, cart: Cart) -> np.ndarray:
    """Poses of the trailer's axle behind tractors, shape (n, 3).

    Args:
        poses: Of the tractor, shape (n, 3).
        betas: From the trailer's heading to the tractor's, shape (n,) [rad].
        cart: Its trailer counts.
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
    """Motions of which each begins where and when, or later than, the one before it ends.

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
        # Sums differ in their last digits.
        np.maximum.accumulate(np.concatenate(stations)),
        np.concatenate([part.speeds for part in parts]),
    )
    return CartMotion(timed, motions[0].cart, motions[0].beta)


def standing_motion(cart: Cart, pose: np.ndarray, time: float, beta: float = 0.0) -> CartMotion:
    """A cart that stands.

    Args:
        cart: Its size.
        pose: Of the tractor, shape (3,).
        time: From when on [s].
        beta: From the trailer's heading to the tractor's [rad].
    """
    none = np.zeros(0, dtype=int)
    path = MachinePath(np.array([pose], dtype=float), none, none.astype(bool), none)
    at = np.array([0.0])
    return CartMotion(TimedPath(path, np.array([time]), at, at), cart, beta)
