"""The other carts, as one of them sees them: where they will be, and how near that is."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...compiled import compiled
from ..machines.cart import Cart

# Between two states that are foreseen [s].
EVERY = 1.0
# Beyond that distance of two tractors their carts cannot be near [m].
FAR = 40.0


class Others(NamedTuple):
    """Where other carts will be, from a time on.

    Attributes:
        states: x, y, theta, beta, without jumps of angles, EVERY seconds, shape (J, T, 4), T > 1.
        before: Of how many of them, the first ones, one lets pass.
        bodies: Rear and front of a tractor and of a trailer's box, half the width, length of the
            trailer, hitch offset; shape (7,) [m].
    """

    states: np.ndarray
    before: int
    bodies: np.ndarray


NOBODY = Others(np.zeros((0, 2, 4)), 0, np.zeros(7))


def others_of(states: Sequence[np.ndarray], before: int, cart: Cart) -> Others:
    """Equal carts whose states, shape (T, 4) each, are foreseen.

    Args:
        before: How many of them have the right of way.
    """
    bodies = (*cart.tractor_ends, *cart.box_ends, cart.width / 2, cart.length, cart.hitch_offset)
    return Others(np.array(states).reshape(len(states), -1, 4), before, np.array(bodies))


@compiled
def gap_to_cart(others, number, placed, late):
    """Least distance of an outline from a cart so long after the first state foreseen [m].

    Infinite where the cart is far, and beyond what is foreseen.

    Args:
        number: Of the other cart.
        placed: Outline of the cart where it is, shape (m, 2) [m].
        late: Time after that [s].
    """
    states, bodies = others.states[number], others.bodies
    at = max(late, 0.0) / EVERY
    last = len(states) - 1
    if at > last:
        return np.inf
    k = min(int(at), last - 1)
    share = at - k
    x, y, theta, beta = states[k] + share * (states[k + 1] - states[k])
    if np.hypot(placed[0, 0] - x, placed[0, 1] - y) > FAR:
        return np.inf
    heading = theta - beta
    ax = x - bodies[6] * np.cos(theta) - bodies[5] * np.cos(heading)
    ay = y - bodies[6] * np.sin(theta) - bodies[5] * np.sin(heading)
    least = np.inf
    for body in range(2):
        if body == 0:
            ox, oy, c, s, rear, front = x, y, np.cos(theta), np.sin(theta), bodies[0], bodies[1]
        else:
            c, s = np.cos(heading), np.sin(heading)
            ox, oy, rear, front = ax, ay, bodies[2], bodies[3]
        for p in range(len(placed)):
            dx, dy = placed[p, 0] - ox, placed[p, 1] - oy
            ahead, left = c * dx + s * dy, abs(c * dy - s * dx)
            along = max(max(ahead - front, rear - ahead), 0.0)
            least = min(least, np.hypot(along, max(left - bodies[4], 0.0)))
    return least


@compiled
def gap_to_carts(others, placed, late):
    """Least distance of an outline from any of the others; see `gap_to_cart` [m]."""
    least = np.inf
    for number in range(len(others.states)):
        least = min(least, gap_to_cart(others, number, placed, late))
    return least
