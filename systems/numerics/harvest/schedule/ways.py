"""What a cart visits, and what lies between its visits, as arrays for searches."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .fleet import Fleet, Truck
from .rounds import way_by_truck

Vector = NDArray[np.float64]


class Tanks(NamedTuple):
    """What a cart visits.

    Attributes:
        capacities: (N,) [kg].
        fill_rates: (N,) [kg/s].
        net_rates: By which a cart beside them empties them, r_u - r_f, (N,) [kg/s].
    """

    capacities: Vector
    fill_rates: Vector
    net_rates: Vector


class Ways(NamedTuple):
    """What a cart does between two visits.

    Attributes:
        direct: From combine (row) to combine (column), (N, N) [s].
        by_truck: The same by way of the truck, without the time there, (N, N) [s].
        stop: Time at the truck besides unloading [s].
        unloading: How long the truck takes over one unit of grain [s/kg].
        room: Of the cart; infinite: there is no truck [kg].
    """

    direct: Vector
    by_truck: Vector
    stop: float
    unloading: float
    room: float


def tanks_of(fleet: Fleet) -> Tanks:
    """The tanks of all combines."""
    fill = np.array(fleet.fill_rates)
    return Tanks(np.array(fleet.capacities), fill, np.array(fleet.unload_rates) - fill)


def ways_of(fleet: Fleet, truck: Truck | None, scale: float = 1.0) -> Ways:
    """The ways between all combines, longer by a factor.

    Args:
        fleet: The combines.
        truck: Where carts unload; none: they hold any amount.
        scale: Factor on all ways [-].
    """
    direct = scale * np.array(fleet.travel_times)
    if truck is None:
        return Ways(direct, direct, 0.0, 0.0, math.inf)
    numbers = range(fleet.size)
    rows = [[way_by_truck(fleet, truck, here, there) for there in numbers] for here in numbers]
    return Ways(
        direct,
        scale * np.array(rows),
        truck.stop_time,
        1.0 / truck.unload_rate,
        truck.cart_capacity,
    )
