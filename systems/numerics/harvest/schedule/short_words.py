"""Every short word of visits, and how much slower a cart could drive that follows it.

A word is what a cart repeats: which combine each visit is to, and after which it drives by the
truck. With a cart that never waits and empties each tank the loads x of a word solve

    x_i = r_f (ways and stays since the cart last left that combine),  stay_j = x_j / (r_u - r_f),

which is linear in x and in a factor on all ways: x = x_0 + factor x_1, x_0 from the time at the
truck. The factor at which the first tank, or the cart, is full follows without any search.
"""

from functools import lru_cache
from itertools import pairwise, product

import numpy as np
from numpy.typing import NDArray

from ...compiled import compiled, kernel
from .fleet import Fleet
from .rounds import Round
from .ways import Tanks, Ways, tanks_of, ways_of

Vector = NDArray[np.float64]
Words = NDArray[np.int64]


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
