"""Combines and grain carts: sizes, tanks, outlines, trailers in tow, and what an auger reaches."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np

from ..compiled import compiled, kernel
from ..errors import require, require_non_negative, require_one_of, require_positive
from ..planning.trailer import Trailer, trailer_rates
from ..units import (
    Kilograms,
    KilogramsPerSecond,
    Metres,
    MetresPerSecond,
    MetresPerSecondSquared,
    Watts,
)

# What a combine does when its tank is full and nobody unloads it.
WHEN_FULL = ("stop", "spill")

# Modes of a combine.
WAITING, CUTTING, UNLOADING, FULL, BLOCKED, DONE = range(6)
MODES = ("waiting", "cutting", "unloading", "full", "blocked", "done")

# Modes in which a combine stands.
STANDING_MODES = (WAITING, FULL, BLOCKED, DONE)
# Lookup table: whether a combine stands in each mode.
STANDS = np.isin(np.arange(len(MODES)), STANDING_MODES)

# Columns of a combine's account: way driven along its path [m]; grain in the tank, cut so far and
# spilt so far [kg]; time spent standing full, spilling, and held up by others [s]; mode.
STATION, TANK, CUT, LOST, STOP_TIME, OVERFLOW_TIME, BLOCK_TIME, MODE = range(8)
COLUMNS = 8

rates = compiled(trailer_rates)

# Tolerances for unloading: how far the middle of the trailer's box may be from its target along the
# combine and across it [m], and how much its heading may differ from the combine's [rad].
ALONG, ACROSS, TURNED = 2.5, 1.2, 0.2
# A standing combine can swing its auger, or turn: a cart at any heading is in reach up to this
# multiple of the usual distance. Otherwise a combine that fills up in a turn would wait for ever.
STANDING = 2.0
# Distance from the trailer's axle forward to the middle of its box, in trailer lengths.
MIDDLE = 0.15


@dataclass(frozen=True, kw_only=True)
class CombineSize:
    """What the combines of a team have in common: the ground that they cover and how they turn.

    A combine's path is the path of the middle of its header.

    Raises:
        InvalidInput: A value is out of its range.
    """

    # Width of the header [m].
    header_width: Metres = 9.0
    # Depth of the header, fore and aft [m].
    header_depth: Metres = 2.0
    # Smallest turning radius [m].
    turning_radius: Metres = 6.0
    # Length of the body behind the header [m].
    length: Metres = 8.0
    # Width of the body [m].
    width: Metres = 3.6
    # Clearance from the end of the header to the near side of a cart that is filled [m].
    cart_gap: Metres = 1.5

    def __post_init__(self) -> None:
        for name in ("header_width", "header_depth", "turning_radius", "length", "width"):
            require_positive(name, getattr(self, name))
        require_non_negative("cart_gap", self.cart_gap)


@dataclass(frozen=True, kw_only=True)
class Combine(CombineSize):
    """A combine.

    Raises:
        InvalidInput: A value is out of its range.
    """

    # Speed, forwards and backwards [m/s].
    speed: MetresPerSecond = 1.5
    # Largest acceleration, speeding up and slowing down [m/s^2].
    acceleration: MetresPerSecondSquared = 0.5
    # Capacity of the tank [kg].
    capacity: Kilograms = 9000.0
    # What the auger delivers [kg/s].
    unload_rate: KilogramsPerSecond = 120.0
    # Rated power of the engine, for its fuel [W].
    engine_power: Watts = 250e3
    # Mass with an empty tank [kg].
    mass: Kilograms = 16000.0
    # "stop": a full combine waits for a cart; "spill": it goes on, and its grain is lost.
    when_full: str = "stop"

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("speed", "acceleration", "capacity", "unload_rate", "engine_power", "mass"):
            require_positive(name, getattr(self, name))
        require_one_of("when_full", self.when_full, WHEN_FULL)

    def fill_rate(self, density: float) -> float:
        """Grain that a full header cuts in crop of a density [kg/m^2], r_f [kg/s]."""
        return density * self.header_width * self.speed


def size_of(combines: Sequence[Combine]) -> CombineSize:
    """The size of a team of combines.

    Raises:
        InvalidInput: There is none, or their sizes differ.
    """
    require(len(combines) >= 1, "combines", "be at least 1", len(combines))
    first = combines[0]
    for each in fields(CombineSize):
        for other in combines:
            value, same = getattr(other, each.name), getattr(first, each.name)
            require(value == same, each.name, f"be the same for all combines, {same:g}", value)
    return CombineSize(**{each.name: getattr(first, each.name) for each in fields(CombineSize)})


@dataclass(frozen=True, kw_only=True)
class Cart:
    """One of a team of equal grain carts.

    Raises:
        InvalidInput: A value is out of its range.
    """

    # Speed on the way [m/s].
    speed: MetresPerSecond = 6.0
    # Largest acceleration along the way, speeding up and slowing down [m/s^2].
    acceleration: MetresPerSecondSquared = 1.0
    # Largest lateral acceleration that a loaded cart tolerates [m/s^2].
    lateral_acceleration: MetresPerSecondSquared = 2.0
    # Smallest turning radius of the tractor, at any speed [m].
    turning_radius: Metres = 5.0
    # From the hitch to the trailer's axle [m].
    length: Metres = 5.0
    # From the tractor's rear axle back to the hitch [m].
    hitch_offset: Metres = 0.0
    # Width of tractor and trailer [m].
    width: Metres = 2.5
    # How much grain it holds; infinite: any amount [kg].
    capacity: Kilograms = math.inf
    # Rated power of the tractor's engine, for its fuel [W].
    engine_power: Watts = 150e3
    # Mass of tractor and trailer without grain [kg].
    mass: Kilograms = 14000.0

    def __post_init__(self) -> None:
        for name in (
            "speed",
            "acceleration",
            "lateral_acceleration",
            "turning_radius",
            "length",
            "width",
            "engine_power",
            "mass",
        ):
            require_positive(name, getattr(self, name))
        require(self.capacity > 0, "capacity", "be positive", self.capacity)
        require_non_negative("hitch_offset", self.hitch_offset)

    @property
    def trailer(self) -> Trailer:
        """The cart as a `Trailer`, whose equations of motion are those of `planning.trailer`."""
        return Trailer(
            speed=self.speed,
            turn_rate=self.speed / self.turning_radius,
            length=self.length,
            hitch_offset=self.hitch_offset,
        )

    @property
    def tractor_ends(self) -> tuple[float, float]:
        """Rear and front of the tractor, from its rear axle along its heading [m]."""
        return -0.12 * self.length, 0.5 * self.length

    @property
    def box_ends(self) -> tuple[float, float]:
        """Rear and front of the trailer's body, from its axle along its heading [m]."""
        return -0.28 * self.length, 0.58 * self.length


class Hitch(NamedTuple):
    """The lengths of a cart that the equations of motion need, in a form that compiles.

    Attributes:
        length: From the hitch to the trailer's axle [m].
        hitch_offset: From the tractor's rear axle back to the hitch [m].
    """

    length: float
    hitch_offset: float


def hitch_of(cart: Cart) -> Hitch:
    """The hitch of a cart."""
    return Hitch(float(cart.length), float(cart.hitch_offset))


class CombineOutline(NamedTuple):
    """Outline of a combine in the frame of the middle of its header; x is ahead, y to the left.

    Attributes:
        header: Corners, counterclockwise, shape (4, 2) [m].
        body: Corners of the body behind it, shape (4, 2) [m].
    """

    header: np.ndarray
    body: np.ndarray


class CartOutline(NamedTuple):
    """Outline of a grain cart; x is ahead, y to the left.

    Attributes:
        tractor: Corners in the frame of its rear axle, counterclockwise, shape (4, 2) [m].
        trailer: Corners in the frame of the trailer's axle, shape (4, 2) [m].
    """

    tractor: np.ndarray
    trailer: np.ndarray


def combine_outline(combine: CombineSize) -> CombineOutline:
    """The ground that a combine covers."""
    half = combine.header_depth / 2
    return CombineOutline(
        _box(-half, half, combine.header_width), _box(-combine.length, half, combine.width)
    )


def cart_outline(cart: Cart) -> CartOutline:
    """The ground that a cart covers."""
    return CartOutline(_box(*cart.tractor_ends, cart.width), _box(*cart.box_ends, cart.width))


def _box(rear: float, front: float, width: float) -> np.ndarray:
    half = width / 2
    return np.array([[rear, -half], [front, -half], [front, half], [rear, half]])


@kernel
def convex_hull(cloud, count, hull):
    """Write the convex hull of points, by Andrew's monotone chain; return the number of corners.

    Args:
        cloud: The points, which get sorted, shape (at least count, 2).
        count: How many there are.
        hull: Written: its corners, counterclockwise, shape (at least 2 count, 2).
    """
    for p in range(1, count):
        x, y = cloud[p, 0], cloud[p, 1]
        q = p - 1
        while q >= 0 and (cloud[q, 0] > x or (cloud[q, 0] == x and cloud[q, 1] > y)):
            cloud[q + 1, 0], cloud[q + 1, 1] = cloud[q, 0], cloud[q, 1]
            q -= 1
        cloud[q + 1, 0], cloud[q + 1, 1] = x, y
    size = 0
    for p in range(count):
        while size >= 2 and _turn(hull, size, cloud[p, 0], cloud[p, 1]) <= 0:
            size -= 1
        hull[size, 0], hull[size, 1] = cloud[p, 0], cloud[p, 1]
        size += 1
    lower = size + 1
    for p in range(count - 2, -1, -1):
        while size >= lower and _turn(hull, size, cloud[p, 0], cloud[p, 1]) <= 0:
            size -= 1
        hull[size, 0], hull[size, 1] = cloud[p, 0], cloud[p, 1]
        size += 1
    return size - 1


@kernel
def _turn(hull, size, x, y):
    """Twice the signed area of the hull's last two corners and a point; positive: a left turn."""
    ax, ay = hull[size - 2, 0], hull[size - 2, 1]
    bx, by = hull[size - 1, 0], hull[size - 1, 1]
    return (bx - ax) * (y - ay) - (by - ay) * (x - ax)


@compiled
def drive_team(states, control, top_speed, top_turn_rate, hitch, period, count):
    """States of carts after controls held for a period, by Runge-Kutta steps of order 4.

    The equations are those of `planning.trailer`. Controls beyond the bounds are clipped.

    Args:
        states: x, y, theta, beta of each cart, one after the other, shape (4 K,) [m], [m], [rad],
            [rad].
        control: Speed and turn rate of each tractor, likewise, shape (2 K,) [m/s], [rad/s].
        top_speed: Largest speed, forwards and backwards [m/s].
        top_turn_rate: Largest turn rate, to both sides [rad/s].
        hitch: Of the carts.
        period: How long the controls are held [s].
        count: Number of steps.

    Returns:
        Shape (4 K,).
    """
    step = period / count
    moved = states.copy()
    for k in range(len(states) // 4):
        v = min(max(control[2 * k], -top_speed), top_speed)
        omega = min(max(control[2 * k + 1], -top_turn_rate), top_turn_rate)
        if v == 0.0 and omega == 0.0:
            continue
        x, y, theta, beta = states[4 * k : 4 * k + 4]
        for _ in range(count):
            a = rates(theta, beta, v, omega, hitch)
            b = rates(theta + step / 2 * a[2], beta + step / 2 * a[3], v, omega, hitch)
            c = rates(theta + step / 2 * b[2], beta + step / 2 * b[3], v, omega, hitch)
            d = rates(theta + step * c[2], beta + step * c[3], v, omega, hitch)
            x += step / 6 * (a[0] + 2 * b[0] + 2 * c[0] + d[0])
            y += step / 6 * (a[1] + 2 * b[1] + 2 * c[1] + d[1])
            theta += step / 6 * (a[2] + 2 * b[2] + 2 * c[2] + d[2])
            beta += step / 6 * (a[3] + 2 * b[3] + 2 * c[3] + d[3])
        moved[4 * k], moved[4 * k + 1] = x, y
        moved[4 * k + 2], moved[4 * k + 3] = theta, beta
    return moved


@compiled
def box_middle(state, length, hitch_offset):
    """Position and heading of the middle of a trailer's box: x, y, theta.

    Args:
        state: x, y, theta, beta, shape (4,) [m], [m], [rad], [rad].
        length, hitch_offset: Of the trailer [m].
    """
    heading = state[2] - state[3]
    behind = length * (1.0 - MIDDLE)
    x = state[0] - hitch_offset * np.cos(state[2]) - behind * np.cos(heading)
    y = state[1] - hitch_offset * np.sin(state[2]) - behind * np.sin(heading)
    return x, y, heading


@compiled
def is_alongside(pose, state, length, hitch_offset, reach, stands):
    """Whether a combine's auger pours into a cart's trailer.

    Args:
        pose: x, y, theta of the combine.
        state: x, y, theta, beta of the cart.
        length: Of the trailer [m].
        hitch_offset: [m].
        reach: Where the box should be, to the left of the combine's middle [m].
        stands: Whether the combine stands.
    """
    x, y, heading = box_middle(state, length, hitch_offset)
    dx, dy = x - pose[0], y - pose[1]
    c, s = np.cos(pose[2]), np.sin(pose[2])
    if stands and np.hypot(dx, dy) <= STANDING * reach:
        return True
    turned = (heading - pose[2] + np.pi) % (2 * np.pi) - np.pi
    return (
        abs(c * dx + s * dy) <= ALONG
        and abs(c * dy - s * dx - reach) <= ACROSS
        and abs(turned) <= TURNED
    )


@compiled
def pair_up(poses, states, wanted, stands, length, hitch_offset, reach):
    """Which cart each combine unloads into.

    Args:
        poses: Of the combines, shape (N, 3).
        states: Of the carts, shape (K, 4).
        wanted: Combine that each cart is to empty now, or -1, shape (K,).
        stands: Whether each combine stands, shape (N,).
        length: Of a trailer [m].
        hitch_offset: [m].
        reach: See `is_alongside` [m].

    Returns:
        Number of the cart, or -1, shape (N,).
    """
    carts = np.full(len(poses), -1.0)
    for k in range(len(states)):
        n = int(wanted[k])
        if (
            0 <= n < len(poses)
            and carts[n] < 0
            and is_alongside(poses[n], states[k], length, hitch_offset, reach, stands[n])
        ):
            carts[n] = k
    return carts
