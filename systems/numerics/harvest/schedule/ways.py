"""What lies between a cart's visits, as arrays for searches."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .fleet import Fleet, Truck
from .rounds import way_by_truck

Vector = NDArray[np.float64]


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


def ways_of(fleet: Fleet, combines: Sequence[int], truck: Truck | None, scale: float = 1.0) -> Ways:
    """The ways between some combines, longer by a factor.

    Args:
        fleet: The combines.
        combines: Which of them, in the order of rows and columns.
        truck: Where carts unload; none: they hold any amount.
        scale: Factor on all ways [-].
    """
    numbers = np.array(combines)
    direct = scale * np.array(fleet.travel_times)[np.ix_(numbers, numbers)]
    if truck is None:
        return Ways(direct, direct, 0.0, 0.0, math.inf)
    rows = [[way_by_truck(fleet, truck, here, there) for there in combines] for here in combines]
    return Ways(
        direct,
        scale * np.array(rows),
        truck.stop_time,
        1.0 / truck.unload_rate,
        truck.cart_capacity,
    )
