"""Places to which a cart can get out of the way."""

import numpy as np

from ...compiled import compiled
from ..machines.cart import Cart
from .clearance import crop_under, gap_to_combines, outline, outline_at
from .ground import Ground, Traffic
from .others import gap_to_carts

# How far away places are looked for [m], in how many directions.
DISTANCES, DIRECTIONS = (15.0, 25.0, 40.0, 60.0, 90.0), 24
# How long nobody may come to a place [s], and how near [m].
QUIET, ROOM = 120.0, 3.0


def refuges(ground: Ground, traffic: Traffic, cart: Cart, state: np.ndarray) -> list[np.ndarray]:
    """Poses of the tractor, the nearest first, where nobody comes for a while.

    A cart gets there straight on but for a turn at the beginning, and stands as it came.

    Args:
        ground: Raster.
        traffic: Combines and other carts.
        cart: The cart.
        state: x, y, theta, beta where it is, shape (4,).
    """
    points = outline(cart)
    # Ahead first: turning takes longer.
    turns = np.linspace(-np.pi, np.pi, DIRECTIONS, endpoint=False)
    found = []
    for far in DISTANCES:
        for turn in turns[np.argsort(np.abs(turns), kind="stable")]:
            course = state[2] + turn
            x, y = state[0] + far * np.cos(course), state[1] + far * np.sin(course)
            place = np.array([x, y, course, 0.0])
            placed = outline_at(points, cart.length, cart.hitch_offset, place)
            if crop_under(ground, traffic, placed, traffic.time, 0.0) > 0:
                continue
            if not is_met(traffic, placed, QUIET, ROOM):
                found.append(place[:3])
    return found


@compiled
def is_met(traffic, placed, within, near):
    """Whether a combine or another cart comes to an outline, shape (m, 2), within a time [s].

    Args:
        traffic: The combines.
        placed: Outline of the cart where it is, shape (m, 2) [m].
        near: Least distance to keep [m].
    """
    for k in range(int(within / 2.0)):
        late = 2.0 * k
        if gap_to_combines(traffic, placed, traffic.time + late) < near:
            return True
        if gap_to_carts(traffic.others, placed, late) < near:
            return True
    return False
