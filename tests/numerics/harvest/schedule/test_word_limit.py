"""What a word allows: as the programme of `periodic_plan` has it, and as a cart drives it."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sightfield.systems.numerics.harvest.schedule.fleet import Fleet, Truck, line_of, round_of
from sightfield.systems.numerics.harvest.schedule.periodic_plan import travel_scale_max
from sightfield.systems.numerics.harvest.schedule.word_limit import tanks_of, ways_of, word_limit


@st.composite
def words(draw):
    """Combines of all sorts at random places, a truck or none, and visits with trips."""
    random = np.random.default_rng(draw(st.integers(0, 10_000)))
    count = int(random.integers(2, 5))
    unload = random.uniform(80.0, 200.0, count)
    shares = random.uniform(0.05, 1.0, count)
    shares *= random.uniform(0.2, 0.9) / shares.sum()
    places = random.uniform(0.0, 100.0, (count, 2))
    ways = np.hypot(*(places[:, None] - places).transpose(2, 0, 1))
    fleet = Fleet(
        tuple(random.uniform(3_000.0, 12_000.0, count).tolist()),
        tuple((shares * unload).tolist()),
        tuple(unload.tolist()),
        tuple(map(tuple, ways.tolist())),
    )
    truck = None
    if draw(st.booleans()):
        room, away = random.uniform(0.5, 4.0) * 12_000.0, random.uniform(0.0, 80.0)
        truck = Truck(room, away, random.uniform(150.0, 600.0), random.uniform(0.0, 30.0))
    word = [*range(count), *random.integers(0, count, random.integers(0, 7)).tolist()]
    random.shuffle(word)
    trips = [truck is not None and bool(random.random() < 0.4) for _ in word]
    # One visit told as two is no word.
    size = len(word)
    kept = [n for n in range(size) if trips[n] or word[n] != word[(n + 1) % size]]
    word, trips = [word[n] for n in kept], [trips[n] for n in kept]
    if truck is not None and not any(trips):
        trips[-1] = True
    return fleet, truck, word, trips


def limit_of(fleet, truck, word, trips, least=0.0):
    return word_limit(
        np.array(word), np.array(trips, dtype=bool), tanks_of(fleet), ways_of(fleet, truck), least
    )


@settings(max_examples=300)
@given(case=words())
def test_it_is_what_the_programme_says(case):
    fleet, truck, word, trips = case
    said = travel_scale_max(fleet, round_of(fleet, word, trips, truck))
    found = limit_of(*case)
    if said <= 0:
        assert found == -math.inf
        return
    assert found == pytest.approx(said, rel=1e-5, abs=1e-6)
    # What is asked for ends the search, and changes no answer.
    assert limit_of(*case, least=1.001 * said + 1e-6) == -math.inf
    assert limit_of(*case, least=0.99 * said) == pytest.approx(said, rel=1e-5, abs=1e-6)


def test_equal_combines_have_the_limit_of_the_thesis():
    # (3.10): C / r_f = (N - 1) C / (r_u - r_f) + (2 N - 2) dT.
    fleet = Fleet.equal(3, 9_000.0, 20.0, 150.0, 1.0)
    limit = (9_000 / 20 - 2 * 9_000 / 130) / 4
    assert limit_of(fleet, None, [0, 1, 2], [False] * 3) == pytest.approx(limit, rel=1e-7)


def test_a_cart_that_is_emptied_sooner_does_not_leave_grain_behind():
    fleet = Fleet((5_000.0, 9_000.0), (10.0, 10.0), (100.0, 100.0), line_of((60.0,)))
    small, ample = Truck(9_000.0, 100.0, 300.0), Truck(90_000.0, 100.0, 300.0)
    once = [0, 1], [False, True]
    assert 0 < limit_of(fleet, small, *once) < limit_of(fleet, ample, *once)
    # A trip after each visit costs the way, and leaves room for all of each tank.
    twice = [0, 1], [True, True]
    assert limit_of(fleet, small, *twice) == pytest.approx(limit_of(fleet, ample, *twice))


def test_where_nothing_is_driven_there_is_no_limit():
    fleet = Fleet.equal(2, 9_000.0, 20.0, 150.0, 0.0)
    assert limit_of(fleet, None, [0, 1], [False, False]) == math.inf
    # Augers that take all of the cart's time leave none to drive.
    busy = Fleet.equal(2, 9_000.0, 20.0, 39.0, 1.0)
    assert limit_of(busy, None, [0, 1], [False, False]) == -math.inf
    assert limit_of(Fleet.equal(2, 9_000.0, 20.0, 150.0, 1.0), None, [0, 0, 1], [False] * 3) < 0
