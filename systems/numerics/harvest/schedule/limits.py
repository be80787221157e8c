"""How far carts reach that never wait: with one visit to each combine, and by every short word.

**The sequential strategy.** A round without trips to a truck visits each combine once. With rho_n =
r_fn / r_un and ways of D in all, a cart that never waits has the period P = D / (1 - sum rho_n) and
finds the loads L_n = r_fn (1 - rho_n) P. No other sequential strategy finds less, because in any
period the cart must stay with combine n at least as long as unloading what it cut takes, rho_n P.

**Short words.** A word is what a cart repeats: which combine each visit is to, and after which it
drives by the truck. With a cart that never waits and empties each tank the loads x of a word solve

    x_i = r_f (ways and stays since the cart last left that combine),  stay_j = x_j / (r_u - r_f),

which is linear in x and in a factor on all ways: x = x_0 + factor x_1, x_0 from the time at the
truck. The factor at which the first tank, or the cart, is full follows without any search.
"""

import math
from collections.abc import Iterable, Iterator
from functools import lru_cache
from itertools import pairwise, product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...compiled import compiled, kernel
from .fleet import Fleet, Round, Truck, round_of, sequential_round, way_by_truck
from .periodic_plan import Aim, plan_round, travel_scale_max

Vector = NDArray[np.float64]

Words = NDArray[np.int64]

# A round of more visits is not worth the wait.
_LONGEST_ROUND = 48
# Combines up to which all choices of trips are tried.
_ALL_TRIPS = 7
# Numbers of visits to a trip that are judged by a programme.
_JUDGED = 4


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


@lru_cache
def words_of(combines: int, most: int) -> tuple[Words, ...]:
    """Words of visits to all of N combines, none twice in a row, each once up to rotation.

    Args:
        combines: N, at least 2.
        most: Visits of the longest words.

    Returns:
        For each length from N on those of that length, (W, length).
    """
    found = []
    for size in range(combines, most + 1):
        words = [
            word
            for tail in product(range(combines), repeat=size - 1)
            if _is_first_of_its_rotations(word := (0, *tail), combines)
        ]
        found.append(np.array(words, dtype=np.int64).reshape(-1, size))
    return tuple(found)


def _is_first_of_its_rotations(word: tuple[int, ...], combines: int) -> bool:
    if len(set(word)) < combines or any(here == there for here, there in pairwise((*word, 0))):
        return False
    turns = (word[place:] + word[:place] for place, n in enumerate(word) if n == 0)
    return all(word <= turn for turn in turns)


def emptying_limit(fleet: Fleet, round_: Round) -> float:
    """The factor on all ways with which a cart that empties each tank just has a schedule.

    0 or less: there is none. Of one cart, which never waits.

    Args:
        fleet: The combines.
        round_: Its visits.
    """
    words, trips = np.array([round_.combines]), np.array([round_.trips])
    return float(limits_of(words, trips, tanks_of(fleet), ways_of(fleet, round_.truck))[0, 0])


@compiled
def limits_of(words: Words, trips: NDArray[np.bool_], tanks: Tanks, ways: Ways) -> Vector:
    """The factor on all ways with which each word just fills a tank or the cart, (W, T).

    0 or less: there is none.

    Args:
        words: Of one length, (W, V).
        trips: Choices of visits after which the cart drives by the truck, (T, V).
        tanks: What is visited.
        ways: Between visits.
    """
    fill_rates, net_rates = tanks.fill_rates, tanks.net_rates
    size = words.shape[1]
    limits = np.zeros((len(words), len(trips)))
    rows = np.zeros((size, size + 2))
    for number in range(len(words)):
        word = words[number]
        for choice in range(len(trips)):
            trip = trips[choice]
            rows[:] = 0.0
            for visit in range(size):
                rows[visit, visit] = 1.0
                rate = fill_rates[word[visit]]
                there = visit
                while True:
                    here = there - 1 if there > 0 else size - 1
                    if trip[here]:
                        rows[visit, size] += rate * ways.stop
                        rows[visit, size + 1] += rate * ways.by_truck[word[here], word[there]]
                        # What the truck gets: all visits back to the trip before.
                        load = here
                        while True:
                            net = net_rates[word[load]]
                            grain = (net + fill_rates[word[load]]) / net
                            rows[visit, load] -= rate * ways.unloading * grain
                            load = load - 1 if load > 0 else size - 1
                            if trip[load] or load == here:
                                break
                    else:
                        rows[visit, size + 1] += rate * ways.direct[word[here], word[there]]
                    if word[here] == word[visit]:
                        break
                    rows[visit, here] -= rate / net_rates[word[here]]
                    there = here
            limits[number, choice] = _limit(rows, word, trip, tanks, ways.room)
    return limits


@kernel
def _limit(rows: Vector, word: Words, trip: NDArray[np.bool_], tanks: Tanks, room: float) -> float:
    """The factor of one word from its equations, which are solved in place."""
    capacities, fill_rates, net_rates = tanks
    size = len(word)
    # Diagonally dominant where there is a solution with loads that are not negative.
    for pivot in range(size):
        if rows[pivot, pivot] <= 1e-12:
            return 0.0
        for row in range(size):
            if row != pivot and rows[row, pivot] != 0.0:
                part = rows[row, pivot] / rows[pivot, pivot]
                for column in range(pivot, size + 2):
                    rows[row, column] -= part * rows[pivot, column]
    limit = np.inf
    for visit in range(size):
        fixed = rows[visit, size] / rows[visit, visit]
        grows = rows[visit, size + 1] / rows[visit, visit]
        if fixed < 0.0 or grows < 0.0:
            return 0.0
        if grows > 0.0:
            limit = min(limit, (capacities[word[visit]] - fixed) / grows)
        elif fixed > capacities[word[visit]]:
            return 0.0
    for visit in range(size):
        if not trip[visit]:
            continue
        fixed, grows, load = 0.0, 0.0, visit
        while True:
            net = net_rates[word[load]]
            grain = (net + fill_rates[word[load]]) / net
            fixed += grain * rows[load, size] / rows[load, load]
            grows += grain * rows[load, size + 1] / rows[load, load]
            load = load - 1 if load > 0 else size - 1
            if trip[load] or load == visit:
                break
        if grows > 0.0:
            limit = min(limit, (room - fixed) / grows)
        elif fixed > room:
            return 0.0
    return limit


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
    """By which factor all driving could at most be slower; less than 1: there is no schedule."""
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

    With a truck, trips after every number of visits are tried, up to what the cart can hold.
    Among equals the one with fewest trips.

    Args:
        fleet: The combines.
        order: In which they are served.
        truck: Where carts unload, if anywhere.
    """
    if truck is None:
        round_ = sequential_round(fleet, order)
        return round_, driving_scale(fleet, round_)
    rounds = [
        sequential_round(fleet, order, truck, every)
        for every in _trip_intervals(fleet, order, truck)
    ]
    # What a cart can do that empties every tank says which are worth a programme.
    limits = [emptying_limit(fleet, round_) for round_ in rounds]
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
    and trips at equal distances for more.

    Args:
        fleet: The combines.
        order: In which they are served.
        truck: Where carts unload, if anywhere.
        carts: How many there are, at least two.
    """
    size = len(order)
    if truck is None:
        choices: list[tuple[bool, ...]] = [(False,) * size]
    elif size <= _ALL_TRIPS:
        # After the last visit in any case: which visit is the first makes no difference.
        choices = [(*trips, True) for trips in product((False, True), repeat=size - 1)]
    else:
        everies = [every for every in range(1, size + 1) if size % every == 0]
        choices = [tuple((n + 1) % every == 0 for n in range(size)) for every in everies]
    rounds = [round_of(fleet, order, trips, truck, carts) for trips in choices]
    # Of equals the one with fewest trips.
    scales = [(round(driving_scale(fleet, each), 9), -sum(each.trips)) for each in rounds]
    best = max(range(len(rounds)), key=lambda number: scales[number])
    return rounds[best], scales[best][0]


def _trip_intervals(fleet: Fleet, order: tuple[int, ...], truck: Truck) -> Iterator[int]:
    """Numbers of visits from one trip to the next that are worth a try, in rising order."""
    size = len(order)
    # Full tanks in every visit: what a cart has to hold at the most.
    laps = truck.cart_capacity / math.fsum(fleet.capacities[n] for n in order)
    most = max(2 * size, size * (math.ceil(laps) + 1))
    # A round has no fewer visits than there are to a trip, however much a cart holds.
    for every in range(1, min(most, _LONGEST_ROUND) + 1):
        if math.lcm(every, size) <= _LONGEST_ROUND and (every <= 2 * size or every % size == 0):
            yield every
