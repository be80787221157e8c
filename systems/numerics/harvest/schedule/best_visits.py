"""The visits that leave one cart most time to drive, in whatever order.

One visit to each combine a round is enough where they are alike. Where one fills faster than the
others the cart comes to it more often, and where its own room is small it drives by the truck in
between. For a few combines all words of up to twice as many visits are looked at; for these and
others `search_visits` proposes orders until it ends without another one that would let the cart
drive slower. `travel_scale_max` judges them all.
"""

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import product

import numpy as np

from .bisection import last_factor
from .certain_limit import is_excluded
from .fleet import Fleet, Truck
from .limits import best_rotation, best_round, unloading_share
from .periodic_plan import plan_round, travel_scale_max
from .rounds import Round, round_of
from .short_words import limits_of, words_of
from .visit_search import Outcome, search_visits
from .ways import tanks_of, ways_of

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
        return plan_round(slower, again) is not None

    if not works(0.0):
        return -math.inf
    if not any(way for row in fleet.travel_times for way in row):
        return math.inf
    return last_factor(works, 0.0, 1.0, 1e-9, 1e9)[0]
