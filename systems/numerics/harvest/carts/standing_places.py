"""Where a cart can stand to be filled by a combine that stands."""

import math

import numpy as np

from ..machines.alongside import MIDDLE, STANDING, box_middle
from ..machines.cart import Cart
from ..machines.combine import CombineSize
from .cart_motion import trailer_poses
from .cut_times import GAP
from .roadmap import node_opens
from .surroundings import CartSurroundings
from .traffic import Traffic, least_gaps
from .windows import BETWEEN, beside

# Part of the auger's reach that is counted on: carts are a little off their paths.
SURE = 0.98

# Where the box may be beside a combine that stands, in usual distances to its left and ahead, and
# how it is turned [rad]: the auger swings.
PLACES = np.array(
    [(1.0, 0.0, 0.0)]
    + [
        (left, ahead, quarter * math.pi / 4)
        for left in (1.0, 1.5, 0.6, -1.0, -1.5, -0.6)
        for quarter in (0, 4, 2, 6, 1, 3, 5, 7)
        for ahead in (0.0, 0.8, -0.8, 1.4, -1.6)
        if 0.9 < math.hypot(left, ahead) < SURE * STANDING
    ]
)


def is_in_reach(combine: CombineSize, cart: Cart, pose: np.ndarray, state: np.ndarray) -> bool:
    """Whether the auger of a standing combine surely reaches a cart, whose trailer may be bent.

    Args:
        combine, cart: They.
        pose: Of the combine, shape (3,).
        state: Of the cart: x, y, theta, beta, shape (4,) [m], [m], [rad], [rad].
    """
    x, y, _ = box_middle(state, cart.length, cart.hitch_offset)
    away = math.hypot(x - pose[0], y - pose[1])
    return away <= SURE * STANDING * beside(combine, cart).left


def standing_poses(
    world: CartSurroundings, pose: np.ndarray, time: float, others: Traffic | None = None
) -> np.ndarray:
    """Poses of the tractor in which the auger of a standing combine reaches, shape (n, 3).

    Args:
        world: What carts plan among.
        pose: Of the combine, shape (3,).
        time: When the ground is open and machines are where they are, at the latest; infinite:
            at the end of all plans [s].
        others: Other carts.
    """
    cart = world.cart
    reach = beside(world.size, cart).left
    forth = cart.hitch_offset + cart.length * (1.0 - MIDDLE)
    c, s = math.cos(pose[2]), math.sin(pose[2])
    left, ahead, turn = PLACES.T
    course = pose[2] + turn
    x = pose[0] + reach * (c * ahead - s * left) + forth * np.cos(course)
    y = pose[1] + reach * (s * ahead + c * left) + forth * np.sin(course)
    every = np.column_stack([x, y, course])
    opens = node_opens(world.ground, cart, every)
    every = every[(opens <= time) & (opens < np.inf)]
    behind = trailer_poses(every, np.zeros(len(every)), cart)
    times = np.full(len(every), min(time, 1e7))
    fits = np.ones(len(every), dtype=bool)
    for traffic in (world.combines, others):
        if traffic is not None:
            gaps = least_gaps(traffic, world.planner.boxes, every, behind, times)
            fits &= gaps >= GAP + BETWEEN
    return every[fits]
