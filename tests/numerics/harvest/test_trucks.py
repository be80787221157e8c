"""Trucks that take turns at the edge of a field, against what each of them holds at every time."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.harvest.trucks import Filling, TruckFleet, TruckPool

RATE = 100.0


def test_a_truck_that_holds_any_amount_takes_at_once():
    pool = TruckPool(TruckFleet())
    assert pool.empty(50.0, 12000.0, RATE) == [Filling(0, 50.0, 170.0, 12000.0)]


def test_a_cart_waits_until_a_full_truck_is_back():
    pool = TruckPool(TruckFleet(capacity=10000.0, road_time=600.0))
    first, rest = pool.empty(0.0, 15000.0, RATE)
    assert first == Filling(0, 0.0, 100.0, 10000.0)
    assert rest == Filling(0, 700.0, 750.0, 5000.0)


def test_the_next_truck_takes_what_one_does_not_hold():
    pool = TruckPool(TruckFleet(count=2, capacity=10000.0, road_time=600.0))
    assert [each.truck for each in pool.empty(0.0, 15000.0, RATE)] == [0, 1]
    # The second one has half of its room left.
    assert pool.empty(200.0, 5000.0, RATE) == [Filling(1, 200.0, 250.0, 5000.0)]


@pytest.mark.parametrize(
    "wrong", [{"count": 0}, {"capacity": 0.0}, {"road_time": -1.0}, {"road_time": np.inf}]
)
def test_trucks_that_are_none_are_refused(wrong):
    with pytest.raises(InvalidInput):
        TruckFleet(**wrong)


@settings(max_examples=80, deadline=None)
@given(
    st.lists(st.tuples(st.floats(0.0, 900.0), st.floats(100.0, 30000.0)), min_size=1, max_size=12),
    st.integers(1, 3),
    st.floats(4000.0, 40000.0),
    st.floats(0.0, 2000.0),
)
def test_no_truck_holds_more_than_it_can_or_is_in_two_places(carts, count, capacity, road):
    fleet, time, settled = TruckFleet(count=count, capacity=capacity, road_time=road), 0.0, []
    for wait, load in carts:
        time += wait
        # A pool that is told what is settled goes on as one that has settled it.
        fillings = TruckPool(fleet, settled).empty(time, load, RATE)
        assert sum(each.amount for each in fillings) == pytest.approx(load, abs=1e-5)
        assert fillings[0].begin >= time
        settled += fillings
    for truck in range(count):
        own = [each for each in settled if each.truck == truck]
        load, end = 0.0, 0.0
        for each in own:
            assert each.begin >= end - 1e-9
            if each.begin >= end + road - 1e-9:
                load = 0.0
            load, end = load + each.amount, each.end
            assert load <= capacity + 1e-5
