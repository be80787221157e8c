"""The model of carts, where what has to come out can be said by hand."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sightfield.systems.numerics.harvest.fleets.cart_rounds import (
    AROUND,
    DETOUR,
    WorkAhead,
    run_carts,
)
from sightfield.systems.numerics.harvest.machines import Cart, Combine
from sightfield.systems.numerics.harvest.trucks import TruckFleet

SPEED = 5.0


def steady(grain: float, rate: float, place=(0.0, 0.0), *, opens: bool = True) -> WorkAhead:
    """A combine that cuts evenly on the spot, always or never with room for a cart beside it."""
    count = round(grain / rate) + 2
    cut = np.minimum(rate * np.arange(count), grain)
    numbers = np.arange(count) if opens else np.full(count, count)
    return WorkAhead(cut, np.tile(np.array(place), (count, 1)), numbers, grain / rate)


def away(time: float) -> np.ndarray:
    """The place of a truck that a cart needs so long to from the origin, shape (1, 2)."""
    return np.array([[SPEED * (time - AROUND) / DETOUR, 0.0]])


def test_a_combine_stands_while_its_only_cart_is_away():
    """A tank is full in 100 s, the way to the truck takes 150 s: 200 s of each 300 s are lost."""
    combine = Combine(capacity=1000.0, unload_rate=1000.0)
    cart = Cart(capacity=1000.0, speed=SPEED)
    trucks = TruckFleet()
    done = run_carts([steady(5000.0, 10.0)], [combine], cart, away(150.0), trucks, 1e6, 1.0)
    # The first time 50 s, then three times 200 s; each time a second for the grain.
    assert done.misses == 4
    assert done.stops.sum() == pytest.approx(50 + 3 * 200 + 4, abs=6.0)
    assert done.trips == done.visits == 5
    # The last tank is fetched after the work is done.
    assert done.makespan == pytest.approx(150 + 5 * 300, abs=160)


def test_a_cart_of_any_size_beside_a_combine_is_never_missed():
    combine = Combine(capacity=1000.0, unload_rate=100.0)
    work = [steady(20000.0, 10.0)]
    done = run_carts(work, [combine] * len(work), Cart(speed=SPEED), away(50.0), TruckFleet(), 1e6)
    assert done.misses == 0
    assert done.ends == pytest.approx([2000.0])
    assert done.trips == 1


def test_where_no_cart_comes_beside_a_combine_it_stands_for_each():
    combine = Combine(capacity=1000.0, unload_rate=100.0)
    work = [steady(4500.0, 10.0, opens=False)]
    done = run_carts(work, [combine] * len(work), Cart(speed=SPEED), away(50.0), TruckFleet(), 1e6)
    assert done.misses == 4
    assert done.stops.sum() == pytest.approx(4 * 10.0, abs=120.0)


def test_trucks_hold_carts_up():
    """Grain for ten trucks, of which one is there every 15 min: nobody can be quicker."""
    combine = Combine(capacity=2000.0, unload_rate=100.0)
    cart, work = Cart(capacity=8000.0, speed=SPEED), [steady(40000.0, 20.0)]
    fleets = [TruckFleet(count=n, capacity=4000.0, road_time=900.0) for n in (1, 2, 4)]
    times = [
        run_carts(work, [combine] * len(work), cart, away(50.0), each, 400.0) for each in fleets
    ]
    assert times[0].makespan >= 9 * 900.0
    assert times[0].makespan > times[1].makespan > times[2].makespan
    assert times[0].at_trucks.sum() > times[1].at_trucks.sum()


@settings(max_examples=40, deadline=None)
@given(
    st.lists(st.floats(3.0, 30.0), min_size=1, max_size=4),
    st.integers(1, 3),
    st.floats(0.2, 1.0),
    st.floats(6000.0, 40000.0) | st.just(math.inf),
)
def test_all_grain_arrives_and_nothing_is_done_twice(rates, carts, threshold, capacity):
    combine = Combine(capacity=3000.0, unload_rate=80.0)
    places = np.array([[300.0 * k, -50.0] for k in range(carts)])
    work = [steady(9000.0 + 500 * n, r, (120.0 * n, 80.0)) for n, r in enumerate(rates)]
    grain = sum(float(each.cut[-1]) for each in work)
    cart = Cart(capacity=capacity, speed=SPEED)
    done = run_carts(
        work, [combine] * len(work), cart, places, TruckFleet(count=carts), 100.0, threshold
    )
    assert done.emptying.sum() * 100.0 == pytest.approx(grain, abs=5.0)
    assert done.trips <= done.visits
    assert (done.stops >= 0).all()
    assert done.makespan >= max(each.end for each in work)
    busy = done.beside + done.emptying + done.at_trucks
    assert (busy <= done.cart_ends + 1e-6).all()
