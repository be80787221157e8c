"""Trucks that take grain from carts at the edge of a field, and drive it away over the road."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

from ..errors import require, require_non_negative
from ..units import Kilograms, Seconds

# A truck with less room is full [kg].
FULL = 1e-6


@dataclass(frozen=True, kw_only=True)
class TruckFleet:
    """Equal trucks that take turns at the edge of a field.

    Raises:
        InvalidInput: A value is out of its range.
    """

    # How many there are.
    count: int = 1
    # What one holds; infinite: any amount, so that none ever leaves [kg].
    capacity: Kilograms = math.inf
    # From leaving the field, full, to being back, empty [s].
    road_time: Seconds = 0.0

    def __post_init__(self) -> None:
        require(self.count >= 1, "count", "be at least 1", self.count)
        require(self.capacity > 0, "capacity", "be positive", self.capacity)
        require_non_negative("road_time", self.road_time)


class Filling(NamedTuple):
    """Grain that flows from a cart into one truck.

    Attributes:
        truck: Its number.
        begin, end: When grain flows [s].
        amount: [kg].
    """

    truck: int
    begin: float
    end: float
    amount: float


class TruckPool:
    """The trucks' room and free times, as carts come to them one after the other.

    A truck takes from one cart at a time, leaves when it is full, and is back after its way over
    the road. A cart goes to the truck that can take from it first, and from a truck that is full
    to the next one.

    A truck that has time to drive off and be back between two carts does so, full or not.

    Args:
        fleet: The trucks; all are there and empty at the beginning.
        before: Fillings that are settled already, in any order; none is added before them.
    """

    def __init__(self, fleet: TruckFleet, before: Iterable[Filling] = ()):
        self._fleet = fleet
        self._free = [0.0] * fleet.count
        self._room = [fleet.capacity] * fleet.count
        for each in sorted(before, key=lambda filling: filling.begin):
            self._fill(each)

    def empty(self, time: float, load: float, rate: float) -> list[Filling]:
        """Empty a cart, and account for it.

        Args:
            time: When the cart is there [s].
            load: What is in it [kg].
            rate: At which it is emptied [kg/s].

        Returns:
            The fillings in order; none for an empty cart.
        """
        fillings = []
        while load > FULL:
            truck = min(range(self._fleet.count), key=lambda k: (max(self._free[k], time), k))
            begin = max(self._free[truck], time)
            amount = min(load, self._room_at(truck, begin))
            time = begin + amount / rate
            fillings.append(Filling(truck, begin, time, amount))
            load -= amount
            self._fill(fillings[-1])
        return fillings

    def _room_at(self, truck: int, time: float) -> float:
        """Room in a truck for a cart that comes to it at a time [kg]."""
        back = time >= self._free[truck] + self._fleet.road_time
        return self._fleet.capacity if back else self._room[truck]

    def _fill(self, filling: Filling) -> None:
        truck = filling.truck
        self._room[truck] = self._room_at(truck, filling.begin) - filling.amount
        self._free[truck] = filling.end
        if self._room[truck] <= FULL:
            self._free[truck] += self._fleet.road_time
            self._room[truck] = self._fleet.capacity
