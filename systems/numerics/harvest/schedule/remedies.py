"""What to change, and by how much: each input by itself, to where there is just a schedule."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from .best_visits import is_served
from .carts import assign_combines
from .certain_limit import is_excluded
from .fleet import Fleet, Truck

# Of a factor: exact without a truck; with one each trial is a linear programme for every round.
_ACCURACY, _ACCURACY_WITH_TRUCK = 1e-12, 1e-3
# Nobody changes a machine by more.
_FARTHEST = 1e3


@dataclass(frozen=True)
class Remedies:
    """For each input the factor that makes or would still leave a schedule; nan: none does.

    For a schedule that is feasible the factors say how far each input may go.

    Attributes:
        factors: Name of an input to its factor, 0 or infinite where any will do. Travel times
            and fill rates may have at most that factor, the others must have at least that.
        combines: How many of the combines, from the first on, the carts can serve.
        carts: How many carts it takes to serve all; 0: no number does.
    """

    factors: dict[str, float]
    combines: int
    carts: int


def find_remedies(fleet: Fleet, carts: int = 1, truck: Truck | None = None) -> Remedies:
    """Every single change that turns the answer, by bisection of the exact condition.

    Combines stay with their carts, except where the number of either changes.
    """
    groups = assign_combines(fleet, carts, truck)
    accuracy = _ACCURACY if truck is None else _ACCURACY_WITH_TRUCK

    def least(change: Callable[[float], tuple[Fleet, Truck | None] | None]) -> float:
        """The smallest factor from which on there is a schedule."""

        def works(factor: float) -> bool:
            changed = change(factor)
            return changed is not None and all(
                is_served(changed[0], group.order, changed[1], group.carts) for group in groups
            )

        return _threshold(works, accuracy)

    def scaled(name: str, factor: float) -> Fleet:
        values = tuple(factor * value for value in getattr(fleet, name))
        return replace(fleet, **{name: values})

    def faster(factor: float) -> tuple[Fleet, Truck | None]:
        rows = tuple(tuple(time / factor for time in row) for row in fleet.travel_times)
        return replace(fleet, travel_times=rows), truck

    def slower_filling(factor: float) -> tuple[Fleet, Truck | None] | None:
        most = max(f / u for f, u in zip(fleet.fill_rates, fleet.unload_rates, strict=True))
        return (scaled("fill_rates", 1 / factor), truck) if most < factor else None

    def quicker_unloading(factor: float) -> tuple[Fleet, Truck | None] | None:
        most = max(f / u for f, u in zip(fleet.fill_rates, fleet.unload_rates, strict=True))
        return (scaled("unload_rates", factor), truck) if most < factor else None

    factors = {
        "travel_time": _inverse(least(faster)),
        "capacity": least(lambda factor: (scaled("capacities", factor), truck)),
        "fill_rate": _inverse(least(slower_filling)),
        "unload_rate": least(quicker_unloading),
    }
    if truck is not None:
        room = truck.cart_capacity
        factors["cart_capacity"] = least(
            lambda factor: (fleet, replace(truck, cart_capacity=factor * room))
        )
        factors["truck_travel_time"] = _inverse(
            least(lambda factor: (fleet, replace(truck, travel_time=truck.travel_time / factor)))
        )
    return Remedies(
        factors=factors,
        combines=_combines_served(fleet, carts, truck),
        carts=_carts_needed(fleet, truck),
    )


def is_feasible(fleet: Fleet, carts: int, truck: Truck | None) -> bool:
    """Whether some split of the combines leaves every cart time enough to drive."""
    if is_excluded(fleet, carts, truck):
        return False
    groups = assign_combines(fleet, carts, truck)
    return all(group.travel_scale >= 1.0 - 1e-12 for group in groups)


def _inverse(factor: float) -> float:
    return 1 / factor if factor else math.inf


def _threshold(works: Callable[[float], bool], accuracy: float) -> float:
    """The smallest factor that works, if all larger ones do; nan: none, 0: the smallest too."""
    low, high = 1.0, 1.0
    if works(1.0):
        while works(low):
            if low < 1 / _FARTHEST:
                return 0.0
            low, high = low / 2, low
    else:
        while not works(high):
            if high > _FARTHEST:
                return math.nan
            low, high = high, high * 2
    while high - low > accuracy * high:
        middle = (low + high) / 2
        if middle in (low, high):
            break
        low, high = (low, middle) if works(middle) else (middle, high)
    return high


def _combines_served(fleet: Fleet, carts: int, truck: Truck | None) -> int:
    """How many combines from the first on the carts can serve."""
    served = 0
    while served < fleet.size and is_feasible(fleet.part(range(served + 1)), carts, truck):
        served += 1
    return served


def _carts_needed(fleet: Fleet, truck: Truck | None) -> int:
    """The smallest number of carts that will do; 0: none."""
    counts = range(1, fleet.size + 1)
    return next((count for count in counts if is_feasible(fleet, count, truck)), 0)
