"""The visits that leave one cart most time to drive, in whatever order.

One visit to each combine a round is enough where they are alike. Where one fills faster than the
others the cart comes to it more often, and where its own room is small it drives by the truck in
between. For a few combines all words of up to twice as many visits are looked at; for these and
others `search_visits` proposes orders until it ends without another one that would let the cart
drive slower. `travel_scale_max` judges them all.

**The search for any order** that one cart can keep up for ever is exhaustive.

A cart empties every tank that it comes to, or fills itself and drives by the truck, and never
waits: of two carts that do the same, the earlier one finds less in every tank, so that waiting
and idle ways help nobody. What is left to choose is the order of the visits, with or without a
way by the truck before each.

The search goes through all orders, depth first, from the best state that there can be: every
tank empty. A branch ends where some tank must run over before the cart can be there, or where it
comes to a state that is no better than one from which every order has failed. It has found an
answer where it comes to a state that is no worse than an earlier one of the same branch: the
visits between the two can be repeated for ever.

Without a truck the search is exact: loads grow with the loads before them, so that an order that
fails from a state fails from every worse one. If it ends without an answer, every order of visits
lets some tank run over, however they are chosen. With a truck a cart that is full leaves sooner,
and what it finds is a proposal that `travel_scale_max` judges.
"""

import math
from dataclasses import dataclass, replace
from enum import Enum
from functools import lru_cache
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...compiled import compiled, kernel
from .certain_limit import is_excluded, last_factor
from .fleet import Fleet, Round, Truck, round_of
from .limits import (
    Tanks,
    Ways,
    best_rotation,
    best_round,
    limits_of,
    tanks_of,
    unloading_share,
    ways_of,
    words_of,
)
from .periodic_plan import plan_round, travel_scale_max

Vector = NDArray[np.float64]

# Visits in a row that a branch may have, and states kept for each combine of those that failed.
_DEEPEST, _KEPT = 400, 10_000
# Part of an amount that rounding may cost.
_ROUNDING = 1e-12
# Part of a tank by which a state that comes back may differ: from empty tanks loads only rise
# towards those of the round that they end in.
_BACK = 1e-4
_FAILED, _FOUND, _GIVEN_UP = 0, 1, 2

# By which factor a better order must let the cart be slower, and orders that are tried at most.
ACCURACY = 1e-3
_ORDERS = 30
# Visits that a search may try: a few tenths of a second; all that seven combines take.
_MOST_VISITS, _MOST_VISITS_BY_TRUCK = 250_000, 30_000
# Combines up to which all short words are looked at, how many of them are judged, and which part
# of the best limit of carts that empty every tank they must have.
_FEW, _JUDGED, _NEAR = 4, 24, 0.9
# Where the cart has no plan at all as it is, ways this much quicker are tried first.
_LEAST = 1e-3


class Outcome(Enum):
    """How a search ended."""

    FOUND = "found"  # these visits can be repeated for ever
    NONE = "none"  # every order lets a tank run over
    GIVEN_UP = "given up"  # after as many visits as were allowed


class VisitSearch(NamedTuple):
    """What a search says.

    Attributes:
        outcome: How it ended.
        combines: The visits to repeat, (V,); empty unless they were found.
        trips: Whether the cart drives by the truck after each, (V,).
        visits: How many were tried in all.
    """

    outcome: Outcome
    combines: tuple[int, ...]
    trips: tuple[bool, ...]
    visits: int


def search_visits(tanks: Tanks, ways: Ways, most_visits: int) -> VisitSearch:
    """Look for visits to all tanks that one cart can repeat for ever.

    Args:
        tanks: What is visited.
        ways: Between visits.
        most_visits: After which the search is given up.
    """
    order = np.zeros(_DEEPEST, dtype=np.int64)
    trip = np.zeros(_DEEPEST, dtype=np.bool_)
    outcome, first, last, visits = _search(tanks, ways, most_visits, order, trip)
    if outcome != _FOUND:
        ended = Outcome.NONE if outcome == _FAILED else Outcome.GIVEN_UP
        return VisitSearch(ended, (), (), visits)
    places = range(first, last + 1)
    # `trip` is of the way to a visit; the way to the first is the one after the last.
    after = [*places[1:], places[0]]
    return VisitSearch(
        Outcome.FOUND,
        tuple(int(order[place]) for place in places),
        tuple(bool(trip[place]) for place in after),
        visits,
    )


@compiled
def _search(
    tanks: Tanks,
    ways: Ways,
    most_visits: int,
    order: NDArray[np.int64],
    trip: NDArray[np.bool_],
) -> tuple[int, int, int, int]:
    """The outcome; first and last place in `order` of what can be repeated; visits tried."""
    capacities, fill_rates, net_rates = tanks
    direct, room = ways.direct, ways.room
    count = len(capacities)
    choices = 2 * count if np.isfinite(room) else count
    # Of each state of the branch: tanks, what the cart holds, time, and the next choice to try.
    loads = np.zeros((_DEEPEST, count))
    held = np.zeros(_DEEPEST)
    times = np.zeros(_DEEPEST)
    tried = np.zeros(_DEEPEST, dtype=np.int64)
    ranking = np.zeros((_DEEPEST, choices), dtype=np.int64)
    # Of each combine, the states there that failed: tanks, then what the cart holds.
    failed = np.zeros((count, _KEPT, count + 1))
    kept = np.zeros(count, dtype=np.int64)
    visits = 0
    urgency = np.zeros(choices)
    visited = np.zeros(count, dtype=np.bool_)
    for start in range(count):
        depth = 0
        order[0], held[0], tried[0] = start, 0.0, 0
        loads[0, :] = 0.0
        _rank(ranking[0], urgency, loads[0], start, tanks, direct)
        while depth >= 0:
            if tried[depth] == choices:
                # The oldest are forgotten first.
                here = order[depth]
                failed[here, kept[here] % _KEPT, :count] = loads[depth]
                failed[here, kept[here] % _KEPT, count] = held[depth]
                kept[here] += 1
                depth -= 1
                continue
            choice = ranking[depth, tried[depth]]
            tried[depth] += 1
            here, there = order[depth], choice % count
            goes_by_truck = choice >= count
            full = held[depth] >= room * (1.0 - _ROUNDING)
            if goes_by_truck:
                if held[depth] == 0.0:
                    continue
                way = ways.by_truck[here, there] + ways.stop + held[depth] * ways.unloading
                holds = 0.0
            else:
                if here == there or full:
                    continue
                way = direct[here, there]
                holds = held[depth]
            visits += 1
            if visits > most_visits or depth + 1 == _DEEPEST:
                return _GIVEN_UP, 0, 0, visits
            load = loads[depth, there] + fill_rates[there] * way
            if load > capacities[there] * (1.0 + _ROUNDING):
                continue
            stay = load / net_rates[there]
            rate = net_rates[there] + fill_rates[there]
            left_over = 0.0
            if holds + rate * stay > room:
                stay = (room - holds) / rate
                left_over = load - net_rates[there] * stay
                holds = room
            else:
                holds += rate * stay
            passed = way + stay
            below = depth + 1
            for k in range(count):
                loads[below, k] = loads[depth, k] + fill_rates[k] * passed
            loads[below, there] = left_over
            if not _all_in_time(loads[below], there, tanks, direct, choices == count):
                continue
            held[below], times[below], order[below] = holds, times[depth] + passed, there
            trip[below] = goes_by_truck
            if _is_hopeless(loads[below], holds, failed[there], int(min(kept[there], _KEPT))):
                continue
            idle = False
            missing = count
            # What a cart holds comes back only by way of the truck.
            emptied = choices == count
            visited[:] = False
            for place in range(depth, -1, -1):
                emptied = emptied or trip[place + 1]
                if not visited[order[place + 1]]:
                    visited[order[place + 1]] = True
                    missing -= 1
                if order[place] != there or not _is_back(
                    loads[below], holds, loads[place], held[place], capacities, room
                ):
                    continue
                if times[below] <= times[place]:
                    # A way round that takes no time.
                    idle = True
                    break
                if missing == 0 and emptied:
                    return _FOUND, place + 1, below, visits
            if idle:
                continue
            depth = below
            tried[depth] = 0
            _rank(ranking[depth], urgency, loads[depth], there, tanks, direct)
    return _FAILED, 0, 0, visits


@kernel
def _rank(
    ranking: NDArray[np.int64],
    urgency: Vector,
    loads: Vector,
    here: int,
    tanks: Tanks,
    direct: Vector,
) -> None:
    """Put the choices in order: first the combine that must be left for soonest."""
    count = len(loads)
    for choice in range(len(ranking)):
        there = choice % count
        filling = (tanks.capacities[there] - loads[there]) / tanks.fill_rates[there]
        spare = filling - direct[here, there]
        urgency[choice] = spare
        place = choice
        # Direct ways come before those by the truck, which follow in the numbers.
        while place > 0 and urgency[ranking[place - 1]] > spare:
            ranking[place] = ranking[place - 1]
            place -= 1
        ranking[place] = choice


@kernel
def _all_in_time(loads: Vector, here: int, tanks: Tanks, direct: Vector, empties: bool) -> bool:
    """Whether each tank, and each of any two after the other, can be come to in time.

    Args:
        loads: Of the tanks now.
        here: Where the cart is.
        tanks: All of them.
        direct: Ways.
        empties: Whether a cart stays until a tank is empty.
    """
    capacities, fill_rates, net_rates = tanks
    count = len(loads)
    for k in range(count):
        if loads[k] + fill_rates[k] * direct[here, k] > capacities[k] * (1.0 + _ROUNDING):
            return False
    for k in range(count):
        if k == here:
            continue
        for other in range(k):
            if other == here:
                continue
            possible = False
            for first, second in ((k, other), (other, k)):
                way = direct[here, first]
                load = loads[first] + fill_rates[first] * way
                stay = load / net_rates[first] if empties else 0.0
                way += stay + direct[first, second]
                load = loads[second] + fill_rates[second] * way
                if load <= capacities[second] * (1.0 + _ROUNDING):
                    possible = True
                    break
            if not possible:
                return False
    return True


@kernel
def _is_hopeless(loads: Vector, holds: float, failed: Vector, kept: int) -> bool:
    """Whether a state is no better than one at the same combine that has failed."""
    count = len(loads)
    for place in range(kept - 1, -1, -1):
        if failed[place, count] > holds:
            continue
        worse = True
        for k in range(count):
            if loads[k] < failed[place, k]:
                worse = False
                break
        if worse:
            return True
    return False


@kernel
def _is_back(
    loads: Vector,
    holds: float,
    before: Vector,
    held_before: float,
    capacities: Vector,
    room: float,
) -> bool:
    """Whether a state is as good as one before it, but for a little."""
    back = holds <= held_before or holds <= held_before + _BACK * room
    for k in range(len(loads)):
        back = back and loads[k] <= before[k] + _BACK * capacities[k]
    return back


@dataclass(frozen=True)
class BestVisits:
    """What one cart can do at best.

    Attributes:
        round: The visits.
        scale: By which factor all its driving could be slower; less than 1: there is no schedule.
        bound: By which factor it could be with any order of visits that empty the tanks, with
            certainty: all of them were looked at. Infinite: that is not known.
    """

    round: Round
    scale: float
    bound: float


@lru_cache(maxsize=4096)
def best_visits(
    fleet: Fleet, order: tuple[int, ...], truck: Truck | None = None, carts: int = 1
) -> BestVisits:
    """The visits to some combines with which a cart could drive slowest.

    Args:
        fleet: The combines.
        order: Those that are served; one visit to each in this order is the first candidate, and
            the only one of several carts.
        truck: Where carts unload; none: they hold any amount.
        carts: How many serve them, one after another.
    """
    if carts > 1:
        return BestVisits(*best_rotation(fleet, order, truck, carts), math.inf)
    round_, scale = best_round(fleet, order, truck)
    if not math.isfinite(scale) and scale > 0:
        return BestVisits(round_, scale, math.inf)
    for word in _short_words(fleet, order, truck):
        better = travel_scale_max(fleet, word)
        if better > scale * (1.0 + ACCURACY / 2):
            round_, scale = word, better
    for _ in range(_ORDERS):
        asked = max(scale, _LEAST) * (1.0 + ACCURACY)
        found, outcome = find_visits(fleet, order, truck, asked)
        if found is None:
            known = outcome is Outcome.NONE and truck is None
            return BestVisits(round_, scale, asked if known else math.inf)
        better = travel_scale_max(fleet, found)
        if better <= scale * (1.0 + ACCURACY / 2):
            break
        round_, scale = found, better
    return BestVisits(round_, scale, math.inf)


def _short_words(fleet: Fleet, order: tuple[int, ...], truck: Truck | None) -> list[Round]:
    """Rounds of at most twice as many visits as combines, of which one may be the best.

    Those with which a cart that empties each tank could drive slowest, and some that leave it
    little less: leaving grain behind can make up for that.
    """
    size = len(order)
    if not 2 <= size <= _FEW:
        return []
    if unloading_share(fleet, order) >= 1.0:
        return []
    served = fleet.part(order)
    tanks, ways = tanks_of(served), ways_of(served, truck)
    found: list[tuple[float, tuple[int, ...], tuple[bool, ...]]] = []
    for words in words_of(size, 2 * size):
        visits = words.shape[1]
        choices = [(False,) * visits]
        if truck is not None:
            choices = [trips for trips in product((False, True), repeat=visits) if any(trips)]
        limits = limits_of(words, np.array(choices), tanks, ways)
        for place in np.argsort(limits, axis=None)[::-1][:_JUDGED]:
            word, choice = np.unravel_index(place, limits.shape)
            combines = tuple(order[n] for n in words[word])
            found.append((float(limits[word, choice]), combines, choices[choice]))
    found.sort(key=lambda each: (-each[0], len(each[1])))
    least = _NEAR * found[0][0]
    return [
        round_of(fleet, combines, trips, truck)
        for limit, combines, trips in found[:_JUDGED]
        if 0.0 < limit >= least
    ]


def find_visits(
    fleet: Fleet, order: tuple[int, ...], truck: Truck | None, scale: float = 1.0
) -> tuple[Round | None, Outcome]:
    """Visits that a cart can keep up for ever with ways that are longer by a factor, if found.

    Args:
        fleet: The combines.
        order: Those that are served.
        truck: Where the cart unloads, if anywhere.
        scale: Factor on all ways.
    """
    # Where more is filled than a cart unloads nothing can be kept up.
    if unloading_share(fleet, order) > 1.0:
        return None, Outcome.NONE
    served = fleet.part(order)
    most_visits = _MOST_VISITS if truck is None else _MOST_VISITS_BY_TRUCK
    said = search_visits(tanks_of(served), ways_of(served, truck, scale), most_visits)
    if said.outcome is not Outcome.FOUND:
        return None, said.outcome
    # Begin where the order does, so that equal questions have equal answers.
    combines = [order[place] for place in said.combines]
    first = combines.index(order[0])
    combines = combines[first:] + combines[:first]
    trips = [*said.trips[first:], *said.trips[:first]]
    return round_of(fleet, combines, trips, truck), said.outcome


def is_served(fleet: Fleet, order: tuple[int, ...], truck: Truck | None, carts: int = 1) -> bool:
    """Whether carts can keep up some visits to these combines.

    Args:
        fleet: The combines.
        order: Those that are served.
        truck: Where carts unload, if anywhere.
        carts: How many serve them, one after another.
    """
    if is_excluded(fleet.part(order), carts, truck):
        return False
    if carts > 1:
        return best_rotation(fleet, order, truck, carts)[1] >= 1.0 - 1e-12
    if truck is None and best_round(fleet, order, truck)[1] >= 1.0 - 1e-12:
        return True
    found, _ = find_visits(fleet, order, truck, 1.0 + ACCURACY)
    if found is not None and plan_round(fleet, found) is not None:
        return True
    return truck is not None and best_round(fleet, order, truck)[1] >= 1.0 - 1e-12


def travel_time_limit(fleet: Fleet, round_: Round) -> float:
    """The largest factor on the ways between combines with which a round has a plan.

    Ways by the truck stay as they are, unless the way between the combines becomes longer.
    Without a truck the same as `travel_scale_max`.

    Args:
        fleet: The combines.
        round_: The visits.
    """
    if round_.truck is None:
        return travel_scale_max(fleet, round_)

    def works(factor: float) -> bool:
        rows = tuple(tuple(factor * way for way in row) for row in fleet.travel_times)
        slower = replace(fleet, travel_times=rows)
        again = round_of(slower, round_.combines, round_.trips, round_.truck, round_.carts)
        return travel_scale_max(slower, again) >= 1.0

    if not works(0.0):
        return -math.inf
    if not any(way for row in fleet.travel_times for way in row):
        return math.inf
    return last_factor(works, 0.0, 1.0, 1e-9, 1e9)[0]
