"""The word of visits with which one cart could drive slowest.

**Short words**, of twice as many visits as combines, say, are all looked at. They are built visit
by visit, until some tank would run over during the ways alone, with the factor on ways of the best
word that is known; each word that is left is judged by its linear programme. The result is exact,
so that more of anything never makes it worse.

**Longer words** grow: one more visit is put anywhere into each of the best words of a length, with
each choice of trips that can go with it, and the best words that result are kept. A word repeated
twice may grow as well. The best words of each length are improved by small changes
(`changed_word`). There may be better words that are not found.
"""

import math
from itertools import permutations, product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...compiled import compiled, kernel
from .changed_word import change_word, no_ends
from .word_limit import (
    Desk,
    Tanks,
    Trips,
    Vector,
    Ways,
    Word,
    desk_for,
    limit_beyond,
    time_to_drive,
    word_limit,
)

# The combine of each visit, and whether the cart drives by the truck after it.
Visits = tuple[tuple[int, ...], tuple[bool, ...]]

# Part of the best limit that a word must reach to grow on.
_NEAR = 0.7
# By which part of its limit a word must be better than another.
_BETTER = 1e-9


class RatedWord(NamedTuple):
    """A word, or none.

    Attributes:
        limit: The largest factor on all ways with which it has a plan; minus infinity: no word.
        visits: The combine of each visit, and after which the cart drives by the truck, (V,) each.
    """

    limit: float
    visits: Visits


def best_short_word(tanks: Tanks, ways: Ways, longest: int, least: float) -> RatedWord:
    """The best word of at most so many visits, if its limit is more than `least`.

    Args:
        tanks: What is visited.
        ways: Between visits.
        longest: Visits of the longest words, no fewer than there are combines.
        least: Limit that the word must exceed, at least 0 [-].
    """
    word, trips = np.zeros(longest, dtype=np.int64), np.zeros(longest, dtype=np.bool_)
    limit, size = _look_at_all(tanks, ways, least, word, trips)
    return RatedWord(limit, (tuple(word[:size].tolist()), tuple(trips[:size].tolist())))


def grown_word(
    tanks: Tanks,
    ways: Ways,
    longest: int,
    kept: int,
    changed: int,
    enough: float,
    seeds: list[Visits],
) -> RatedWord:
    """The best word that grows from some seeds, if any does.

    Args:
        tanks: What is visited.
        ways: Between visits.
        longest: Visits of the longest words.
        kept: How many words of each length grow on.
        changed: How many of these are made better by small changes, at most `kept`.
        enough: A limit with which the search ends [-].
        seeds: Words to begin with.
    """
    garden = _Garden(longest, kept)
    for combines, by_truck in seeds:
        if len(combines) <= longest:
            word, trips = np.array(combines, dtype=np.int64), np.array(by_truck, dtype=np.bool_)
            limit = word_limit(word, trips, tanks, ways, 0.0)
            if limit > 0.0:
                _keep(word, trips, limit, *garden.of(len(word)))
    _grow(tanks, ways, enough, garden.words, garden.trips, garden.limits)
    desk = desk_for(len(tanks.capacities), longest)
    ends = no_ends(changed * longest, longest)
    best = RatedWord(-math.inf, ((), ()))
    for length, limits in enumerate(garden.limits):
        for rank in range(changed):
            if limits[rank] == -math.inf or best.limit >= enough:
                break
            word, trips = garden.words[length, rank], garden.trips[length, rank]
            limit, size = change_word(word, trips, length, limits[rank], tanks, ways, desk, ends)
            if limit > best.limit * (1.0 + _BETTER):
                best = RatedWord(limit, (tuple(word[:size].tolist()), tuple(trips[:size].tolist())))
    return best


def rounds_of_all(combines: int, with_truck: bool) -> list[Visits]:
    """One visit to each of some combines in every order, with trips after any of them.

    Args:
        combines: How many.
        with_truck: Whether there is a truck; if so, there is at least one trip.
    """
    choices = [(False,) * combines]
    if with_truck:
        choices = [trips for trips in product((False, True), repeat=combines) if any(trips)]
    orders = [(0, *others) for others in permutations(range(1, combines))]
    return list(product(orders, choices))


class _Garden:
    """The best words of each length, as far as they are known.

    Attributes:
        words: (longest + 1, kept, longest); for each length the best one first.
        trips: After which visits the cart drives by the truck, likewise.
        limits: (longest + 1, kept); minus infinity where there is no word.
    """

    def __init__(self, longest: int, kept: int) -> None:
        shape = (longest + 1, kept, longest)
        self.words = np.zeros(shape, dtype=np.int64)
        self.trips = np.zeros(shape, dtype=np.bool_)
        self.limits = np.full(shape[:2], -np.inf)

    def of(self, size: int) -> tuple[NDArray[np.int64], NDArray[np.bool_], Vector]:
        return self.words[size], self.trips[size], self.limits[size]


@compiled
def _look_at_all(
    tanks: Tanks, ways: Ways, least: float, best_word: Word, best_trips: Trips
) -> tuple[float, int]:
    """The limit of the best word, minus infinity if none is beyond `least`, and its length.

    Of a branch we know the time since the cart left each combine or, if it has not come there yet,
    since the word began; and the time that it has driven, which says how many visits and trips
    there must be at least. Of words that are rotations of one another only the first in lexical
    order is looked at, and none that repeats a shorter one (Lyndon words, by the period of what is
    written so far, Fredricksen and Maiorana 1978).
    """
    count, longest = len(tanks.capacities), len(best_word)
    with_truck = np.isfinite(ways.room)
    choices = 2 * count if with_truck else count
    free = time_to_drive(tanks, ways.unloading if with_truck else 0.0)
    if free[1] <= 0.0:
        return -np.inf, 0
    desk = desk_for(count, longest)
    word, trips = np.zeros(longest, dtype=np.int64), np.zeros(longest, dtype=np.bool_)
    tried, missing = np.zeros(longest, dtype=np.int64), np.zeros(longest, dtype=np.int64)
    passed = np.zeros((longest, count))
    visits, driven = np.zeros((longest, count), dtype=np.int64), np.zeros(longest)
    visits[0, 0] = 1
    # The period of the word before each visit.
    periods = np.zeros(longest + 1, dtype=np.int64)
    missing[0], periods[0] = count - 1, 1
    limit, size, depth = -np.inf, 0, 0
    while depth >= 0:
        if tried[depth] == 0 and missing[depth] == 0:
            for closing in range(2 if with_truck else 1):
                trips[depth] = closing == 1
                here, by_truck = word[: depth + 1], trips[: depth + 1]
                if _period(word, trips, depth, periods[depth]) != depth + 1:
                    continue
                if with_truck and not by_truck.any():
                    continue
                found = limit_beyond(here, by_truck, tanks, ways, least * (1.0 + _BETTER), desk)
                if found > least and found < np.inf:
                    least, limit, size = found, found, depth + 1
                    best_word[:size], best_trips[:size] = here, by_truck
        if depth + 1 == longest or tried[depth] == choices:
            depth -= 1
            continue
        choice = tried[depth]
        tried[depth] += 1
        there, trips[depth] = choice % count, choice >= count
        if there == word[depth] and not trips[depth]:
            continue
        period = _period(word, trips, depth, periods[depth])
        if period == 0:
            continue
        way = least * ways.direct[word[depth], there]
        if trips[depth]:
            way = least * ways.by_truck[word[depth], there] + ways.stop
        in_time = True
        for n in range(count):
            passed[depth + 1, n] = passed[depth, n] + way
            visits[depth + 1, n] = visits[depth, n] + (1 if n == there else 0)
            in_time &= passed[depth + 1, n] * tanks.fill_rates[n] <= tanks.capacities[n]
        left = missing[depth] - (1 if visits[depth, there] == 0 else 0)
        rest = longest - depth - 2
        if not in_time or left > rest:
            continue
        driven[depth + 1] = driven[depth] + way
        ready = visits[depth + 1], trips[: depth + 1].sum()
        if not _can_be_enough(*ready, driven[depth + 1], rest, tanks, ways.room, free):
            continue
        depth += 1
        word[depth], passed[depth, there] = there, 0.0
        missing[depth], tried[depth], periods[depth] = left, 0, period
    return limit, size


@kernel
def _can_be_enough(
    visits: NDArray[np.int64],
    stops: int,
    driven: float,
    rest: int,
    tanks: Tanks,
    room: float,
    free: tuple[float, float],
) -> bool:
    """Whether so many more visits, and trips after them, can be enough for all tanks and the cart.

    The time driven bounds the period from below, as unloading takes the rest of it. A tank fills
    while the cart is away from it, during all ways and all stays with others, and needs a visit for
    each time that it is full; all grain goes to the truck, at most one full cart a trip.

    Args:
        visits: To each combine so far, (N,).
        stops: Trips so far.
        driven: Time driven by then, at least [s].
        rest: How many more visits there may be; a trip may follow the last of these too.
        tanks: Of the combines.
        room: Of the cart [kg].
        free: From `time_to_drive`; the second is positive.
    """
    filled, spare = free
    period = driven / spare
    if filled * period > (stops + rest + 1) * room * (1.0 + _BETTER):
        return False
    lacking = 0
    for n in range(len(visits)):
        share = tanks.fill_rates[n] / (tanks.net_rates[n] + tanks.fill_rates[n])
        away = driven + period * (1.0 - spare - share)
        tanks_full = away * tanks.fill_rates[n] / tanks.capacities[n]
        lacking += max(0, math.ceil(tanks_full * (1.0 - _BETTER)) - visits[n])
    return lacking <= rest


@kernel
def _period(word: Word, trips: Trips, last: int, period: int) -> int:
    """Period of a word up to its last visit; 0 if it cannot begin the first of its rotations.

    Args:
        word, trips: The word, (V,).
        last: Number of its last visit.
        period: Of the word before that visit.
    """
    if last == 0:
        return 1
    back = last - period
    difference = 2 * (word[last] - word[back]) + int(trips[last]) - int(trips[back])
    if difference < 0:
        return 0
    return period if difference == 0 else last + 1


@kernel
def _first_rotation(word: Word, trips: Trips) -> int:
    """Number of the visit at which the first of a word's rotations begins, in lexical order."""
    size, first = len(word), 0
    for turn in range(1, size):
        for visit in range(size):
            here, there = (first + visit) % size, (turn + visit) % size
            difference = 2 * (word[there] - word[here]) + int(trips[there]) - int(trips[here])
            if difference < 0:
                first = turn
            if difference != 0:
                break
    return first


@kernel
def _keep(
    word: Word,
    trips: Trips,
    limit: float,
    words: NDArray[np.int64],
    by_truck: NDArray[np.bool_],
    limits: Vector,
) -> None:
    """Put the first rotation of a word among the best of its length, if it is one of them.

    Args:
        word, trips: The word, (V,).
        limit: Its limit [-].
        words, by_truck, limits: The best words, the very best first.
    """
    size, kept = len(word), len(limits)
    if limit <= limits[kept - 1]:
        return
    first = _first_rotation(word, trips)
    place = 0
    for rank in range(kept):
        if limits[rank] == -np.inf:
            break
        same = True
        for visit in range(size):
            here = (first + visit) % size
            same = words[rank, visit] == word[here] and by_truck[rank, visit] == trips[here]
            if not same:
                break
        if same:
            return
        if limits[rank] >= limit:
            place = rank + 1
    for rank in range(kept - 1, place, -1):
        limits[rank] = limits[rank - 1]
        for visit in range(size):
            words[rank, visit] = words[rank - 1, visit]
            by_truck[rank, visit] = by_truck[rank - 1, visit]
    limits[place] = limit
    for visit in range(size):
        here = (first + visit) % size
        words[place, visit], by_truck[place, visit] = word[here], trips[here]


@compiled
def _grow(
    tanks: Tanks,
    ways: Ways,
    enough: float,
    words: NDArray[np.int64],
    trips: NDArray[np.bool_],
    limits: Vector,
) -> None:
    """Let all words grow, from the shortest on."""
    longest, count = len(limits) - 1, len(tanks.capacities)
    desk = desk_for(count, longest)
    longer, by_truck = np.zeros(longest, dtype=np.int64), np.zeros(longest, dtype=np.bool_)
    best = 0.0
    for length in range(1, longest + 1):
        best = max(best, limits[length, 0])
        if best >= enough or length == longest:
            break
        for rank in range(limits.shape[1]):
            if limits[length, rank] == -np.inf or limits[length, rank] < _NEAR * best:
                break
            _grow_one(
                words[length, rank, :length],
                trips[length, rank, :length],
                (tanks, ways),
                _NEAR * best,
                (words[length + 1], trips[length + 1], limits[length + 1]),
                (longer[: length + 1], by_truck[: length + 1]),
                desk,
            )
        twice = 2 * length
        if limits[length, 0] > -np.inf and twice <= longest:
            for visit in range(twice):
                longer[visit] = words[length, 0, visit % length]
                by_truck[visit] = trips[length, 0, visit % length]
            best_ones = words[twice], trips[twice], limits[twice]
            _keep(longer[:twice], by_truck[:twice], limits[length, 0], *best_ones)


@kernel
def _grow_one(
    word: Word,
    trips: Trips,
    cart: tuple[Tanks, Ways],
    least: float,
    kept: tuple[NDArray[np.int64], NDArray[np.bool_], Vector],
    longer: tuple[Word, Trips],
    desk: Desk,
) -> None:
    """Put one more visit anywhere into a word, and keep the best words that result.

    Args:
        word, trips: The word, (V,).
        cart: What it visits, and its ways.
        least: Limit that a word must exceed [-].
        kept: The best words with one visit more.
        longer: Where longer words are written, (V + 1,).
        desk: Where their limits are worked out.
    """
    tanks, ways = cart
    words, by_truck, limits = kept
    visits, choice = longer
    with_truck = np.isfinite(ways.room)
    for place in range(len(word)):
        for visit in range(len(word)):
            after = visit if visit <= place else visit + 1
            visits[after], choice[after] = word[visit], trips[visit]
        for there in range(len(tanks.capacities)):
            visits[place + 1] = there
            # The trip after the visit before stays, or comes after the new one, or after both.
            for pattern in range(3 if with_truck else 1):
                choice[place] = trips[place] if pattern < 2 else not trips[place]
                choice[place + 1] = (pattern == 1) if pattern < 2 else trips[place]
                if with_truck and not choice.any():
                    continue
                asked = max(least, limits[-1])
                found = limit_beyond(visits, choice, tanks, ways, max(asked, 0.0), desk)
                if found > asked and found < np.inf:
                    _keep(visits, choice, found, words, by_truck, limits)
