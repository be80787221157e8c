"""Combines, carts and trucks from above, larger than they are where the field is large.

Tanks fill, loads grow, and trucks stand at the edge.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
import shapely

from ...systems.numerics.harvest.machines import Cart, CombineSize
from ...systems.numerics.planning.trailer import Trailer, trailer_pose
from ..planning.pictures import drawbar_shape, tractor_shape, trailer_shape
from ..visuals.meshes import disc_mesh, extruded_mesh, flat_mesh, unit_bar_mesh
from ..visuals.stage import Stage
from .colours import (
    AUGER,
    EMPTY,
    GRAIN,
    HEADER,
    MARGIN_GROUND,
    TRACTOR,
    TRAILER,
    TRUCK_BED,
    TRUCK_CAB,
    combine_paint,
)

# Of a combine, in view heights, so that it can be seen; and how much larger than they are machines
# may be drawn before a cart would cover too much of the header beside it.
_LEGIBLE, _OVERHANG = 0.045, 1.6
# Part of a header's width that a combine's body is at most drawn with.
_WIDEST = 1.25

# A bar is at least so long, in its whole length: nothing cannot be drawn.
_LEAST = 1e-3


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


class CombineShapes:
    """Combines at `combines/N`, with `tank/fill`, `auger/out` and `auger/folded`.

    Args:
        stage: Where to draw.
        sizes: As they are drawn.
        count: How many.
    """

    def __init__(self, stage: Stage, sizes: MachineSizes, count: int) -> None:
        self._stage, self._sizes = stage, sizes
        length = sizes.length
        for n in range(count):
            path = f"combines/{n}"
            body = extruded_mesh(body_shape(sizes), 0.0, 0.42 * length)
            stage.mesh(f"{path}/body", body, combine_paint(n))
            stage.mesh(
                f"{path}/header", extruded_mesh(header_shape(sizes), 0.0, 0.16 * length), HEADER
            )
            for name, out in (("out", True), ("folded", False)):
                tube = extruded_mesh(auger_shape(sizes, out=out), 0.44 * length, 0.5 * length)
                stage.mesh(f"{path}/auger/{name}/tube", tube, AUGER)
            # Grain at the spout.
            stage.raise_to(f"{path}/auger/out/grain", 0.52 * length)
            stage.mesh(f"{path}/auger/out/grain/at/disc", disc_mesh(0.1 * length), GRAIN)
            stage.place(f"{path}/auger/out/grain/at", 0.0, sizes.reach)
            _bar(stage, f"{path}/tank", tank_box(sizes), 0.43 * length)

    def move(self, poses: np.ndarray, fills: np.ndarray, pouring: np.ndarray) -> None:
        """Show poses, shape (N, 3), how full tanks are and whether augers are out, shape (N,).

        Args:
            poses: Shape (N, 3) [m], [m], [rad].
            fills: How full tanks are, 0 to 1, shape (N,).
            pouring: Whether augers are out, shape (N,).
        """
        stage, sizes = self._stage, self._sizes
        reach = max(sizes.length, sizes.header / 2)
        rear, _, front, _ = tank_box(sizes)
        for n, (x, y, theta) in enumerate(poses.tolist()):
            stage.pose(f"combines/{n}", x, y, theta, reach=reach)
            fill = (front - rear) * max(float(fills[n]), _LEAST)
            stage.stretch(f"combines/{n}/tank/fill/at/bar", fill)
            stage.show(f"combines/{n}/auger/out", bool(pouring[n]))
            stage.show(f"combines/{n}/auger/folded", not pouring[n])


class CartShapes:
    """Carts at `carts/K/tractor` and `carts/K/trailer`, with `trailer/load/fill`.

    Args:
        stage: Where to draw.
        sizes: As they are drawn.
        cart: As it is.
        count: How many.
    """

    def __init__(self, stage: Stage, sizes: MachineSizes, cart: Cart, count: int) -> None:
        self._stage, self._sizes, self._cart = stage, sizes, cart
        trailer = sizes.trailer
        size = trailer.length
        for k in range(count):
            path = f"carts/{k}"
            tractor = extruded_mesh(tractor_shape(trailer), 0.0, 0.5 * size)
            stage.mesh(f"{path}/tractor/body", tractor, TRACTOR)
            box = extruded_mesh(trailer_shape(trailer), 0.0, 0.4 * size)
            stage.mesh(f"{path}/trailer/body", box, TRAILER)
            bar = extruded_mesh(drawbar_shape(trailer), 0.0, 0.25 * size)
            stage.mesh(f"{path}/trailer/drawbar", bar, HEADER)
            _bar(stage, f"{path}/trailer/load", load_box(sizes), 0.42 * size)

    def move(self, states: np.ndarray, fills: np.ndarray) -> None:
        """Show states, shape (K, 4), and how full carts are, shape (K,)."""
        rear, _, front, _ = load_box(self._sizes)
        reach = self._sizes.trailer.length
        for k, state in enumerate(states):
            poses = drawn_cart(state, self._cart, self._sizes).tolist()
            for body, (x, y, angle) in zip(("tractor", "trailer"), poses, strict=True):
                self._stage.pose(f"carts/{k}/{body}", x, y, angle, reach=reach)
            fill = (front - rear) * max(float(fills[k]), _LEAST)
            self._stage.stretch(f"carts/{k}/trailer/load/fill/at/bar", fill)


def draw_trucks(stage: Stage, sizes: MachineSizes, cart: Cart, places: np.ndarray) -> None:
    """A truck on the left of each place where a cart is emptied: x, y, theta, shape (K, 3)."""
    size = sizes.trailer.length
    bed, cab = truck_shapes(sizes)
    for k, place in enumerate(places):
        _, (x, y, theta) = drawn_cart(np.append(place, 0.0), cart, sizes)
        # A pad to stand on, beyond the margin.
        pad = shapely.box(-1.0 * size, -0.9 * size, 1.2 * size, 0.4 * size)
        stage.mesh(f"trucks/{k}/pad", flat_mesh(pad), MARGIN_GROUND)
        x, y = x - 0.8 * size * np.sin(theta), y + 0.8 * size * np.cos(theta)
        stage.mesh(f"trucks/{k}/bed", extruded_mesh(bed, 0.0, 0.4 * size), TRUCK_BED)
        stage.mesh(f"trucks/{k}/cab", extruded_mesh(cab, 0.0, 0.5 * size), TRUCK_CAB)
        stage.pose(f"trucks/{k}", float(x), float(y), float(theta), reach=size)


def _bar(stage: Stage, path: str, box: tuple[float, float, float, float], height: float) -> None:
    """An empty box with a bar in it that can be stretched from its rear: `PATH/fill/at/bar`."""
    rear, right, front, left = box
    stage.raise_to(path, height)
    stage.mesh(f"{path}/empty", flat_mesh(shapely.box(rear, right, front, left)), EMPTY)
    stage.raise_to(f"{path}/fill", 0.01 * (front - rear))
    stage.place(f"{path}/fill/at", rear, 0.0)
    stage.mesh(f"{path}/fill/at/bar", unit_bar_mesh(left - right), GRAIN)
