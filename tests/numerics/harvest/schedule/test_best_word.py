"""Short words: the best of all, by brute force; longer ones: no worse than what they grow from."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from sightfield.systems.numerics.harvest.schedule.best_visits import best_visits
from sightfield.systems.numerics.harvest.schedule.best_word import (
    best_short_word,
    grown_word,
    rounds_of_all,
)
from sightfield.systems.numerics.harvest.schedule.fleet import Fleet, Truck, round_of
from sightfield.systems.numerics.harvest.schedule.periodic_plan import travel_scale_max
from sightfield.systems.numerics.harvest.schedule.word_limit import tanks_of, ways_of, word_limit

# Four unlike combines and a truck, where a cart larger by a tenth once had the worse visits, with
# 0.560 for 0.600.
UNLIKE = Fleet(
    capacities=(10_544.0, 4_583.6, 10_951.0, 4_129.6),
    fill_rates=(19.885, 19.671, 5.8175, 15.921),
    unload_rates=(108.35, 101.6, 120.14, 124.68),
    travel_times=(
        (0.0, 30.094, 42.266, 3.7413),
        (30.094, 0.0, 43.471, 26.915),
        (42.266, 43.471, 0.0, 43.167),
        (3.7413, 26.915, 43.167, 0.0),
    ),
)
CARRYING = Truck(22_963.0, 36.375, 381.29, 12.926)


def some(combines, seed):
    """The first combines of UNLIKE, with other rates, and a truck."""
    random = np.random.default_rng(seed)
    fleet = UNLIKE.part(range(combines))
    fills = tuple(rate * random.uniform(0.5, 2.0) for rate in fleet.fill_rates)
    room = random.uniform(0.8, 3.0) * max(fleet.capacities)
    return replace(fleet, fill_rates=fills), replace(CARRYING, cart_capacity=room)


def all_words(combines, most, by_truck):
    """Every word, rotations too, in which no visit is told as two."""
    for size in range(combines, most + 1):
        for word in itertools.product(range(combines), repeat=size):
            if len(set(word)) < combines:
                continue
            for trips in itertools.product((False, True) if by_truck else (False,), repeat=size):
                twice = any(
                    word[n - 1] == word[n] and not trips[n - 1] for n in range(size) if size > 1
                )
                if not twice and any(trips) == by_truck:
                    yield word, trips


@pytest.mark.parametrize("by_truck", [False, True])
@pytest.mark.parametrize("seed", range(4))
def test_no_word_of_two_combines_is_better(seed, by_truck):
    fleet, truck = some(2, seed)
    truck = truck if by_truck else None
    tanks, ways = tanks_of(fleet), ways_of(fleet, truck)
    limit, (word, trips) = best_short_word(tanks, ways, 4, 0.0)
    scales = [
        travel_scale_max(fleet, round_of(fleet, *each, truck)) for each in all_words(2, 4, by_truck)
    ]
    assert limit == pytest.approx(max(scales), rel=1e-5)
    assert travel_scale_max(fleet, round_of(fleet, word, trips, truck)) == pytest.approx(limit)


@pytest.mark.parametrize("seed", range(4))
def test_no_word_of_three_combines_is_better(seed):
    fleet, truck = some(3, seed)
    tanks, ways = tanks_of(fleet), ways_of(fleet, truck)
    limit, (word, trips) = best_short_word(tanks, ways, 5, 0.0)
    best = max(
        word_limit(np.array(each), np.array(choice), tanks, ways, 0.0)
        for each, choice in all_words(3, 5, by_truck=True)
    )
    assert limit == pytest.approx(best, rel=1e-7)
    assert word_limit(np.array(word), np.array(trips), tanks, ways, 0.0) == pytest.approx(limit)


def test_what_is_asked_is_exceeded_or_nothing_is_said():
    tanks, ways = tanks_of(UNLIKE), ways_of(UNLIKE, CARRYING)
    limit, (word, trips) = best_short_word(tanks, ways, 8, 0.0)
    assert best_short_word(tanks, ways, 8, 0.999 * limit)[0] == pytest.approx(limit)
    assert best_short_word(tanks, ways, 8, 1.001 * limit) == (-math.inf, ((), ()))
    assert set(word) == set(range(4))
    assert len(word) == len(trips) <= 8


def test_words_grow_from_rounds_and_are_no_worse():
    tanks, ways = tanks_of(UNLIKE), ways_of(UNLIKE, CARRYING)
    rounds = rounds_of_all(4, with_truck=True)
    assert len(rounds) == 6 * 15
    of_rounds = max(
        word_limit(np.array(word), np.array(trips), tanks, ways, 0.0) for word, trips in rounds
    )
    limit, (word, trips) = grown_word(tanks, ways, 16, 6, 6, math.inf, rounds)
    assert limit > 1.02 * of_rounds
    assert word_limit(np.array(word), np.array(trips), tanks, ways, 0.0) == pytest.approx(limit)
    # A limit that is enough ends the search.
    assert of_rounds <= grown_word(tanks, ways, 16, 6, 6, of_rounds, rounds)[0] < limit
    assert grown_word(tanks, ways, 16, 6, 6, math.inf, []) == (-math.inf, ((), ()))


@pytest.mark.parametrize("seed", range(12))
def test_a_larger_cart_is_never_worse(seed):
    fleet, truck = (UNLIKE, CARRYING) if seed == 0 else some(4, seed)
    scales = [
        best_visits(fleet, (0, 1, 2, 3), replace(truck, cart_capacity=part * truck.cart_capacity))
        for part in (1.0, 1.05, 1.1, 1.3)
    ]
    for less, more in itertools.pairwise(each.scale for each in scales):
        assert more >= less - 2e-3 * abs(less)
