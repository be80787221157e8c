"""Combines with their tanks, the cart's way between them, and the truck it unloads into.

Amounts are [kg], rates [kg/s], times [s]; any other unit of amount does as well, if it is the
same everywhere. Combines are numbered from 0 in order of service.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from ...errors import (
    InvalidInput,
    require,
    require_finite,
    require_non_negative,
    require_positive,
)

# Amounts, rates and times lie between.
LEAST, MOST = 1e-9, 1e12


@dataclass(frozen=True)
class Fleet:
    """N combines and how long a cart drives from one to another.

    Attributes:
        capacities: Tank of each combine, (N,) [kg].
        fill_rates: Grain that each one cuts, (N,) [kg/s].
        unload_rates: What each one's auger delivers, (N,) [kg/s]; more than it cuts.
        travel_times: From combine i (row) to combine j (column), (N, N) [s].

    Raises:
        InvalidInput: Sizes differ, or a number is out of its range.
    """

    capacities: tuple[float, ...]
    fill_rates: tuple[float, ...]
    unload_rates: tuple[float, ...]
    travel_times: tuple[tuple[float, ...], ...]

    def __post_init__(self) -> None:
        count = len(self.capacities)
        require(count > 0, "combines", "be at least 1", count)
        for name in ("fill_rates", "unload_rates", "travel_times"):
            got = len(getattr(self, name))
            require(got == count, name, f"have one entry for each of the {count} combines", got)
        for n in range(count):
            for name, value in (
                ("capacity", self.capacities[n]),
                ("fill_rate", self.fill_rates[n]),
                ("unload_rate", self.unload_rates[n]),
            ):
                require_positive(name, value)
                require_measurable(name, value)
            require(
                self.unload_rates[n] > self.fill_rates[n],
                "unload_rate",
                "exceed the fill rate, or a tank never empties while its combine works",
                f"{self.unload_rates[n]} against {self.fill_rates[n]}",
            )
            row = self.travel_times[n]
            require(len(row) == count, "travel_times", "be a square matrix", self.travel_times)
            for entry in row:
                require_non_negative("travel_time", entry)
                require(entry <= MOST, "travel_time", f"be at most {MOST:g}", entry)

    @staticmethod
    def equal(
        combines: int, capacity: float, fill_rate: float, unload_rate: float, travel_time: float
    ) -> "Fleet":
        """The thesis's fleet: alike, and `travel_time` apart along a line (3.3).

        Args:
            combines: N.
            capacity: C [kg].
            fill_rate: r_f [kg/s].
            unload_rate: r_u [kg/s].
            travel_time: dT [s].

        Raises:
            InvalidInput: A value is out of its range.
        """
        require_count("combines", combines)
        return Fleet(
            capacities=(capacity,) * combines,
            fill_rates=(fill_rate,) * combines,
            unload_rates=(unload_rate,) * combines,
            travel_times=line_of((travel_time,) * (combines - 1)),
        )

    @property
    def size(self) -> int:
        """Number of combines."""
        return len(self.capacities)

    def part(self, combines: Sequence[int]) -> "Fleet":
        """Some of the combines, numbered anew in the order given."""
        return Fleet(
            capacities=tuple(self.capacities[n] for n in combines),
            fill_rates=tuple(self.fill_rates[n] for n in combines),
            unload_rates=tuple(self.unload_rates[n] for n in combines),
            travel_times=tuple(
                tuple(self.travel_times[here][there] for there in combines) for here in combines
            ),
        )

    def filling_time(self, combine: int) -> float:
        """How long an empty tank takes to fill, C / r_f [s]."""
        return self.capacities[combine] / self.fill_rates[combine]

    def net_rate(self, combine: int) -> float:
        """How fast a tank empties while its combine cuts on, r_u - r_f [kg/s]."""
        return self.unload_rates[combine] - self.fill_rates[combine]


@dataclass(frozen=True)
class Truck:
    """Where a cart of finite capacity leaves its grain.

    Attributes:
        cart_capacity: What a cart holds [kg].
        travel_time: One way between any combine and the truck [s].
        unload_rate: From cart to truck [kg/s]; infinite: at once.
        stop_time: Spent at the truck besides unloading [s].

    Raises:
        InvalidInput: A value is out of its range.
    """

    cart_capacity: float
    travel_time: float = 0.0
    unload_rate: float = math.inf
    stop_time: float = 0.0

    def __post_init__(self) -> None:
        require_positive("cart_capacity", self.cart_capacity)
        require_measurable("cart_capacity", self.cart_capacity)
        require_non_negative("truck_travel_time", self.travel_time)
        require(self.unload_rate > 0, "truck_unload_rate", "be positive", self.unload_rate)
        require_non_negative("truck_stop_time", self.stop_time)


def line_of(gaps: tuple[float, ...]) -> tuple[tuple[float, ...], ...]:
    """Travel times between combines along a line, (N, N) [s], from the N - 1 between neighbours.

    The way back passes all of them again, as in the thesis.

    Args:
        gaps: Between neighbours [s].

    Raises:
        InvalidInput: A value is out of its range.
    """
    for gap in gaps:
        require_non_negative("travel_time", gap)
    places = [0.0]
    for gap in gaps:
        places.append(places[-1] + gap)
    return tuple(tuple(abs(there - here) for there in places) for here in places)


def require_measurable(name: str, value: float) -> None:
    """Refuse amounts and rates that no scale reads, whose quotients leave the range of numbers.

    Args:
        name: Of the parameter, for the message.
        value: What came; positive, in any unit [-].
    """
    require(LEAST <= value <= MOST, name, f"lie between {LEAST:g} and {MOST:g}", value)


def require_count(name: str, value: int) -> None:
    """Refuse what is not a whole number from 1 on.

    Args:
        name: Of the parameter, for the message.
        value: What came.
    """
    if isinstance(value, bool) or not isinstance(value, int):
        raise InvalidInput(f"`{name}` must be a whole number; got {value}")
    require_finite(name, value)
    require(value >= 1, name, "be at least 1", value)
