"""Combines, carts and trucks seen from above, larger than they are where the field is large."""

import math
from dataclasses import dataclass, replace

import numpy as np
import shapely

from ....systems.numerics.harvest.machines.cart import Cart
from ....systems.numerics.harvest.machines.combine import CombineSize
from ....systems.numerics.planning.trailer import Trailer, trailer_pose

# Of a combine, in view heights, so that it can be seen; and how much larger than they are machines
# may be drawn before a cart would cover too much of the header beside it.
_LEGIBLE, _OVERHANG = 0.045, 1.6
# Part of a header's width that a combine's body is at most drawn with.
_WIDEST = 1.25


@dataclass(frozen=True)
class MachineSizes:
    """Sizes at which machines are drawn.

    Attributes:
        scale: How many times their size; 1 for headers' widths and the reach of augers.
        header: Width of the header [m].
        reach: From the combine's middle to a cart's, to the left [m].
        length: Of a combine's body as drawn [m].
        width: Of a combine's body as drawn [m].
        trailer: The cart as drawn.
    """

    scale: float
    header: float
    reach: float
    length: float
    width: float
    trailer: Trailer


def machine_sizes(combine: CombineSize, cart: Cart, reach: float, span: float) -> MachineSizes:
    """Choose sizes that can be seen in a view of a height [m].

    Args:
        combine: As it is.
        cart: As it is.
        reach: Of the auger [m].
        span: Height of the view [m].
    """
    most = min(
        _OVERHANG * (reach - combine.header_width / 2) / (cart.width / 2),
        _WIDEST * combine.header_width / combine.width,
    )
    scale = max(1.0, min(_LEGIBLE * span / combine.length, most))
    return MachineSizes(
        scale=scale,
        header=combine.header_width,
        reach=reach,
        length=scale * combine.length,
        width=scale * combine.width,
        trailer=replace(
            cart.trailer, length=scale * cart.length, hitch_offset=scale * cart.hitch_offset
        ),
    )


def drawn_cart(state: np.ndarray, cart: Cart, sizes: MachineSizes) -> np.ndarray:
    """Poses of tractor and trailer as drawn, scaled about the middle of the trailer's box.

    Args:
        state: x, y, theta, beta, shape (4,) [m], [m], [rad], [rad].
        cart: As it is.
        sizes: As it is drawn.

    Returns:
        x, y, theta of the tractor's axle and of the trailer's, shape (2, 3).
    """
    x, y, theta, beta = state.tolist()
    axle_x, axle_y, heading = trailer_pose(x, y, theta, beta, cart.trailer)
    ahead = 0.5 * sum(cart.box_ends)
    # In plain numbers, which are quicker than such short arrays: this is done for every picture.
    mid_x, mid_y = axle_x + ahead * math.cos(heading), axle_y + ahead * math.sin(heading)
    k = sizes.scale
    tractor = (mid_x + k * (x - mid_x), mid_y + k * (y - mid_y), theta)
    trailer = (mid_x + k * (axle_x - mid_x), mid_y + k * (axle_y - mid_y), heading)
    return np.array([tractor, trailer])


def header_shape(sizes: MachineSizes) -> shapely.Polygon:
    """The header about its middle, facing along x [m]."""
    depth = 0.09 * sizes.length
    return shapely.box(-depth, -sizes.header / 2, depth, sizes.header / 2)


def body_shape(sizes: MachineSizes) -> shapely.Geometry:
    """A combine's body behind the header, with the feeder that joins them [m]."""
    length, half = sizes.length, sizes.width / 2
    cab = shapely.Polygon(
        [
            (-0.18 * length, -0.7 * half),
            (-0.18 * length, 0.7 * half),
            (-0.26 * length, half),
            (-length, 0.9 * half),
            (-length, -0.9 * half),
            (-0.26 * length, -half),
        ]
    )
    return shapely.union(cab, shapely.box(-0.2 * length, -0.35 * half, 0.0, 0.35 * half))


def tank_box(sizes: MachineSizes) -> tuple[float, float, float, float]:
    """Where the bar of a tank lies on a combine: rear, right, front, left [m]."""
    return -0.94 * sizes.length, -0.27 * sizes.width, -0.32 * sizes.length, 0.27 * sizes.width


def auger_shape(sizes: MachineSizes, *, out: bool) -> shapely.Polygon:
    """The auger: out to the cart on the left, or folded back along the body [m]."""
    half, root = 0.045 * sizes.length, -0.3 * sizes.length
    if out:
        # A little forward, for the box that it pours into is beside the header.
        tube = shapely.LineString([(root, 0.45 * sizes.width), (0.0, sizes.reach)])
        return tube.buffer(half, cap_style="flat")
    left = 0.5 * sizes.width
    return shapely.box(-1.12 * sizes.length, left - half, root, left + half)


def load_box(sizes: MachineSizes) -> tuple[float, float, float, float]:
    """Where the grain lies in a trailer: rear, right, front, left [m]."""
    size = sizes.trailer.length
    return -0.22 * size, -0.15 * size, 0.52 * size, 0.15 * size


def truck_shapes(sizes: MachineSizes) -> tuple[shapely.Polygon, shapely.Polygon]:
    """A truck's bed and its cab, about the bed's middle [m]."""
    size = sizes.trailer.length
    return (
        shapely.box(-0.8 * size, -0.22 * size, 0.6 * size, 0.22 * size),
        shapely.box(0.66 * size, -0.2 * size, 0.98 * size, 0.2 * size),
    )
