"""Combines, carts and trucks from above, as large as they are: what is seen is what is audited.

Tanks fill, loads grow, and trucks stand at the edge. Where the field is large a patch of colour
under each combine says where it is.
"""

import numpy as np
import shapely

from ...systems.numerics.harvest.machines import (
    Cart,
    CombineSize,
    cart_outline,
    combine_outline,
)
from ...systems.numerics.planning.trailer import trailer_pose
from ..planning.pictures import drawbar_shape
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

# Radius of the patch under a combine and its height, just above crop, in view heights; its opacity.
_GLOW, _ABOVE, _CLEAR = 0.018, 0.0065, 0.45
# As high as a combine is long things are drawn on it, or so many view heights: higher than crop.
_TALL = 0.03
# A truck's bed and cab, and how far it stands beyond the edge [m].
BED, CAB, TRUCK_WIDTH, BESIDE = 9.0, 2.4, 2.5, 0.25

# A bar is at least so long, in its whole length: nothing cannot be drawn.
_LEAST = 1e-3


def body_shape(combine: CombineSize) -> shapely.Geometry:
    """A combine's body behind the header, with the feeder that joins them [m]."""
    length, half = combine.length, combine.width / 2
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


def tank_box(combine: CombineSize) -> tuple[float, float, float, float]:
    """Where the bar of a tank lies on a combine: rear, right, front, left [m]."""
    length, width = combine.length, combine.width
    return -0.94 * length, -0.27 * width, -0.32 * length, 0.27 * width


def auger_shape(combine: CombineSize, reach: float, *, out: bool) -> shapely.Polygon:
    """The auger, out to the cart on the left or folded back along the body [m].

    Args:
        combine: As it is.
        reach: From the combine's middle to a cart's [m].
        out: Whether it is out.
    """
    half, root = 0.045 * combine.length, -0.3 * combine.length
    if out:
        # A little forward, for the box that it pours into is beside the header.
        tube = shapely.LineString([(root, 0.4 * combine.width), (0.0, reach)])
        return tube.buffer(half, cap_style="flat")
    left = combine.width / 2
    return shapely.box(-combine.length, left - 2 * half, root, left)


def tractor_shape(cart: Cart) -> shapely.Geometry:
    """A cart's tractor about its rear axle, with a narrower bonnet in front [m]."""
    rear, front = cart.tractor_ends
    cab, bonnet = cart.width / 2, cart.width / 3
    wide = shapely.box(rear, -cab, rear + 0.48 * (front - rear), cab)
    shoulder = front - bonnet / 2
    tip = shapely.Polygon([(shoulder, -bonnet), (front, 0.0), (shoulder, bonnet)])
    return shapely.union_all([wide, shapely.box(rear, -bonnet, shoulder, bonnet), tip])


def load_box(cart: Cart) -> tuple[float, float, float, float]:
    """Where the grain lies in a trailer: rear, right, front, left [m]."""
    rear, front = cart.box_ends
    return rear + 0.3, 0.3 - cart.width / 2, front - 0.3, cart.width / 2 - 0.3


class CombineShapes:
    """Combines at `combines/N`, with `tank/fill`, `auger/out` and `auger/folded`.

    Args:
        stage: Where to draw.
        combine: As it is.
        reach: From the combine's middle to a cart's, to the left [m].
        span: Height of the view [m].
        count: How many.
    """

    def __init__(
        self, stage: Stage, combine: CombineSize, reach: float, span: float, count: int
    ) -> None:
        self._stage, self._combine = stage, combine
        length, tall = combine.length, max(combine.length, _TALL * span)
        header = shapely.Polygon(combine_outline(combine).header)
        for n in range(count):
            path = f"combines/{n}"
            stage.raise_to(f"{path}/glow", _ABOVE * span)
            stage.mesh(f"{path}/glow/disc", disc_mesh(_GLOW * span), combine_paint(n, _CLEAR))
            body = extruded_mesh(body_shape(combine), 0.0, 0.42 * tall)
            stage.mesh(f"{path}/body", body, combine_paint(n))
            stage.mesh(f"{path}/header", extruded_mesh(header, 0.0, 0.25 * tall), HEADER)
            for name, out in (("out", True), ("folded", False)):
                tube = auger_shape(combine, reach, out=out)
                mesh = extruded_mesh(tube, 0.44 * tall, 0.5 * tall)
                stage.mesh(f"{path}/auger/{name}/tube", mesh, AUGER)
            # Grain at the spout.
            stage.raise_to(f"{path}/auger/out/grain", 0.52 * tall)
            stage.mesh(f"{path}/auger/out/grain/at/disc", disc_mesh(0.1 * length), GRAIN)
            stage.place(f"{path}/auger/out/grain/at", 0.0, reach)
            _bar(stage, f"{path}/tank", tank_box(combine), 0.43 * tall)

    def move(self, poses: np.ndarray, fills: np.ndarray, pouring: np.ndarray) -> None:
        """Show poses, shape (N, 3), how full tanks are and whether augers are out, shape (N,).

        Args:
            poses: Shape (N, 3) [m], [m], [rad].
            fills: How full tanks are, 0 to 1, shape (N,).
            pouring: Whether augers are out, shape (N,).
        """
        stage = self._stage
        reach = max(self._combine.length, self._combine.header_width / 2)
        rear, _, front, _ = tank_box(self._combine)
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
        cart: As it is.
        span: Height of the view [m].
        count: How many.
    """

    def __init__(self, stage: Stage, cart: Cart, span: float, count: int) -> None:
        self._stage, self._cart = stage, cart
        tall = max(2 * cart.length, _TALL * span)
        box = shapely.Polygon(cart_outline(cart).trailer)
        bar = drawbar_shape(cart.trailer)
        for k in range(count):
            path = f"carts/{k}"
            tractor = extruded_mesh(tractor_shape(cart), 0.0, 0.35 * tall)
            stage.mesh(f"{path}/tractor/body", tractor, TRACTOR)
            stage.mesh(f"{path}/trailer/body", extruded_mesh(box, 0.0, 0.3 * tall), TRAILER)
            stage.mesh(f"{path}/trailer/drawbar", extruded_mesh(bar, 0.0, 0.25 * tall), HEADER)
            _bar(stage, f"{path}/trailer/load", load_box(cart), 0.31 * tall)

    def move(self, states: np.ndarray, fills: np.ndarray) -> None:
        """Show states, shape (K, 4), and how full carts are, shape (K,)."""
        rear, _, front, _ = load_box(self._cart)
        reach = self._cart.length
        for k, (x, y, theta, beta) in enumerate(states.tolist()):
            towed = trailer_pose(x, y, theta, beta, self._cart.trailer)
            for body, pose in (("tractor", (x, y, theta)), ("trailer", towed)):
                self._stage.pose(f"carts/{k}/{body}", *map(float, pose), reach=reach)
            fill = (front - rear) * max(float(fills[k]), _LEAST)
            self._stage.stretch(f"carts/{k}/trailer/load/fill/at/bar", fill)


def draw_trucks(stage: Stage, cart: Cart, places: np.ndarray) -> None:
    """A truck on the left of each place where a cart is emptied: x, y, theta, shape (K, 3)."""
    half = TRUCK_WIDTH / 2
    bed = shapely.box(-BED / 2, -half, BED / 2, half)
    cab = shapely.box(BED / 2 + 0.3, -half, BED / 2 + 0.3 + CAB, half)
    # Carts stand by their width off the edge of what machines drive on.
    off = cart.width + BESIDE + half
    for k, (x, y, theta) in enumerate(places.tolist()):
        # A pad to stand on, beyond the margin.
        pad = shapely.box(-BED / 2 - 1.0, -off + cart.width / 2, BED / 2 + CAB + 1.3, half + 1.0)
        stage.mesh(f"trucks/{k}/pad", flat_mesh(pad), MARGIN_GROUND)
        stage.mesh(f"trucks/{k}/bed", extruded_mesh(bed, 0.0, 2.0), TRUCK_BED)
        stage.mesh(f"trucks/{k}/cab", extruded_mesh(cab, 0.0, 2.6), TRUCK_CAB)
        back = cart.hitch_offset + cart.length - sum(cart.box_ends) / 2
        at = np.array([x, y]) + np.array(
            [
                -back * np.cos(theta) - off * np.sin(theta),
                -back * np.sin(theta) + off * np.cos(theta),
            ]
        )
        stage.pose(f"trucks/{k}", float(at[0]), float(at[1]), float(theta), reach=BED)


def _bar(stage: Stage, path: str, box: tuple[float, float, float, float], height: float) -> None:
    """An empty box with a bar in it that can be stretched from its rear: `PATH/fill/at/bar`."""
    rear, right, front, left = box
    stage.raise_to(path, height)
    stage.mesh(f"{path}/empty", flat_mesh(shapely.box(rear, right, front, left)), EMPTY)
    stage.raise_to(f"{path}/fill", 0.01 * (front - rear))
    stage.place(f"{path}/fill/at", rear, 0.0)
    stage.mesh(f"{path}/fill/at/bar", unit_bar_mesh(left - right), GRAIN)
