"""Plans of carts: crop and trucks, visits, trips and jobs, and the stops of combines for them."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..field.yield_map import YieldMap
from ..paths import TimedPath
from ..trucks import Filling, TruckFleet
from .cart_motion import CartMotion

# Duration of a stop that lasts for ever [s].
FOR_EVER = 1e6


class Stop(NamedTuple):
    """A wait of a combine for a cart.

    Attributes:
        combine: Its number.
        station: Where it stands [m].
        duration: How long [s].
    """

    combine: int
    station: float
    duration: float


def ended(plan: TimedPath, until: float = FOR_EVER) -> TimedPath:
    """A plan that is cut off at some time, or at a stop that lasts for ever.

    Args:
        plan: Of the combine.
        until: The time [s].
    """
    kept = plan.times < until
    times, stations, speeds = plan.times[kept], plan.stations[kept], plan.speeds[kept]
    if not kept.all() and until < FOR_EVER:
        times = np.append(times, until)
        stations = np.append(stations, plan.station_at(until))
        speeds = np.append(speeds, plan.speed_at(until))
    return TimedPath(plan.path, times, stations, speeds)


@dataclass(frozen=True, kw_only=True)
class Supply:
    """The crop that carts take over, and the trucks to which they bring it.

    Attributes:
        density: Of the crop [kg/m^2].
        trucks: Pose of the tractor where each cart begins and is emptied, shape (K, 3).
        truck_rate: Rate at which a cart is emptied [kg/s].
        truck_fleet: The trucks that take the grain there; a truck comes to the cart.
    """

    density: float | YieldMap
    trucks: np.ndarray
    truck_rate: float = 300.0
    truck_fleet: TruckFleet = TruckFleet()  # noqa: RUF009  # It is frozen.


class CartVisit(NamedTuple):
    """A cart's time beside a combine.

    Attributes:
        cart, combine: Their numbers.
        begin, end: When grain flows [s].
        taken: Grain that it takes [kg].
    """

    cart: int
    combine: int
    begin: float
    end: float
    taken: float


class Trip(NamedTuple):
    """A cart's time at its truck.

    Attributes:
        cart: Its number.
        begin, end: When it comes, and when it is empty; it may wait for trucks [s].
        delivered: [kg].
        fillings: Of trucks, in order, at least one.
    """

    cart: int
    begin: float
    end: float
    delivered: float
    fillings: tuple[Filling, ...]


class Job(NamedTuple):
    """What a cart does in one go, from standing to standing again where no combine comes.

    Attributes:
        motion: All of it.
        visit, trip: What it is for.
        stop: Of the combine that waits for it.
    """

    motion: CartMotion
    visit: CartVisit | None
    trip: Trip | None
    stop: Stop | None

    @property
    def begin(self) -> float:
        """When the cart sets out [s]."""
        return float(self.motion.timed.times[0])

    @property
    def end(self) -> float:
        """When the cart is free again [s]."""
        return self.trip.end if self.trip else self.motion.timed.end


class Failure(NamedTuple):
    """A cart fails for good: it finishes its job, is emptied, and serves no combine any more.

    Attributes:
        cart: Its number.
        time: When [s].
    """

    cart: int
    time: float


@dataclass(frozen=True, eq=False)
class CartPlan:
    """What all carts do, and what that asks of combines.

    Attributes:
        plans: Of the combines, with their stops.
        motions: Of the carts.
        visits, trips: In order of their beginnings.
        stops: Waits of combines for carts; each is a miss.
        left: Grain that no cart gets, in tanks and in carts at the end [kg].
    """

    plans: list[TimedPath]
    motions: list[CartMotion]
    visits: list[CartVisit]
    trips: list[Trip]
    stops: list[Stop]
    left: float
