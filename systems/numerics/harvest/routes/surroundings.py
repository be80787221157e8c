"""What is round a cart that plans: crop, combines, other carts, and what it keeps from them."""

from dataclasses import dataclass

import numpy as np

from ..machines.cart import Cart
from .clearance import crop_under, gap_to_combines, outline_at, way_is_clear
from .ground import Ground, Traffic
from .others import gap_to_carts
from .search import FOLDED
from .way import Way

# Crop has to be gone so much before a cart comes, and combines keep away so much longer [s].
EARLY = 3.0
# To keep from combines on the way, and from other carts [m].
GAPS = (1.0, 3.0)
# How often it is looked whether a cart may stay where it is [s].
LOOK = 2.0


@dataclass(frozen=True, eq=False)
class Surroundings:
    """What is round a cart that plans.

    Attributes:
        cart: The cart.
        ground: Raster of the crop.
        traffic: Combines and other carts, now.
        points: Outline of the cart, shape (m, 3).
        gaps: What to keep from combines and from other carts, shape (2,) [m].
    """

    cart: Cart
    ground: Ground
    traffic: Traffic
    points: np.ndarray
    gaps: np.ndarray

    def is_clear(self, way: Way, depart: float) -> bool:
        """Whether a way may be driven.

        Args:
            way: States along it.
            depart: When it is begun [s].
        """
        betas = np.abs(way.states[:, 3])
        if betas.max() > max(FOLDED, betas[0]):
            return False
        times = depart + way.distances / self.cart.speed
        # Where it stands already it may stand.
        conflict = self._first_conflict(way.states[0], way.states[1:], times[1:])
        return conflict == max(len(times) - 1, 0)

    def stays_until(self, state: np.ndarray, time: float, most: float) -> float:
        """Until when a cart may stay where it is [s].

        Args:
            state: x, y, theta, beta, shape (4,) [m], [m], [rad], [rad].
            time: From when on [s].
            most: Until when it is looked; infinite is told if nobody is seen to come [s].
        """
        times = np.arange(time + 0.5 * LOOK, most, LOOK)
        conflict = self._first_conflict(state, np.tile(state, (len(times), 1)), times)
        return np.inf if conflict == len(times) else float(times[conflict])

    def _first_conflict(self, start: np.ndarray, states: np.ndarray, times: np.ndarray) -> int:
        """Number of the first of some states that is not clear; their number if all are."""
        if not len(times):
            return 0
        cart = self.cart
        placed = outline_at(self.points, cart.length, cart.hitch_offset, start)
        return way_is_clear(
            self.ground,
            self.traffic,
            self.points,
            cart.length,
            cart.hitch_offset,
            np.ascontiguousarray(states),
            times,
            EARLY,
            self.gaps,
            crop_under(self.ground, self.traffic, placed, float(times[0]), EARLY),
        )


def surroundings_of(
    cart: Cart, ground: Ground, traffic: Traffic, points: np.ndarray, state: np.ndarray
) -> Surroundings:
    """What is round a cart; what it keeps is less if one is nearer already, so that it gets away.

    Args:
        cart: The cart.
        ground: Raster of the crop.
        traffic: Combines and other carts, now.
        points: Outline of the cart, shape (m, 3).
        state: x, y, theta, beta, shape (4,) [m], [m], [rad], [rad].
    """
    placed = outline_at(points, cart.length, cart.hitch_offset, state)
    near = [gap_to_combines(traffic, placed, traffic.time + late) for late in (0.0, EARLY)]
    beside = [gap_to_carts(traffic.others, placed, late) for late in (0.0, EARLY)]
    gaps = np.minimum(GAPS, 0.999 * np.array([min(near), min(beside)]))
    return Surroundings(cart, ground, traffic, points, gaps)
