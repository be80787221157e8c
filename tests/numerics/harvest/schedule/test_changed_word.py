"""Words of visits after small changes, against all changes written out anew."""

from dataclasses import replace

import numpy as np
import pytest

from sightfield.systems.numerics.harvest.schedule.answer import answer_schedule
from sightfield.systems.numerics.harvest.schedule.changed_word import change_word, no_ends
from sightfield.systems.numerics.harvest.schedule.fleet import Fleet, Truck
from sightfield.systems.numerics.harvest.schedule.word_limit import (
    desk_for,
    tanks_of,
    ways_of,
    word_limit,
)

FLEET = Fleet(
    (9281.0, 5298.0, 3834.0, 6610.0),
    (10.7, 17.4, 20.3, 5.4),
    (120.0, 107.0, 121.0, 168.0),
    ((0, 26.3, 1.1, 33.0), (26.3, 0, 25.8, 53.4), (1.1, 25.8, 0, 34.1), (33.0, 53.4, 34.1, 0)),
)
TRUCK = Truck(24975.0, 10.16, 244.8, 28.7)
LONGEST = 12


def neighbours(
    visits: list[tuple[int, bool]], with_truck: bool
) -> set[tuple[tuple[int, bool], ...]]:
    """All words within one change; a visit is its combine and whether a trip comes after it."""
    found = set()

    def add(word):
        trips = any(trip for _, trip in word)
        if len(word) <= LONGEST and {n for n, _ in word} == set(range(4)) and trips == with_truck:
            found.add(tuple(word))

    trips = (False, True) if with_truck else (False,)
    for i, (n, trip) in enumerate(visits):
        rest = visits[:i] + visits[i + 1 :]
        add(rest)
        for j in range(len(visits)):
            add([*rest[:j], (n, trip), *rest[j:]])
            (m, other) = visits[j]
            swapped, trips_swapped = list(visits), list(visits)
            swapped[i], swapped[j] = (m, trip), (n, other)
            trips_swapped[i], trips_swapped[j] = (n, other), (m, trip)
            add(swapped)
            add(trips_swapped)
        for m in range(4):
            add([*visits[:i], (m, trip), *visits[i + 1 :]])
            for each in trips:
                add([*visits[: i + 1], (m, each), *visits[i + 1 :]])
        for each in trips:
            add([*visits[:i], (n, each), *visits[i + 1 :]])
    return found


def limit_of(word, tanks, ways):
    visits, trips = (np.array(each) for each in zip(*word, strict=True))
    return word_limit(visits, trips, tanks, ways, 0.0)


@pytest.mark.parametrize("with_truck", [True, False])
@pytest.mark.parametrize("begin", [[0, 1, 2, 3], [2, 0, 3, 2, 1], [3, 2, 2, 1, 0, 2]])
def test_what_comes_of_a_word_is_better_and_no_change_helps_it(begin, with_truck):
    tanks, ways = tanks_of(FLEET), ways_of(FLEET, TRUCK if with_truck else None)
    begin = [n for k, n in enumerate(begin) if with_truck or n != begin[k - 1]]
    first = [(n, with_truck and k == len(begin) - 1) for k, n in enumerate(begin)]
    word, trips = np.zeros(LONGEST, dtype=np.int64), np.zeros(LONGEST, dtype=np.bool_)
    word[: len(first)], trips[: len(first)] = zip(*first, strict=True)
    before = limit_of(first, tanks, ways)
    desk = desk_for(4, LONGEST)
    ends = no_ends(2, LONGEST)
    limit, size = change_word(word, trips, len(first), before, tanks, ways, desk, ends)
    # Without a truck two of them are the best within one change as they stand.
    assert limit > (1.02 if with_truck else 1 - 1e-8) * before
    after = list(zip(word[:size].tolist(), trips[:size].tolist(), strict=True))
    assert limit_of(after, tanks, ways) == pytest.approx(limit)
    near = neighbours(after, with_truck)
    assert len(near) > 40
    assert max(limit_of(each, tanks, ways) for each in near) <= limit * (1 + 1e-8)
    # Begun at another visit it is a word that is known: an end is kept once.
    word[:size], trips[:size] = np.roll(word[:size], 2), np.roll(trips[:size], 2)
    again = change_word(word, trips, size, limit, tanks, ways, desk, ends)
    assert (again, ends.sizes.tolist()) == ((limit, size), [size, 0])
    # What differs from it in its trips alone is another word.
    if with_truck:
        trips[:size] = ~trips[:size]
        assert trips[:size].any()
        change_word(word, trips, size, 0.0, tanks, ways, desk, ends)
        assert ends.sizes[1] > 0


# Where the words that were found were less good with more: 3.6% with a larger cart, 1.8% with a
# nearer truck.
OTHER = Fleet(
    (11380.0, 5448.0, 11830.0, 11020.0),
    (6.806, 8.735, 24.01, 25.8),
    (81.32, 148.1, 195.7, 163.9),
    (
        (0.0, 89.0, 64.91, 49.67),
        (89.0, 0.0, 92.86, 118.5),
        (64.91, 92.86, 0.0, 43.62),
        (49.67, 118.5, 43.62, 0.0),
    ),
)
FARTHER = replace(
    FLEET, travel_times=tuple(tuple(2.07 * way for way in row) for row in FLEET.travel_times)
)


@pytest.mark.parametrize(
    ("fleet", "truck", "more"),
    [
        (OTHER, Truck(27330.0, 20.61, 447.2, 6.76), {"travel_time": 18.549}),
        (FARTHER, Truck(24980.0, 21.03, 244.8, 28.72), {"cart_capacity": 27478.0}),
    ],
)
def test_more_of_anything_is_no_worse_where_words_are_long(fleet, truck, more):
    less = answer_schedule(fleet, 1, truck).travel_scale
    assert answer_schedule(fleet, 1, replace(truck, **more)).travel_scale >= less * (1 - 1e-6)
