"""Compiled parts of the searches through words and visits, as recorded on random ones."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.harvest.schedule.best_visits import (
    _all_in_time,
    _is_back,
    _is_hopeless,
    _rank,
    search_visits,
)
from sightfield.systems.numerics.harvest.schedule.best_word import (
    _can_be_enough,
    _first_rotation,
    _keep,
    _period,
    best_short_word,
    grown_word,
    rounds_of_all,
)
from sightfield.systems.numerics.harvest.schedule.changed_word import (
    _change,
    _is_rotated,
    _serves_all,
)
from sightfield.systems.numerics.harvest.schedule.fleet import Fleet, Truck
from sightfield.systems.numerics.harvest.schedule.word_limit import (
    _bound,
    _lower,
    _most_brought,
    _write,
    desk_for,
    tanks_of,
    time_to_drive,
    ways_of,
    word_limit,
)


def case(seed, combines=None):
    """Unlike combines at random, a truck or none, and a word of visits with trips."""
    rng = np.random.default_rng([71, seed])
    count = int(rng.integers(2, 5)) if combines is None else combines
    unload = rng.uniform(80.0, 200.0, count)
    shares = rng.uniform(0.05, 1.0, count)
    shares *= rng.uniform(0.2, 0.8) / shares.sum()
    ways = rng.uniform(5.0, 60.0, (count, count))
    np.fill_diagonal(ways, 0.0)
    fleet = Fleet(
        tuple(rng.uniform(3_000.0, 12_000.0, count).tolist()),
        tuple((shares * unload).tolist()),
        tuple(unload.tolist()),
        tuple(map(tuple, ways.tolist())),
    )
    truck = None
    if seed % 3:
        truck = Truck(rng.uniform(6e3, 4e4), rng.uniform(1, 40), rng.uniform(150, 600), 12.5)
    word = [*range(count), *rng.integers(0, count, rng.integers(1, 6)).tolist()]
    rng.shuffle(word)
    trips = [truck is not None and bool(rng.random() < 0.4) for _ in word]
    return (
        np.array(word), np.array(trips), tanks_of(fleet), ways_of(fleet, truck, 1.0 + 0.1 * seed)
    )  # fmt: skip


@pytest.mark.parametrize("seed", range(9))
def test_bounds_and_conditions_of_a_word_are_as_recorded(seed, as_recorded):
    word, trips, tanks, ways = case(seed)
    desk = desk_for(len(tanks.capacities), len(word))
    bound = _bound(word, trips, tanks, ways, desk)
    said = [time_to_drive(tanks, ways.unloading), _most_brought(word, trips, tanks, ways.room)]
    as_recorded([bound, *said, word_limit(word, trips, tanks, ways, 0.0)])
    if math.isfinite(bound):
        rows = _write(word, trips, tanks, ways, bound, desk)
        columns = 1 + 2 * len(word) + len(tanks.capacities)
        table = desk.table[:rows, :columns]
        as_recorded([rows, np.array(table), np.array(desk.right[:rows])], "conditions")
        as_recorded(_lower(bound, 0.0, rows, columns, desk), "limit")


@pytest.mark.parametrize("seed", range(4))
def test_words_told_apart_are_as_recorded(seed, as_recorded):
    word, trips, tanks, ways = case(seed)
    size, rng = len(word), np.random.default_rng(seed)
    periods = [
        [_period(word, trips, last, period) for period in range(1, last + 1)]
        for last in range(1, size)
    ]
    as_recorded([_period(word, trips, 0, 0), periods, _first_rotation(word, trips)], "periods")
    for tried in range(6):
        other = np.roll(word, tried), np.roll(trips, tried)
        assert _is_rotated(word, trips, *other, size)
        assert (
            _first_rotation(*other) == (_first_rotation(word, trips) + tried) % size
            or (
                np.roll(word, -_first_rotation(word, trips))
                == np.roll(other[0], -_first_rotation(*other))
            ).all()
        )
        changed = other[0].copy(), other[1].copy()
        changed[tried % 2][tried % size] ^= True
        as_recorded(_is_rotated(word, trips, *changed, size), f"rotated {tried}")
    enough = []
    for _ in range(120):
        visits = rng.integers(0, 4, len(tanks.capacities))
        told = visits, int(rng.integers(0, 3)), rng.uniform(0.0, 900.0), int(rng.integers(0, 6))
        free = time_to_drive(tanks, ways.unloading)
        enough.append(_can_be_enough(*told, tanks, ways.room, free))
    as_recorded(np.array(enough, dtype=float), "enough")


def test_the_best_words_of_a_length_are_kept_as_recorded(as_recorded):
    rng = np.random.default_rng(3)
    words, trips = np.zeros((4, 5), dtype=np.int64), np.zeros((4, 5), dtype=np.bool_)
    limits = np.full(4, -np.inf)
    for number in range(14):
        word, by_truck = rng.integers(0, 3, 5), rng.random(5) < 0.4
        limit = float(rng.choice([0.5, 0.7, 0.9, rng.random()]))
        _keep(word, by_truck, limit, words, trips, limits)
        # Begun elsewhere it is the same word.
        _keep(np.roll(word, 2), np.roll(by_truck, 2), limit, words, trips, limits)
        as_recorded([words.copy(), trips.astype(float), limits.copy()], f"{number}")


def test_all_changes_of_a_word_are_as_recorded(as_recorded):
    for seed in range(3):
        word, trips, tanks, _ = case(seed)
        size, count = len(word), len(tanks.capacities)
        for room in (size, size + 1):
            long = np.zeros(room, dtype=np.int64), np.zeros(room, dtype=np.bool_)
            long[0][:size], long[1][:size] = word, trips
            told = []
            for kind in range(8):
                for visit in range(size + 1):
                    for partner in range(max(size, count) + 1):
                        other = np.zeros(room, dtype=np.int64), np.zeros(room, dtype=np.bool_)
                        now = _change(*long, size, (kind, visit, partner), count, *other)
                        told += [now, *(other[0] * 2 + other[1])[: max(now, 0)]]
                        if now:
                            served = set(other[0][:now].tolist()) == set(range(count))
                            assert _serves_all(other[0][:now], count) == served
            as_recorded(np.array(told, dtype=float), f"{seed} {room - size}")


@pytest.mark.parametrize("seed", [0, 3, 6])
def test_a_search_through_all_visits_is_as_recorded(seed, as_recorded):
    _, _, tanks, ways = case(seed, 3)
    found = [search_visits(tanks, scale * ways.direct, 4000) for scale in (0.7, 2.0, 3.5, 5.0, 9.0)]
    as_recorded([[each.outcome, each.visits, np.array(each.combines)] for each in found])


def test_states_of_tanks_are_ranked_as_recorded(as_recorded):
    rng = np.random.default_rng(12)
    for seed in (1, 2, 3):
        _, _, tanks, ways = case(seed, 4)
        ranked, judged = [], []
        failed = rng.uniform(0.0, 1.0, (6, 4)) * tanks.capacities
        for _ in range(40):
            loads = rng.uniform(0.0, 1.0, 4) * tanks.capacities
            here = int(rng.integers(0, 4))
            ranking, urgency = np.zeros(4, dtype=np.int64), np.zeros(4)
            _rank(ranking, urgency, loads, here, tanks, ways.direct)
            assert (np.diff(urgency[ranking]) >= 0).all()
            ranked.append([*ranking, *urgency])
            worse = (loads >= failed[:4]).all(axis=1).any()
            assert _is_hopeless(loads, failed, 4) == worse
            part = rng.uniform(0.0, 0.8, 4) * tanks.capacities
            judged.append(_all_in_time(part, here, tanks, 3 * ways.direct))
        as_recorded([np.array(ranked), np.array(judged, dtype=float)], f"{seed}")
    before, capacities = np.array([50.0, 0.0, 20.0]), np.array([100.0, 200.0, 400.0])
    assert _is_back(before + 0.99e-4 * capacities, before, capacities)
    for tank in range(3):
        more = before + 1.01e-4 * capacities * (np.arange(3) == tank)
        assert not _is_back(more, before, capacities)
    # A state as bad as one that failed is hopeless, one with any tank better is not.
    assert _is_hopeless(before, before[None].copy(), 1)
    assert not _is_hopeless(before, before[None].copy(), 0)
    for tank in range(3):
        better = before - 1e-9 * (np.arange(3) == tank)
        assert not _is_hopeless(better, before[None].copy(), 1)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_short_words_and_what_grows_of_rounds_are_as_recorded(seed, as_recorded):
    _, _, tanks, ways = case(seed, 3)
    truck = bool(np.isfinite(ways.room))
    as_recorded([best_short_word(tanks, ways, longest, 0.0) for longest in (3, 4, 6)], "short")
    seeds = rounds_of_all(3, with_truck=truck)
    grown = [
        grown_word(tanks, ways, 7, 5, 2, np.inf, seeds),
        grown_word(tanks, ways, 9, 3, 0, np.inf, seeds[:2]),
        grown_word(tanks, ways, 5, 2, 2, 0.3, seeds[-1:]),
    ]
    as_recorded(grown, "grown")
