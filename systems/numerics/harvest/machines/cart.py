"""A grain cart: a tractor and its trailer, their outlines, and what they hold."""

import math
from dataclasses import dataclass
from typing import NamedTuple

from ...errors import require, require_positive
from ...planning.trailer import Trailer
from ...units import Kilograms, Metres, MetresPerSecond, MetresPerSecondSquared, Watts


@dataclass(frozen=True, kw_only=True)
class Cart:
    """One of a team of equal grain carts.

    Raises:
        InvalidInput: A value is out of its range.
    """

    # On the way [m/s].
    speed: MetresPerSecond = 6.0
    # Largest along the way, speeding up and slowing down [m/s^2].
    acceleration: MetresPerSecondSquared = 1.0
    # Largest across it, which a loaded cart stands [m/s^2].
    lateral_acceleration: MetresPerSecondSquared = 2.0
    # Least radius of the tractor's turns, at any speed [m].
    turning_radius: Metres = 5.0
    # From the hitch to the trailer's axle [m].
    length: Metres = 5.0
    # From the tractor's rear axle back to the hitch [m].
    hitch_offset: Metres = 0.0
    # Of tractor and trailer [m].
    width: Metres = 2.5
    # How much grain it holds; infinite: any amount [kg].
    capacity: Kilograms = math.inf
    # Of the tractor's engine, for its fuel [W].
    engine_power: Watts = 150e3
    # Of tractor and trailer without grain [kg].
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
        require(self.hitch_offset >= 0, "hitch_offset", "be zero or positive", self.hitch_offset)

    @property
    def trailer(self) -> Trailer:
        """The plant: its equations of motion are those of the planning story."""
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
    """What the equations of motion need of a cart, in a form that compiles.

    Attributes:
        length: From the hitch to the trailer's axle [m].
        hitch_offset: From the tractor's rear axle back to the hitch [m].
    """

    length: float
    hitch_offset: float


def hitch_of(cart: Cart) -> Hitch:
    """The hitch of a cart."""
    return Hitch(float(cart.length), float(cart.hitch_offset))
