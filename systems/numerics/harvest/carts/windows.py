"""When a cart can drive beside a combine: windows of time.

Beside means on a lane on the combine's left, where the auger pours into the middle of the
trailer's box. A window lies on one straight piece of work. In it the ground under tractor and
trailer has been cut for a while, nobody else is near, and before it there is a straight run-in.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..machines.alongside import MIDDLE
from ..machines.cart import Cart
from ..machines.combine import Combine
from ..paths.machine_path import MachinePath
from ..paths.timed_path import TimedPath
from .cart_motion import CartMotion, trailer_poses
from .cut_times import GAP, OpenGround, opens_along
from .roadmap import AFTER_CUT
from .routes import RUN_IN
from .traffic import Traffic, cart_boxes, least_gaps, without

# Time between moments that are looked at [s].
MOMENT = 0.5
# Least way that a combine drives in a window [m].
SHORTEST = 50.0
# What counts as straight: change of heading [rad], and how far off the line [m].
TURNED, OFF_LINE = 2e-3, 0.1
# Added to the gap to other machines, between moments [m].
BETWEEN = 0.5


class Beside(NamedTuple):
    """Where a tractor is when its trailer is under a combine's auger.

    Attributes:
        ahead: Of the middle of the header [m].
        left: Of it [m].
    """

    ahead: float
    left: float

    def of(self, poses: np.ndarray) -> np.ndarray:
        """Poses of the tractor beside poses of the combine, shape (..., 3)."""
        c, s = np.cos(poses[..., 2]), np.sin(poses[..., 2])
        x = poses[..., 0] + c * self.ahead - s * self.left
        y = poses[..., 1] + s * self.ahead + c * self.left
        return np.stack([x, y, poses[..., 2]], axis=-1)


class Window(NamedTuple):
    """A time in which a cart can be beside a combine.

    Attributes:
        combine: Its number.
        begin, end: [s].
    """

    combine: int
    begin: float
    end: float


def beside(combine: Combine, cart: Cart) -> Beside:
    """Where the tractor of a cart in line is while it is filled."""
    return Beside(
        cart.hitch_offset + cart.length * (1.0 - MIDDLE),
        combine.header_width / 2 + combine.cart_gap + cart.width / 2,
    )


def find_windows(
    combine: Combine,
    cart: Cart,
    plans: Sequence[TimedPath],
    ground: OpenGround,
    traffic: Traffic,
) -> list[Window]:
    """All windows of all combines, in the order of their beginnings.

    Args:
        combine: One of the equal combines.
        cart: One of the equal carts.
        plans: Of all combines.
        ground: From when on carts may be where.
        traffic: The combines.
    """
    place, boxes = beside(combine, cart), cart_boxes(cart)
    found = []
    for number, plan in enumerate(plans):
        others = without(traffic, number)
        for first, last in straight_runs(plan.path):
            times = _times_between(plan, first, last)
            if len(times) < 2:
                continue
            tractor = place.of(plan.pose_at(times))
            fits = _open(ground, boxes, cart, tractor, times)
            trailer = trailer_poses(tractor, np.zeros(len(times)), cart)
            fits &= least_gaps(others, boxes, tractor, trailer, times) >= GAP + BETWEEN
            ready = fits.copy()
            for back in np.arange(RUN_IN / 4, RUN_IN + 0.1, RUN_IN / 4):
                before = tractor.copy()
                before[:, 0] -= back * np.cos(tractor[:, 2])
                before[:, 1] -= back * np.sin(tractor[:, 2])
                early = times - back / combine.speed
                ready &= _open(ground, boxes, cart, before, early)
            stations = plan.station_at(times)
            k = 0
            while k < len(times):
                if not ready[k]:
                    k += 1
                    continue
                end = k
                while end + 1 < len(times) and fits[end + 1]:
                    end += 1
                if stations[end] - stations[k] >= SHORTEST:
                    found.append(Window(number, float(times[k]), float(times[end])))
                k = end + 1
    return sorted(found, key=lambda window: window.begin)


def straight_runs(path: MachinePath) -> list[tuple[float, float]]:
    """First and last stations of straight work in one gear ahead, shape of each (2,) [m]."""
    fits = (path.gears == 1) & path.cutting & (np.abs(path.curvatures) < 1e-4)
    found = []
    k = 0
    while k < len(fits):
        if not fits[k]:
            k += 1
            continue
        first = path.poses[k]
        c, s = math.cos(first[2]), math.sin(first[2])
        end = k
        while end + 1 < len(fits) and fits[end + 1]:
            pose = path.poses[end + 2]
            off = c * (pose[1] - first[1]) - s * (pose[0] - first[0])
            if abs(pose[2] - first[2]) > TURNED or abs(off) > OFF_LINE:
                break
            end += 1
        found.append((float(path.stations[k]), float(path.stations[end + 1])))
        k = end + 1
    return found


def _times_between(plan: TimedPath, first: float, last: float) -> np.ndarray:
    """Moments at which a machine is between two stations, standing there included."""
    fine = np.arange(plan.times[0], plan.times[-1], MOMENT)
    at = plan.station_at(fine)
    return fine[(at >= first - 1e-9) & (at <= last + 1e-9)]


def _open(
    ground: OpenGround, boxes: np.ndarray, cart: Cart, tractor: np.ndarray, times: np.ndarray
) -> np.ndarray:
    """Whether the ground under carts in line is open at times."""
    trailer = trailer_poses(tractor, np.zeros(len(tractor)), cart)
    latest = np.maximum(
        opens_along(ground, boxes[0], tractor), opens_along(ground, boxes[1], trailer)
    )
    return latest + AFTER_CUT <= times


def drive_beside(
    plan: TimedPath, place: Beside, cart: Cart, begin: float, end: float, beta: float
) -> CartMotion:
    """A cart beside a combine on a straight, for a while.

    Args:
        plan: Of the combine.
        place: Where the tractor is beside it.
        cart: The cart.
        begin, end: [s].
        beta: The trailer's angle at the beginning [rad].
    """
    inside = plan.times[(plan.times > begin + 1e-9) & (plan.times < end - 1e-9)]
    times = np.unique(np.concatenate([[begin], inside, [end]]))
    at = plan.station_at(times)
    poses = place.of(plan.pose_at(np.array([begin, end])))
    # It stays in line with where it began, however the pieces of the combine's way lie.
    poses[1, 2] = poses[0, 2]
    one = np.ones(1, dtype=int)
    path = MachinePath(poses, one, one < 0, -one)
    stations = np.clip(at - at[0], 0.0, path.length)
    stations[-1] = path.length
    return CartMotion(TimedPath(path, times, stations, plan.speed_at(times)), cart, beta)
