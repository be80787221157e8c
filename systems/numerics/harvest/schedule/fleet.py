"""Combines with their tanks, the visits that a cart repeats, its ways, and the truck.

Amounts are [kg], rates [kg/s], times [s]; any other unit of amount does as well, if it is the
same everywhere. Combines are numbered from 0 in order of service.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import lcm

from ...errors import InvalidInput, require, require_finite, require_non_negative, require_positive

# Smallest and largest amounts, rates and times.
LEAST, MOST = 1e-9, 1e12


@dataclass(frozen=True)
class Fleet:
    """N combines and how long a cart drives from one to another.

    Attributes:
        capacities: Tank of each combine, (N,) [kg].
        fill_rates: Grain that each one cuts, (N,) [kg/s].
        unload_rates: What each one's auger delivers, (N,) [kg/s]; more than it cuts.
        travel_times: From combine i (row) to combine j (column), (N, N); 0 from i to i [s].

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
            require(row[n] == 0, "travel_times", f"be 0 from combine {n} to itself", row[n])

    @staticmethod
    def equal(
        combines: int, capacity: float, fill_rate: float, unload_rate: float, travel_time: float
    ) -> "Fleet":
        """The thesis's fleet: alike, and `travel_time` apart along a line (3.3).

        Args:
            combines: Number of combines N.
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
        require(self.unload_rate > 0, "truck_unload_rate", "be positive", self.unload_rate)
        if self.unload_rate != math.inf:
            require_measurable("truck_unload_rate", self.unload_rate)
        for name, value in (
            ("truck_travel_time", self.travel_time),
            ("truck_stop_time", self.stop_time),
        ):
            require_non_negative(name, value)
            require(value <= MOST, name, f"be at most {MOST:g}", value)


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
    """Refuse amounts and rates so small or large that their quotients would be out of range.

    Args:
        name: Of the parameter, for the message.
        value: Its value; positive, in any unit [-].
    """
    require(LEAST <= value <= MOST, name, f"lie between {LEAST:g} and {MOST:g}", value)


def require_count(name: str, value: int) -> None:
    """Refuse anything but a whole number from 1 on.

    Args:
        name: Of the parameter, for the message.
        value: Its value.
    """
    if isinstance(value, bool) or not isinstance(value, int):
        raise InvalidInput(f"`{name}` must be a whole number; got {value}")
    require_finite(name, value)
    require(value >= 1, name, "be at least 1", value)


@dataclass(frozen=True)
class Round:
    """V visits that repeat for ever.

    Attributes:
        combines: Which combine each visit serves, (V,).
        travel_times: From each visit's combine to the next visit's, by way of the truck where
            there is a trip, but without the time there; the last leads back to the first, (V,) [s].
        trips: Whether the cart drives by the truck after each visit, (V,).
        truck: That truck; none: the cart holds any amount.
        carts: How many carts make this round, one after another and equally far apart in time;
            if several, it has one visit to each combine.

    Raises:
        InvalidInput: Several carts would visit a combine more than once a round.
    """

    combines: tuple[int, ...]
    travel_times: tuple[float, ...]
    trips: tuple[bool, ...]
    truck: Truck | None = None
    carts: int = 1

    def __post_init__(self) -> None:
        once = len(set(self.combines)) == len(self.combines)
        require(self.carts == 1 or once, "round", "visit each combine once", self.combines)

    @property
    def size(self) -> int:
        """Number of visits."""
        return len(self.combines)

    def previous(self, visit: int) -> int:
        """Number of visits back to the last one to the same combine, from 1 to V."""
        return next(
            back
            for back in range(1, self.size + 1)
            if self.combines[(visit - back) % self.size] == self.combines[visit]
        )

    def block(self, visit: int) -> list[int]:
        """The visits whose grain the trip after `visit` brings to the truck, last one first."""
        visits = [visit]
        while not self.trips[(visits[-1] - 1) % self.size] and len(visits) < self.size:
            visits.append((visits[-1] - 1) % self.size)
        return visits


def sequential_round(
    fleet: Fleet,
    order: Sequence[int] | None = None,
    truck: Truck | None = None,
    visits_per_trip: int | None = None,
) -> Round:
    """One combine after another, then back to the first (Zhang 2014, 3.4).

    Args:
        fleet: The combines.
        order: Those that the cart serves, in this order; none: all, by their numbers.
        truck: Where a cart of finite capacity unloads.
        visits_per_trip: The cart drives by the truck after each such number of visits; none:
            after each time that it has served all. The round is as long as it takes for trips
            and combines to fall together again.

    Raises:
        InvalidInput: The order names no combine, or a number is out of its range.
    """
    served = tuple(range(fleet.size)) if order is None else tuple(order)
    known = len(set(served)) == len(served) > 0 and set(served) <= set(range(fleet.size))
    require(known, "order", f"name each of some combines 0 to {fleet.size - 1} once", served)
    if truck is None:
        require(visits_per_trip is None, "visits_per_trip", "come with a truck", visits_per_trip)
        size = len(served)
        trips = (False,) * size
    else:
        every = len(served) if visits_per_trip is None else visits_per_trip
        require_count("visits_per_trip", every)
        size = lcm(every, len(served))
        trips = tuple((visit + 1) % every == 0 for visit in range(size))
    combines = tuple(served[visit % len(served)] for visit in range(size))
    return round_of(fleet, combines, trips, truck)


def round_of(
    fleet: Fleet,
    combines: Sequence[int],
    trips: Sequence[bool],
    truck: Truck | None = None,
    carts: int = 1,
) -> Round:
    """The round of any visits, with the ways between them.

    Args:
        fleet: The combines.
        combines: Of each visit, (V,).
        trips: Whether the cart drives by the truck after each visit, (V,).
        truck: Where that is; needed for trips.
        carts: How many make the round one after another.

    Raises:
        InvalidInput: Several carts would visit a combine more than once a round.
    """
    travel = tuple(
        way_by_truck(fleet, truck, here, there)
        if truck is not None and trip
        else fleet.travel_times[here][there]
        for (here, there), trip in zip(pairwise((*combines, combines[0])), trips, strict=True)
    )
    return Round(
        combines=tuple(combines),
        travel_times=travel,
        trips=tuple(trips),
        truck=truck,
        carts=carts,
    )


def way_by_truck(fleet: Fleet, truck: Truck, here: int, there: int) -> float:
    """From one combine to another by way of the truck, without the time there [s].

    It is never quicker than the way without: the truck moves no cart.

    Args:
        fleet: The combines.
        truck: Where the cart unloads.
        here: Number of the first combine.
        there: Number of the second.
    """
    return max(2.0 * truck.travel_time, fleet.travel_times[here][there])
