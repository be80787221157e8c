"""A word of visits made better by small changes, until none helps.

Two visits change places, or the trips after them do; a visit is moved with its trip, goes to
another combine, is put in or left out; a trip is put in or left out. Each change that helps is
made at once. What is left is the best word within one change, not of all words. Where changes lead
to a word that has been left before, they end.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...compiled import compiled, kernel
from .word_limit import Desk, Tanks, Trips, Ways, Word, limit_beyond

# By which part of its limit a word must be better.
_BETTER = 1e-9

# What is done with a visit and a partner: another visit, or a combine.
_SWAP, _MOVE, _GO_TO, _LEAVE_OUT, _PUT_IN, _SWAP_TRIPS, _TURN_TRIP, _PUT_IN_WITH_TRIP = range(8)


class Ends(NamedTuple):
    """Words that no change makes better, as far as they are known.

    Attributes:
        words, trips: The words, (number, longest) each.
        sizes: Their numbers of visits, 0 where there is no word yet, (number,).
    """

    words: NDArray[np.int64]
    trips: NDArray[np.bool_]
    sizes: NDArray[np.int64]


def no_ends(number: int, longest: int) -> Ends:
    """Room for words that are not known yet.

    Args:
        number: How many.
        longest: Visits of the longest.
    """
    words = np.zeros((number, longest), dtype=np.int64)
    return Ends(words, np.zeros_like(words, dtype=np.bool_), np.zeros(number, dtype=np.int64))


@compiled
def change_word(
    word: Word,
    trips: Trips,
    size: int,
    limit: float,
    tanks: Tanks,
    ways: Ways,
    desk: Desk,
    ends: Ends,
) -> tuple[float, int]:
    """Change a word for the better as long as some change helps.

    Args:
        word, trips: The word and behind it room for longer ones, (longest,); the changed word is
            written there.
        size: Visits of the word.
        limit: Of the word [-].
        tanks: What is visited.
        ways: Between visits.
        desk: For words as long as the longest.
        ends: Words from which no change leads on; the changed word is added if there is room.

    Returns:
        The limit of the changed word, and its number of visits.
    """
    count, with_truck = len(tanks.capacities), np.isfinite(ways.room)
    other, by_truck = np.zeros_like(word), np.zeros_like(trips)
    kinds = 8 if with_truck else 5
    helps = True
    while helps:
        for known in range(len(ends.sizes)):
            if ends.sizes[known] == size and _is_rotated(
                word, trips, ends.words[known], ends.trips[known], size
            ):
                return limit, size
        helps = False
        for kind in range(kinds):
            visit = 0
            # A word may become longer or shorter meanwhile.
            while visit < size:
                partner = 0
                while partner < max(size, count):
                    now = _change(word, trips, size, (kind, visit, partner), count, other, by_truck)
                    partner += 1
                    if now == 0 or not _serves_all(other[:now], count):
                        continue
                    if with_truck and not by_truck[:now].any():
                        continue
                    asked = limit * (1.0 + _BETTER)
                    found = limit_beyond(other[:now], by_truck[:now], tanks, ways, asked, desk)
                    if found > asked and found < np.inf:
                        limit, size, helps = found, now, True
                        word[:now], trips[:now] = other[:now], by_truck[:now]
                visit += 1
    for known in range(len(ends.sizes)):
        if ends.sizes[known] == 0:
            ends.words[known], ends.trips[known], ends.sizes[known] = word, trips, size
            break
    return limit, size


@kernel
def _change(
    word: Word,
    trips: Trips,
    size: int,
    what: tuple[int, int, int],
    count: int,
    other: Word,
    by_truck: Trips,
) -> int:
    """Write a changed word; return its number of visits, or 0 if there is no such change.

    Args:
        word, trips: The word, (longest,).
        size: Its number of visits.
        what: The kind of change, the visit, and its partner: another visit, or a combine.
        count: Of combines.
        other, by_truck: Where the changed word is written, (longest,).
    """
    kind, visit, partner = what
    if visit >= size:
        return 0
    for k in range(size):
        other[k], by_truck[k] = word[k], trips[k]
    if kind in (_SWAP, _SWAP_TRIPS):
        if partner <= visit or partner >= size:
            return 0
        if kind == _SWAP:
            other[visit], other[partner] = word[partner], word[visit]
            return size if word[visit] != word[partner] else 0
        by_truck[visit], by_truck[partner] = trips[partner], trips[visit]
        return size if trips[visit] != trips[partner] else 0
    if kind == _MOVE:
        if partner >= size or partner == visit:
            return 0
        step = 1 if partner > visit else -1
        for k in range(visit, partner, step):
            other[k], by_truck[k] = word[k + step], trips[k + step]
        other[partner], by_truck[partner] = word[visit], trips[visit]
        return size
    if kind == _GO_TO:
        if partner >= count or partner == word[visit]:
            return 0
        other[visit] = partner
        return size
    if kind in (_PUT_IN, _PUT_IN_WITH_TRIP):
        if partner >= count or size == len(word):
            return 0
        for k in range(visit + 1, size):
            other[k + 1], by_truck[k + 1] = word[k], trips[k]
        other[visit + 1], by_truck[visit + 1] = partner, kind == _PUT_IN_WITH_TRIP
        return size + 1
    if partner > 0:
        return 0
    if kind == _TURN_TRIP:
        by_truck[visit] = not trips[visit]
        return size
    for k in range(visit + 1, size):
        other[k - 1], by_truck[k - 1] = word[k], trips[k]
    return size - 1


@kernel
def _serves_all(word: Word, count: int) -> bool:
    """Whether a word has a visit to each combine."""
    for n in range(count):
        served = False
        for visit in range(len(word)):
            served |= word[visit] == n
        if not served:
            return False
    return True


@kernel
def _is_rotated(word: Word, trips: Trips, other: Word, by_truck: Trips, size: int) -> bool:
    """Whether two words of as many visits are one, begun at any of its visits."""
    for turn in range(size):
        same = True
        for visit in range(size):
            there = (visit + turn) % size
            same = word[visit] == other[there] and trips[visit] == by_truck[there]
            if not same:
                break
        if same:
            return True
    return False
