"""The visits, in any order, that leave one cart most time to drive.

One visit to each combine a round is enough where they are alike. Where one fills faster than the
others the cart comes to it more often, and where its own room is small it drives by the truck in
between. For a few combines `best_word` looks at all short words. Longer ones come from a search
through all orders if there is no truck; otherwise they grow from shorter ones.

**The search for any order** that one cart without a truck can keep up for ever is exhaustive.

A cart empties every tank that it comes to, and never waits: of two carts that do the same, the
earlier one finds less in every tank, so that waiting helps nobody. What is left to choose is the
order of the visits.

The search goes through all orders, depth first, from the best state that there can be: every
tank empty. A branch ends where some tank must run over before the cart can be there, or where it
comes to a state that is no better than one from which every order has failed. It has found an
answer where it comes to a state that is no worse than an earlier one of the same branch: the
visits between the two can be repeated for ever.

It is exact: loads grow with the loads before them, so that an order that fails from a state fails
from every worse one. If the search ends without an answer, every order of visits lets some tank run
over, however they are chosen.
"""

import math
from dataclasses import dataclass, replace
from enum import Enum
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...compiled import compiled, kernel
from .best_word import RatedWord, best_short_word, grown_word, rounds_of_all
from .fleet import Fleet, Round, Truck, round_of
from .limits import best_rotation, best_round, is_excluded, last_factor, unloading_share
from .periodic_plan import travel_scale_max
from .word_limit import Tanks, Vector, tanks_of, ways_of, word_limit

# Most visits in a branch, and most failed states that are kept for each combine.
_DEEPEST, _KEPT = 400, 10_000
# Relative error by rounding of loads, and of the limits of words [-].
_ROUNDING = 1e-9
# Part of a tank by which a state that recurs may differ: from empty tanks, loads only rise towards
# those of the round that the visits end in.
_BACK = 1e-4
_FAILED, _FOUND, _GIVEN_UP = 0, 1, 2

# By which part the factor of a better order must be larger, and most orders that are tried.
ACCURACY = 1e-3
_ORDERS = 30
# Visits that a search may try: a few tenths of a second; all that seven combines take.
_MOST_VISITS = 250_000
# Combines up to which all short words are looked at, and up to which words grow.
_FEW, _MOST_GROWN = 4, 7
# How many words of each length grow, and how many of these are changed: in search of the best ones,
# to decide whether some are enough, and for more than a few combines.
_SEARCHED, _DECIDED, _MANY = (36, 6), (6, 3), (2, 2)
# By which part a word must be better than another.
_BETTER = 1e-6
# Factor on ways that is tried first where no larger one is known for which the cart has a plan.
_LEAST = 1e-3
# From this factor on there is a schedule: 1, but for rounding.
ENOUGH = 1.0 - 1e-12
# Visits of the longest words that are all looked at, by the number of combines: at least two to
# each, and no more than take some hundredths of a second.
_ALL_UP_TO = {2: 10, 3: 8, 4: 8}


class Outcome(Enum):
    """How a search ended."""

    FOUND = "found"  # these visits can be repeated for ever
    NONE = "none"  # every order lets a tank run over
    GIVEN_UP = "given up"  # after as many visits as were allowed


class VisitSearch(NamedTuple):
    """Result of a search.

    Attributes:
        outcome: How it ended.
        combines: The visits to repeat, (V,); empty unless they were found.
        visits: How many were tried in all.
    """

    outcome: Outcome
    combines: tuple[int, ...]
    visits: int


def search_visits(tanks: Tanks, ways: Vector, most_visits: int) -> VisitSearch:
    """Look for visits to all tanks that one cart can repeat for ever.

    Args:
        tanks: What is visited.
        ways: From combine (row) to combine (column), (N, N) [s].
        most_visits: Number of visits after which the search is given up.
    """
    order = np.zeros(_DEEPEST, dtype=np.int64)
    outcome, first, last, visits = _search(tanks, ways, most_visits, order)
    if outcome != _FOUND:
        ended = Outcome.NONE if outcome == _FAILED else Outcome.GIVEN_UP
        return VisitSearch(ended, (), visits)
    return VisitSearch(Outcome.FOUND, tuple(order[first : last + 1].tolist()), visits)


@compiled
def _search(
    tanks: Tanks, ways: Vector, most_visits: int, order: NDArray[np.int64]
) -> tuple[int, int, int, int]:
    """The outcome; first and last place in `order` of what can be repeated; visits tried."""
    capacities, fill_rates, net_rates = tanks
    count = len(capacities)
    # For each state of the branch: tanks, time, and the next choice to try.
    loads = np.zeros((_DEEPEST, count))
    times = np.zeros(_DEEPEST)
    tried = np.zeros(_DEEPEST, dtype=np.int64)
    ranking = np.zeros((_DEEPEST, count), dtype=np.int64)
    # For each combine, the states that failed with the cart there.
    failed = np.zeros((count, _KEPT, count))
    kept = np.zeros(count, dtype=np.int64)
    visits = 0
    urgency = np.zeros(count)
    visited = np.zeros(count, dtype=np.bool_)
    for start in range(count):
        depth = 0
        order[0], tried[0] = start, 0
        loads[0, :] = 0.0
        _rank(ranking[0], urgency, loads[0], start, tanks, ways)
        while depth >= 0:
            here = order[depth]
            if tried[depth] == count:
                # The oldest are forgotten first.
                failed[here, kept[here] % _KEPT] = loads[depth]
                kept[here] += 1
                depth -= 1
                continue
            there = ranking[depth, tried[depth]]
            tried[depth] += 1
            if here == there:
                continue
            visits += 1
            if visits > most_visits or depth + 1 == _DEEPEST:
                return _GIVEN_UP, 0, 0, visits
            way = ways[here, there]
            load = loads[depth, there] + fill_rates[there] * way
            if load > capacities[there] * (1.0 + _ROUNDING):
                continue
            passed = way + load / net_rates[there]
            below = depth + 1
            for k in range(count):
                loads[below, k] = loads[depth, k] + fill_rates[k] * passed
            loads[below, there] = 0.0
            if not _all_in_time(loads[below], there, tanks, ways):
                continue
            times[below], order[below] = times[depth] + passed, there
            if _is_hopeless(loads[below], failed[there], int(min(kept[there], _KEPT))):
                continue
            idle = False
            missing = count
            visited[:] = False
            for place in range(depth, -1, -1):
                if not visited[order[place + 1]]:
                    visited[order[place + 1]] = True
                    missing -= 1
                if order[place] != there or not _is_back(loads[below], loads[place], capacities):
                    continue
                if times[below] <= times[place]:
                    # A way round that takes no time.
                    idle = True
                    break
                if missing == 0:
                    return _FOUND, place + 1, below, visits
            if idle:
                continue
            depth = below
            tried[depth] = 0
            _rank(ranking[depth], urgency, loads[depth], there, tanks, ways)
    return _FAILED, 0, 0, visits


@kernel
def _rank(
    ranking: NDArray[np.int64],
    urgency: Vector,
    loads: Vector,
    here: int,
    tanks: Tanks,
    ways: Vector,
) -> None:
    """Put the choices in order: first the combine for which the cart must set out soonest."""
    for there in range(len(loads)):
        filling = (tanks.capacities[there] - loads[there]) / tanks.fill_rates[there]
        spare = filling - ways[here, there]
        urgency[there] = spare
        place = there
        while place > 0 and urgency[ranking[place - 1]] > spare:
            ranking[place] = ranking[place - 1]
            place -= 1
        ranking[place] = there


@kernel
def _all_in_time(loads: Vector, here: int, tanks: Tanks, ways: Vector) -> bool:
    """Whether each tank can be reached in time, and any two of them, one after the other.

    Args:
        loads: Of the tanks now.
        here: Where the cart is.
        tanks: All of them.
        ways: Between them.
    """
    capacities, fill_rates, net_rates = tanks
    count = len(loads)
    for k in range(count):
        if loads[k] + fill_rates[k] * ways[here, k] > capacities[k] * (1.0 + _ROUNDING):
            return False
    for k in range(count):
        if k == here:
            continue
        for other in range(k):
            if other == here:
                continue
            possible = False
            for first, second in ((k, other), (other, k)):
                way = ways[here, first]
                load = loads[first] + fill_rates[first] * way
                way += load / net_rates[first] + ways[first, second]
                load = loads[second] + fill_rates[second] * way
                if load <= capacities[second] * (1.0 + _ROUNDING):
                    possible = True
                    break
            if not possible:
                return False
    return True


@kernel
def _is_hopeless(loads: Vector, failed: Vector, kept: int) -> bool:
    """Whether a state is no better than one at the same combine that has failed."""
    count = len(loads)
    for place in range(kept - 1, -1, -1):
        worse = True
        for k in range(count):
            if loads[k] < failed[place, k]:
                worse = False
                break
        if worse:
            return True
    return False


@kernel
def _is_back(loads: Vector, before: Vector, capacities: Vector) -> bool:
    """Whether a state is as good as an earlier one, within a tolerance."""
    back = True
    for k in range(len(loads)):
        back = back and loads[k] <= before[k] + _BACK * capacities[k]
    return back


@dataclass(frozen=True)
class BestVisits:
    """What one cart can do at best.

    Attributes:
        round: The visits.
        scale: Factor by which all its driving could be slower; less than 1: there is no schedule.
        bound: Proven upper bound of that factor for any order of visits that empty the tanks, from
            a search through all of them; infinite: not known.
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
    if len(order) == 1 or (not math.isfinite(scale) and scale > 0):
        return BestVisits(round_, scale, math.inf)
    if truck is not None:
        return BestVisits(*_best_by_truck(fleet, order, truck, (round_, scale)), math.inf)
    served = fleet.part(order)
    tanks, ways = tanks_of(served), ways_of(served, None)
    if len(order) <= _FEW:
        word = best_short_word(tanks, ways, _ALL_UP_TO[len(order)], max(scale, 0.0))
        round_, scale = _better(fleet, order, None, word, (round_, scale))
    for _ in range(_ORDERS):
        asked = max(scale, _LEAST) * (1.0 + ACCURACY)
        found, outcome = find_visits(fleet, order, asked)
        if found is None:
            bound = asked if outcome is Outcome.NONE else math.inf
            return BestVisits(round_, scale, bound)
        better = travel_scale_max(fleet, found)
        if better <= scale * (1.0 + ACCURACY / 2):
            break
        round_, scale = found, better
    return BestVisits(round_, scale, math.inf)


def _best_by_truck(
    fleet: Fleet,
    order: tuple[int, ...],
    truck: Truck,
    best: tuple[Round, float],
    asked: float = math.inf,
) -> tuple[Round, float]:
    """The best visits of one cart that drives by a truck, and the factor it could be slower by.

    Args:
        fleet: The combines.
        order: Those that are served, at least two.
        truck: Where the cart unloads.
        best: A round that is known.
        asked: A factor that is enough; visits with a lower one may be missed [-].
    """
    size = len(order)
    if size > _MOST_GROWN or best[1] >= asked:
        return best
    served, few = fleet.part(order), size <= _FEW
    tanks, ways = tanks_of(served), ways_of(served, truck)
    known = tuple(order.index(n) for n in best[0].combines)
    seeds = [(known, best[0].trips), *(rounds_of_all(size, with_truck=True) if few else ())]
    kept, changed = (_SEARCHED if math.isinf(asked) else _DECIDED) if few else _MANY
    longest = 4 * max(size, 3) if few else 2 * size
    word = grown_word(tanks, ways, longest, kept, changed, asked, seeds)
    best = _better(fleet, order, truck, word, best)
    if not few or best[1] >= asked:
        return best
    least = max(best[1], 0.0 if math.isinf(asked) else asked * (1.0 - ACCURACY / 2))
    word = best_short_word(tanks, ways, _ALL_UP_TO[size], least)
    if word.limit > -math.inf:
        best = _better(fleet, order, truck, word, best)
        word = grown_word(tanks, ways, longest, kept, changed, asked, [word.visits])
        best = _better(fleet, order, truck, word, best)
    return best


def _better(
    fleet: Fleet,
    order: tuple[int, ...],
    truck: Truck | None,
    word: RatedWord,
    best: tuple[Round, float],
) -> tuple[Round, float]:
    """The round of a word and its factor if that is larger than the best known, else the best.

    Args:
        fleet: The combines.
        order: Which of them the numbers in the word stand for.
        truck: Where the cart unloads, if anywhere.
        word: A word or none.
        best: A round and its factor.
    """
    if word.limit == -math.inf:
        return best
    places, trips = word.visits
    round_ = round_of(fleet, [order[n] for n in places], trips, truck)
    scale = travel_scale_max(fleet, round_)
    return (round_, scale) if scale > best[1] + _BETTER * abs(best[1]) else best


def find_visits(
    fleet: Fleet, order: tuple[int, ...], scale: float = 1.0
) -> tuple[Round | None, Outcome]:
    """Visits that a cart can keep up for ever with ways that are longer by a factor, if found.

    Args:
        fleet: The combines.
        order: Those that are served.
        scale: Factor on all ways.
    """
    # If the combines cut more than a cart unloads, no visits can be kept up.
    if unloading_share(fleet, order) > 1.0:
        return None, Outcome.NONE
    served = fleet.part(order)
    said = search_visits(tanks_of(served), ways_of(served, None, scale).direct, _MOST_VISITS)
    if said.outcome is not Outcome.FOUND:
        return None, said.outcome
    # Begin where the order does, so that equal questions have equal answers.
    combines = [order[place] for place in said.combines]
    first = combines.index(order[0])
    combines = combines[first:] + combines[:first]
    return round_of(fleet, combines, [False] * len(combines)), said.outcome


@lru_cache(maxsize=4096)
def visits_that_serve(
    fleet: Fleet, order: tuple[int, ...], truck: Truck | None, carts: int = 1
) -> Round | None:
    """Visits to these combines that carts can keep up, if some are found.

    Args:
        fleet: The combines.
        order: Those that are served.
        truck: Where carts unload, if anywhere.
        carts: How many serve them, one after another.
    """
    if is_excluded(fleet.part(order), carts, truck):
        return None
    if carts > 1:
        best = best_rotation(fleet, order, truck, carts)
    else:
        best = best_round(fleet, order, truck)
        if truck is not None and len(order) > 1:
            best = _best_by_truck(fleet, order, truck, best, ENOUGH)
    if best[1] >= ENOUGH:
        return best[0]
    if carts > 1 or truck is not None or len(order) == 1:
        return None
    found, _ = find_visits(fleet, order, 1.0 + ACCURACY)
    return found if found is not None and can_keep_up(fleet, found) else None


def can_keep_up(fleet: Fleet, round_: Round) -> bool:
    """Whether visits can be repeated for ever.

    Those of one cart to several combines are judged in microseconds; see `word_limit`.
    """
    served = tuple(dict.fromkeys(round_.combines))
    if round_.carts == 1 and len(served) > 1:
        part = fleet.part(served)
        word = np.array([served.index(n) for n in round_.combines])
        ways = ways_of(part, round_.truck)
        limit = word_limit(word, np.array(round_.trips), tanks_of(part), ways, 0.0)
        if not math.isnan(limit):
            return limit >= 1.0 - _ROUNDING
    return travel_scale_max(fleet, round_) >= ENOUGH


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
