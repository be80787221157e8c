"""What carts can achieve with one visit to each combine a round, and what no strategy beats.

**The sequential strategy.** A round without trips to a truck visits each combine once. With rho_n =
r_fn / r_un and ways of D in all, a cart that never waits has the period P = D / (1 - sum rho_n) and
finds the loads L_n = r_fn (1 - rho_n) P. No other sequential strategy finds less, because in any
period the cart must stay with combine n at least as long as unloading what it cut takes, rho_n P.

**The bound for all strategies.** On average over time, carts stay with combine n for a share s_n of
it, at least r_f / r_u, since the auger delivers no faster. From one visit to the next at most C /
r_f passes, or the tank runs over, so that visits per second are at least (1 - s_n) r_f / C. Each
visit takes a way to the combine and a way on from it, as many ways end at a combine as begin there,
and carts must drive by the truck as often as the grain fills a cart. All this takes no more time
than the carts have:

    sum s_n + sum (ways per second) x (time of the way) + (time at the truck) <= carts.

A linear programme makes the left side as small as it can be; the bound is the largest factor on all
ways with which it still fits. Nothing is assumed about the order, the strategy, or who shares what,
so that the bound holds for all of them. A single cart, moreover, cannot stay for ever among some of
the combines; this links them.
"""

import math
from collections.abc import Callable, Iterable, Iterator
from functools import lru_cache
from itertools import combinations, product

import numpy as np
from scipy.optimize import linprog

from .fleet import Fleet, Round, Truck, round_of, sequential_round, way_by_truck
from .periodic_plan import Aim, plan_round, travel_scale_max
from .word_limit import tanks_of, ways_of, word_limit

# A round of more visits is not worth the wait.
_LONGEST_ROUND = 48
# Combines up to which all choices of trips are tried.
_ALL_TRIPS = 7
# How many of the best rounds are compared by their exact factors, and by their trips, and by which
# part of the best one's their limits may be less.
_JUDGED, _EQUAL = 4, 1e-6


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
    least = limits[promising[0]] * (1.0 - _EQUAL)
    best: tuple[Round, float] | None = None
    for number in sorted(each for each in promising if not limits[each] < least):
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


# Combines up to which each subset is a constraint of one cart.
_ALL_SUBSETS = 8
# If ways longer by this factor still fit, driving does not count.
_FARTHEST = 1e12


def last_factor(
    holds: Callable[[float], bool], low: float, high: float, accuracy: float, most: float
) -> tuple[float, float]:
    """Two factors close together: a condition holds at the first and fails at the second.

    Both are infinite if it still holds beyond `most`.

    Args:
        holds: The condition; it holds at `low`, and once it fails it fails for all larger factors.
        low: Where the search begins [-].
        high: The first factor that is tried; it is doubled while the condition holds [-].
        accuracy: Largest difference of the two, as a part of the second [-].
        most: Factor beyond which the search ends [-].
    """
    while holds(high):
        if high > most:
            return math.inf, math.inf
        low, high = high, 2.0 * high
    while high - low > accuracy * high:
        middle = (low + high) / 2
        low, high = (middle, high) if holds(middle) else (low, middle)
    return low, high


def certain_limit(fleet: Fleet, carts: int, truck: Truck | None = None) -> float:
    """The factor on all ways beyond which no strategy keeps every tank from running over.

    Less than 1: no strategy does as things are. 0: none does even if driving took no time.
    Infinite: driving does not count.

    Args:
        fleet: The combines.
        carts: How many there are.
        truck: Where carts of finite capacity unload; none: they hold any amount.
    """
    if _standing(fleet, truck) > carts * (1.0 + 1e-12):
        return 0.0
    programme = _Averages(fleet, carts, truck)

    def fits(factor: float) -> bool:
        return programme.least_time(factor) <= carts

    return math.inf if fits(_FARTHEST) else last_factor(fits, 0.0, 1.0, 1e-9, _FARTHEST)[1]


def is_excluded(fleet: Fleet, carts: int, truck: Truck | None = None) -> bool:
    """Whether it is certain that no strategy keeps every tank from running over.

    Args:
        fleet: The combines.
        carts: How many there are.
        truck: Where carts of finite capacity unload, if anywhere.
    """
    if _standing(fleet, truck) > carts * (1.0 + 1e-12):
        return True
    return _Averages(fleet, carts, truck).least_time(1.0) > carts * (1.0 + 1e-9)


def least_carts(fleet: Fleet, truck: Truck | None = None) -> int:
    """Least number of carts that could keep every tank from running over, whatever they do.

    Args:
        fleet: The combines.
        truck: Where carts of finite capacity unload, if anywhere.
    """
    many = 2 * fleet.size
    busy = max(_standing(fleet, truck), _Averages(fleet, many, truck).least_time(1.0))
    return max(1, math.ceil(busy * (1.0 - 1e-9)))


def _standing(fleet: Fleet, truck: Truck | None) -> float:
    """How many carts would be busy on average if driving took no time."""
    busy = math.fsum(f / u for f, u in zip(fleet.fill_rates, fleet.unload_rates, strict=True))
    if truck is not None:
        cut = math.fsum(fleet.fill_rates)
        busy += cut / truck.unload_rate + truck.stop_time * cut / truck.cart_capacity
    return busy


class _Averages:
    """The programme; unknowns: N shares, and per second N^2 direct ways and N^2 by the truck."""

    def __init__(self, fleet: Fleet, carts: int, truck: Truck | None) -> None:
        size = fleet.size
        pairs = [(here, there) for here in range(size) for there in range(size)]
        fill, unload = np.array(fleet.fill_rates), np.array(fleet.unload_rates)
        filling = np.array(fleet.capacities) / fill
        self._ways = np.array([fleet.travel_times[here][there] for here, there in pairs])
        self._by_truck = np.zeros(len(pairs))
        self._rest = 0.0
        rows, limits = [], []
        shape = size + 2 * len(pairs)

        def row_of(
            ways: list[tuple[int, int]], sign: float, shares: dict[int, float]
        ) -> np.ndarray:
            row = np.zeros(shape)
            for here, there in ways:
                place = size + here * size + there
                row[place] += sign
                row[place + len(pairs)] += sign
            for n, value in shares.items():
                row[n] = value
            return row

        for n in range(size):
            ways = [(n, there) for there in range(size)]
            rows.append(row_of(ways, -1.0, {n: -1.0 / filling[n]}))
            limits.append(-1.0 / filling[n])
        if carts == 1 and size <= _ALL_SUBSETS:
            for count in range(1, size):
                for inside in combinations(range(size), count):
                    outside = [n for n in range(size) if n not in inside]
                    ways = [(here, there) for here in inside for there in outside]
                    rows.append(row_of(ways, -1.0, {}))
                    within = min(filling[n] for n in outside)
                    without = min(filling[list(inside)])
                    limits.append(-1.0 / (within + without))
        equal = []
        for n in range(size):
            leaving = row_of([(n, there) for there in range(size)], 1.0, {})
            equal.append(leaving - row_of([(here, n) for here in range(size)], 1.0, {}))
        bounds: list[tuple[float, float | None]] = [
            (float(share), float(carts)) for share in fill / unload
        ]
        bounds += [(0.0, 0.0 if here == there else None) for here, there in pairs]
        if truck is None:
            bounds += [(0.0, 0.0)] * len(pairs)
        else:
            self._by_truck[:] = [way_by_truck(fleet, truck, here, there) for here, there in pairs]
            bounds += [(0.0, None)] * len(pairs)
            row = np.zeros(shape)
            row[size + len(pairs) :] = -1.0
            rows.append(row)
            limits.append(-fill.sum() / truck.cart_capacity)
            self._rest = fill.sum() / truck.unload_rate
        self._stop = 0.0 if truck is None else truck.stop_time
        self._size, self._rows, self._limits = size, np.array(rows), np.array(limits)
        self._equal, self._bounds = np.array(equal), bounds

    def least_time(self, factor: float) -> float:
        """How many carts are busy on average, at least, with ways that are longer by a factor."""
        cost = np.concatenate(
            [
                np.ones(self._size),
                factor * self._ways,
                factor * self._by_truck + self._stop,
            ]
        )
        answer = linprog(
            cost,
            A_ub=self._rows,
            b_ub=self._limits,
            A_eq=self._equal,
            b_eq=np.zeros(self._size),
            bounds=self._bounds,
            method="highs",
        )
        return math.inf if answer.status != 0 else float(answer.fun) + self._rest
