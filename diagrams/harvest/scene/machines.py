"""Combines with tanks that fill, carts with loads that grow, and the trucks at the edge."""

import numpy as np
import shapely

from ....systems.numerics.harvest.machines.cart import Cart
from ...planning.pictures import drawbar_shape, tractor_shape, trailer_shape
from ...visuals.meshes import disc_mesh, extruded_mesh, flat_mesh, unit_bar_mesh
from ...visuals.stage import Stage
from .machine_shapes import (
    MachineSizes,
    auger_shape,
    body_shape,
    drawn_cart,
    header_shape,
    load_box,
    tank_box,
    truck_shapes,
)
from .palette import (
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

# A bar is at least so long, in its whole length: nothing cannot be drawn.
_LEAST = 1e-3


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
