"""Windows of time in which a cart can drive beside a combine.

Beside means on a lane on the combine's left, where the auger pours into the middle of the
trailer's box. A window lies on one stretch of the combine's path that is driven forwards and bends
gently, whether it cuts there or not. During a window the ground under tractor and trailer was cut
a while ago, or is margin, and no other machine is near; a straight run-in leads up to it.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..machines import MIDDLE, Cart, Combine, CombineSize, size_of
from ..paths import MachinePath, TimedPath, rounded_path, runs_of
from .cart_motion import trailer_angles, trailer_poses
from .cut_times import GAP, OpenGround, opens_along
from .roadmap import AFTER_CUT
from .routes import RUN_IN
from .traffic import Traffic, cart_boxes, least_gaps, without

# Time between the moments that are checked [s].
MOMENT = 1.0
# Least distance that a combine drives in a window [m].
SHORTEST = 24.0
# Largest curvature of a combine's path for a cart beside it [1/m], as a mean over a stretch [m]:
# along a polygonal outline a combine makes each small turn within a metre.
BEND, STRETCH = 1 / 45.0, 8.0
# Added to the gap to other machines for the time between the moments that are checked [m].
BETWEEN = 0.5


class Beside(NamedTuple):
    """Where a tractor is when its trailer is under a combine's auger.

    Attributes:
        ahead: How far ahead of the middle of the header [m].
        left: How far to the left of it [m].
    """

    ahead: float
    left: float


class Lane(NamedTuple):
    """The path of a tractor beside a stretch of a combine's path.

    Attributes:
        path: Of the tractor.
        of_combine, of_tractor: Matching stations of the two, linear between them, shape (n,) [m].
    """

    path: MachinePath
    of_combine: np.ndarray
    of_tractor: np.ndarray

    def stations(self, of_combine: np.ndarray) -> np.ndarray:
        """Stations of the tractor when the combine is at given stations [m]."""
        return np.interp(of_combine, self.of_combine, self.of_tractor)


class Window(NamedTuple):
    """A time in which a cart can be beside a combine.

    Attributes:
        combine: Its number.
        begin, end: [s].
        lane: Of the tractor.
    """

    combine: int
    begin: float
    end: float
    lane: Lane


def beside(combine: CombineSize, cart: Cart) -> Beside:
    """Where the tractor is while its cart is filled, with tractor and trailer in line."""
    return Beside(
        cart.hitch_offset + cart.length * (1.0 - MIDDLE),
        combine.header_width / 2 + combine.cart_gap + cart.width / 2,
    )


def find_windows(
    combines: Sequence[Combine],
    cart: Cart,
    plans: Sequence[TimedPath],
    ground: OpenGround,
    traffic: Traffic,
) -> list[Window]:
    """Find all windows of all combines, sorted by their beginnings.

    Args:
        combines: The N combines, of one size.
        cart: One of the equal carts.
        plans: Of all combines.
        ground: When each cell of the ground opens to carts.
        traffic: The combines.
    """
    place, boxes = beside(size_of(combines), cart), cart_boxes(cart)
    found = []
    for number, (combine, plan) in enumerate(zip(combines, plans, strict=True)):
        others = without(traffic, number)
        moments = np.arange(plan.times[0], plan.end, MOMENT)
        stations = plan.station_at(moments)
        for first, last in gentle_runs(plan.path):
            inside = (stations >= first) & (stations <= last)
            times, at = moments[inside], stations[inside]
            if len(times) < 2:
                continue
            lane = lane_beside(plan.path, first, last, place)
            ways = lane.stations(at)
            tractor = lane.path.pose_at(ways)
            trailer = trailer_poses(tractor, trailer_angles(lane.path, cart, 0.0, ways), cart)
            latest = np.maximum(
                opens_along(ground, boxes[0], tractor), opens_along(ground, boxes[1], trailer)
            )
            fits = latest + AFTER_CUT <= times
            fits[fits] &= (
                least_gaps(others, boxes, tractor[fits], trailer[fits], times[fits])
                >= GAP + BETWEEN
            )
            ready = fits.copy()
            for back in np.arange(RUN_IN / 4, RUN_IN + 0.1, RUN_IN / 4):
                before = trailer_poses(tractor, np.zeros(len(times)), cart)
                before[:, :2] -= back * np.stack([np.cos(before[:, 2]), np.sin(before[:, 2])], 1)
                early = times - back / combine.speed
                ready &= opens_along(ground, boxes[1], before) + AFTER_CUT <= early
            for begin, behind in runs_of(fits):
                k = begin + int(np.argmax(ready[begin:behind]))
                if ready[k] and at[behind - 1] - at[k] >= SHORTEST:
                    found.append(Window(number, float(times[k]), float(times[behind - 1]), lane))
    return sorted(found, key=lambda window: window.begin)


def gentle_runs(path: MachinePath) -> list[tuple[float, float]]:
    """First and last stations of stretches that are driven forwards and bend gently [m]."""
    turned = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(path.poses[:, 2])))])
    middles = (path.stations[:-1] + path.stations[1:]) / 2
    before, after = (
        np.interp(middles + side * STRETCH / 2, path.stations, turned) for side in (-1, 1)
    )
    bends = np.minimum(np.abs(path.curvatures), (after - before) / STRETCH)
    fits = (path.gears == 1) & (bends <= BEND)
    runs = [(float(path.stations[a]), float(path.stations[b])) for a, b in runs_of(fits)]
    return [(first, last) for first, last in runs if last - first >= SHORTEST]


def lane_beside(path: MachinePath, first: float, last: float, place: Beside) -> Lane:
    """The path of a tractor beside a combine between two stations, extended straight at its end.

    A turn that the combine makes within a metre is spread over a whole stretch for the tractor.

    Args:
        path: Of the combine.
        first, last: Of a gentle run [m].
        place: Where the tractor is beside it.
    """
    count = max(1, math.ceil((last - first) / STRETCH))
    at = np.linspace(first, last, count + 1)
    poses = path.pose_at(np.clip(at, first + 1e-9, last - 1e-9))
    # The tractor is ahead of the combine, so its lane ends that much farther on.
    x, y, theta = poses[-1]
    farther = place.ahead + 1.0
    poses = np.vstack([poses, [x + farther * np.cos(theta), y + farther * np.sin(theta), theta]])
    at = np.append(at, last + farther)
    left = np.column_stack([-np.sin(poses[:, 2]), np.cos(poses[:, 2])])
    corners = poses[:, :2] + place.left * left
    way = rounded_path(corners)
    ways = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(corners, axis=0).T))])
    return Lane(way, at - place.ahead, ways * (way.length / ways[-1]))


def drive_beside(plan: TimedPath, lane: Lane, begin: float, end: float) -> TimedPath:
    """The timed path of a tractor that drives beside a combine for a while.

    Where the combine's path begins to bend, the tractor's speed changes over some seconds, which
    puts it a few centimetres off its place.

    Args:
        plan: Of the combine.
        lane: Of the tractor.
        begin, end: [s].
    """
    first, last = (float(lane.stations(plan.station_at(t))) for t in (begin, end))
    path = lane.path
    inner = path.stations[(path.stations > first + 1e-6) & (path.stations < last - 1e-6)]
    piece = path.piece_at(np.concatenate([[first], inner]) + 1e-7)
    if np.any(path.curvatures[piece] != 0.0):
        times = np.linspace(begin, end, max(2, round(end - begin) + 1))
        # Where the combine stands, rounding must not make speeds negative.
        speeds = np.maximum(np.gradient(lane.stations(plan.station_at(times)), times), 0.0)
    else:
        inside = plan.times[(plan.times > begin + 1e-9) & (plan.times < end - 1e-9)]
        times = np.unique(np.concatenate([[begin], inside, [end]]))
        speeds = plan.speed_at(times)
    ways = np.concatenate([[0.0], np.cumsum((speeds[1:] + speeds[:-1]) / 2 * np.diff(times))])
    last = min(first + float(ways[-1]), path.length)
    at = np.concatenate([[first], inner[inner < last - 1e-6], [last]])
    own = MachinePath.of(path.pose_at(at))
    stations = np.minimum(ways, own.length)
    stations[-1] = own.length
    return TimedPath(own, times, stations, speeds)
