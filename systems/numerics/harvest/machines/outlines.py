"""Outlines of machines, as convex polygons in the frame of their pose."""

from typing import NamedTuple

import numpy as np

from .cart import Cart
from .combine import CombineSize


class CombineOutline(NamedTuple):
    """Of a combine, in the frame of the middle of its header; x is ahead, y to the left.

    Attributes:
        header: Corners, counterclockwise, shape (4, 2) [m].
        body: Behind it, shape (4, 2) [m].
    """

    header: np.ndarray
    body: np.ndarray


class CartOutline(NamedTuple):
    """Of a grain cart; x is ahead, y to the left.

    Attributes:
        tractor: Corners in the frame of its rear axle, counterclockwise, shape (4, 2) [m].
        trailer: Corners in the frame of the trailer's axle, shape (4, 2) [m].
    """

    tractor: np.ndarray
    trailer: np.ndarray


def combine_outline(combine: CombineSize) -> CombineOutline:
    """What a combine covers."""
    half = combine.header_depth / 2
    return CombineOutline(
        _box(-half, half, combine.header_width), _box(-combine.length, half, combine.width)
    )


def cart_outline(cart: Cart) -> CartOutline:
    """What a cart covers."""
    return CartOutline(_box(*cart.tractor_ends, cart.width), _box(*cart.box_ends, cart.width))


def _box(rear: float, front: float, width: float) -> np.ndarray:
    half = width / 2
    return np.array([[rear, -half], [front, -half], [front, half], [rear, half]])
