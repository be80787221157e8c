"""What carts can achieve with one visit to each combine a round.

**The sequential strategy.** A round without trips to a truck visits each combine once. With rho_n =
r_fn / r_un and ways of D in all, a cart that never waits has the period P = D / (1 - sum rho_n) and
finds the loads L_n = r_fn (1 - rho_n) P. No other sequential strategy finds less, because in any
period the cart must stay with combine n at least as long as unloading what it cut takes, rho_n P.
"""

import math
from collections.abc import Iterable, Iterator
from functools import lru_cache
from itertools import product

import numpy as np

from .fleet import Fleet, Round, Truck, round_of, sequential_round
from .periodic_plan import Aim, plan_round, travel_scale_max
from .word_limit import tanks_of, ways_of, word_limit

# A round of more visits is not worth the wait.
_LONGEST_ROUND = 48
# Combines up to which all choices of trips are tried.
_ALL_TRIPS = 7
# How many of the best rounds are compared by their exact factors, and by their trips.
_JUDGED = 4


def unloading_share(fleet: Fleet, combines: Iterable[int]) -> float:
    """Part of a cart's time that goes into unloading alone, sum of r_f / r_u; less than 1."""
    return math.fsum(fleet.fill_rates[n] / fleet.unload_rates[n] for n in combines)


def earliest_loads(fleet: Fleet, round_: Round) -> tuple[float, ...]:
    """L_n of a cart that visits each combine once, never waits and needs no truck, (V,) [kg]."""
    spare = 1.0 - unloading_share(fleet, round_.combines)
    driving = math.fsum(round_.travel_times)
    if driving == 0:
        period = 0.0 if spare >= -1e-12 else math.inf
    else:
        period = driving / spare if spare > 0 else math.inf
    return tuple(
        fleet.fill_rates[n] * (1.0 - fleet.fill_rates[n] / fleet.unload_rates[n]) * period
        for n in round_.combines
    )


def driving_scale(fleet: Fleet, round_: Round) -> float:
    """Largest factor by which all driving could be slower; less than 1: there is no schedule."""
    if round_.truck is not None or round_.carts > 1:
        return travel_scale_max(fleet, round_)
    loads = earliest_loads(fleet, round_)
    scales = [
        fleet.capacities[n] / load if load > 0 else math.inf
        for n, load in zip(round_.combines, loads, strict=True)
    ]
    return min(scales)


def first_to_overflow(fleet: Fleet, round_: Round) -> tuple[int, ...]:
    """The combines whose tanks are the first to run over if the cart gets slower."""
    once = len(set(round_.combines)) == round_.size
    if round_.truck is None and round_.carts == 1 and once:
        loads = earliest_loads(fleet, round_)
    else:
        early = plan_round(fleet, round_, aim=Aim.EARLY)
        loads = (math.inf,) if early is None else early.loads_at_start
    if not all(math.isfinite(load) for load in loads):
        return tuple(sorted(set(round_.combines)))
    parts = [load / fleet.capacities[n] for n, load in zip(round_.combines, loads, strict=True)]
    worst = max(parts) * (1.0 - 1e-9)
    return tuple(n for n, part in zip(round_.combines, parts, strict=True) if part >= worst)


@lru_cache(maxsize=4096)
def best_round(fleet: Fleet, order: tuple[int, ...], truck: Truck | None) -> tuple[Round, float]:
    """The round that leaves most time for driving, and its `driving_scale`.

    With a truck, every number of visits from trip to trip is tried, up to what the cart can hold.
    Of equally good rounds the one with fewest trips is taken.

    Args:
        fleet: The combines.
        order: Order in which they are served.
        truck: Where carts unload, if anywhere.
    """
    if truck is None:
        round_ = sequential_round(fleet, order)
        return round_, driving_scale(fleet, round_)
    rounds = [
        sequential_round(fleet, order, truck, every)
        for every in _trip_intervals(fleet, order, truck)
    ]
    served = fleet.part(order)
    tanks, ways = tanks_of(served), ways_of(served, truck)
    limits = [
        word_limit(np.arange(each.size) % len(order), np.array(each.trips), tanks, ways, 0.0)
        for each in rounds
    ]
    promising = sorted(range(len(rounds)), key=lambda number: -limits[number])[:_JUDGED]
    best: tuple[Round, float] | None = None
    for number in sorted(promising):
        scale = driving_scale(fleet, rounds[number])
        if best is None or scale >= best[1] * (1.0 - 1e-9):
            best = rounds[number], scale
    assert best is not None  # a trip after every visit is always among them
    return best


def best_rotation(
    fleet: Fleet, order: tuple[int, ...], truck: Truck | None, carts: int
) -> tuple[Round, float]:
    """The round that several carts make one after another, and its `driving_scale`.

    With a truck, every choice of visits after which to drive by it is tried for a few combines,
    and evenly spaced trips for more.

    Args:
        fleet: The combines.
        order: Order in which they are served.
        truck: Where carts unload, if anywhere.
        carts: How many there are, at least two.
    """
    size = len(order)
    if truck is None:
        choices: list[tuple[bool, ...]] = [(False,) * size]
    elif size <= _ALL_TRIPS:
        choices = [trips for trips in product((False, True), repeat=size) if any(trips)]
    else:
        everies = [every for every in range(1, size + 1) if size % every == 0]
        choices = [tuple((n + 1) % every == 0 for n in range(size)) for every in everies]
    rounds = [round_of(fleet, order, trips, truck, carts) for trips in choices]
    # Of equally good rounds the one with fewest trips.
    scales = [(round(driving_scale(fleet, each), 9), -sum(each.trips)) for each in rounds]
    best = max(range(len(rounds)), key=lambda number: scales[number])
    return rounds[best], scales[best][0]


def _trip_intervals(fleet: Fleet, order: tuple[int, ...], truck: Truck) -> Iterator[int]:
    """Numbers of visits from one trip to the next that are worth a try, in rising order."""
    size = len(order)
    # At the most, a cart has to hold a full tank from every visit.
    laps = truck.cart_capacity / math.fsum(fleet.capacities[n] for n in order)
    most = max(2 * size, size * (math.ceil(laps) + 1))
    # A round has no fewer visits than there are to a trip, however much a cart holds.
    for every in range(1, min(most, _LONGEST_ROUND) + 1):
        if math.lcm(every, size) <= _LONGEST_ROUND and (every <= 2 * size or every % size == 0):
            yield every
