"""Any order of visits that one cart can keep up for ever: an exhaustive search.

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

from enum import Enum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...compiled import compiled, kernel
from .ways import Tanks, Ways

Vector = NDArray[np.float64]

# Visits in a row that a branch may have, and states kept for each combine of those that failed.
_DEEPEST, _KEPT = 400, 10_000
# Part of an amount that rounding may cost.
_ROUNDING = 1e-12
# Part of a tank by which a state that comes back may differ: from empty tanks loads only rise
# towards those of the round that they end in.
_BACK = 1e-4
_FAILED, _FOUND, _GIVEN_UP = 0, 1, 2


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
