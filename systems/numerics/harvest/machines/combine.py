"""Combines: their size, their speed, their tank and their auger."""

from collections.abc import Sequence
from dataclasses import dataclass, fields

from ...errors import require, require_non_negative, require_positive
from ...units import (
    Kilograms,
    KilogramsPerSecond,
    Metres,
    MetresPerSecond,
    MetresPerSecondSquared,
    Watts,
)

# What a combine does when its tank is full and nobody unloads it.
WHEN_FULL = ("stop", "spill")


@dataclass(frozen=True, kw_only=True)
class CombineSize:
    """What the combines of a team have in common: the ground that they cover and how they turn.

    The point that a combine's path leads is the middle of the header.

    Raises:
        InvalidInput: A value is out of its range.
    """

    # Width of the header [m].
    header_width: Metres = 9.0
    # Of the header, fore and aft [m].
    header_depth: Metres = 2.0
    # Least radius of turns [m].
    turning_radius: Metres = 6.0
    # Of the body behind the header [m].
    length: Metres = 8.0
    # Of the body [m].
    width: Metres = 3.6
    # From the end of the header to the near side of a cart that is filled [m].
    cart_gap: Metres = 1.5

    def __post_init__(self) -> None:
        for name in ("header_width", "header_depth", "turning_radius", "length", "width"):
            require_positive(name, getattr(self, name))
        require_non_negative("cart_gap", self.cart_gap)


@dataclass(frozen=True, kw_only=True)
class Combine(CombineSize):
    """A combine.

    Raises:
        InvalidInput: A value is out of its range.
    """

    # Speed, forwards and backwards [m/s].
    speed: MetresPerSecond = 1.5
    # Largest, speeding up and slowing down [m/s^2].
    acceleration: MetresPerSecondSquared = 0.5
    # Tank [kg].
    capacity: Kilograms = 9000.0
    # What the auger delivers [kg/s].
    unload_rate: KilogramsPerSecond = 120.0
    # Of the engine, for its fuel [W].
    engine_power: Watts = 250e3
    # Of the machine with an empty tank [kg].
    mass: Kilograms = 16000.0
    # "stop": a full combine waits for a cart; "spill": it goes on, and its grain is lost.
    when_full: str = "stop"

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("speed", "acceleration", "capacity", "unload_rate", "engine_power", "mass"):
            require_positive(name, getattr(self, name))
        require(
            self.when_full in WHEN_FULL,
            "when_full",
            f"be one of {', '.join(WHEN_FULL)}",
            self.when_full,
        )

    def fill_rate(self, density: float) -> float:
        """Grain that a full header cuts in crop of a density [kg/m^2], r_f [kg/s]."""
        return density * self.header_width * self.speed


def size_of(combines: Sequence[Combine]) -> CombineSize:
    """The size of a team of combines.

    Raises:
        InvalidInput: There is none, or their sizes differ.
    """
    require(len(combines) >= 1, "combines", "be at least 1", len(combines))
    first = combines[0]
    for each in fields(CombineSize):
        for other in combines:
            value, same = getattr(other, each.name), getattr(first, each.name)
            require(value == same, each.name, f"be the same for all combines, {same:g}", value)
    return CombineSize(**{each.name: getattr(first, each.name) for each in fields(CombineSize)})
