"""Rounds: the visits that a cart repeats, and the ways between them."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import lcm

from ...errors import require
from .fleet import Fleet, Truck, require_count


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
