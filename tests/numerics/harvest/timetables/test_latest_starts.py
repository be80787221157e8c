"""Timetables for real work are those of the thesis where the work is as it assumes."""

import math
from dataclasses import replace

import numpy as np
import pytest

from sightfield.systems.numerics.harvest.schedule import closed_forms as forms
from sightfield.systems.numerics.harvest.schedule.closed_forms import EqualCombines
from sightfield.systems.numerics.harvest.schedule.fleet import Truck
from sightfield.systems.numerics.harvest.timetables.latest_starts import Service, plan_visits
from sightfield.systems.numerics.harvest.timetables.pouring import pour
from sightfield.systems.numerics.harvest.timetables.work import Work

STEP = 0.5
EQUAL = EqualCombines(3, 3600.0, 2.0, 20.0, 0.0)


def endless(equal, hours=8.0):
    """Combines side by side on straights, each a cart's way of `travel_time` from the next."""
    grain = equal.fill_rate * STEP * np.arange(int(3600 * hours / STEP) + 1)
    reachable = np.ones(len(grain) - 1, dtype=bool)
    places = [np.tile([n * equal.travel_time, 0.0], (len(grain), 1)) for n in range(equal.combines)]
    return [Work(STEP, grain, reachable, place) for place in places]


def service_of(equal, truck=None):
    return Service(
        level=equal.capacity,
        capacity=equal.capacity,
        rate=equal.unload_rate,
        speed=1.0,
        roundabout=1.0,
        settling=0.0,
        truck=truck,
    )


def plan(equal, truck=None, works=None):
    works = endless(equal) if works is None else works
    starts = works[0].places[:1]
    return plan_visits(works, [range(len(works))], starts, service_of(equal, truck))


def slower(combines, factor):
    """Equal combines whose travel time is a factor of the largest."""
    none = replace(EQUAL, combines=combines)
    return replace(none, travel_time=factor * forms.travel_time_max(none))


@pytest.mark.parametrize("combines", [2, 3, 4, 5])
def test_below_the_limit_of_travel_times_no_tank_overflows(combines):
    equal = slower(combines, 0.99)
    assert plan(equal).overflows == {}


@pytest.mark.parametrize("combines", [2, 3, 4, 5])
def test_above_the_limit_one_does(combines):
    assert plan(slower(combines, 1.02)).overflows


@pytest.mark.parametrize("combines", [2, 3, 4, 5])
def test_at_the_limit_rounds_keep_the_period_of_the_thesis(combines):
    """C, C'_1, ..., C'_(N-2), C at first, or later, if the others begin (N - 1) dT before."""
    equal = slower(combines, 1.0 - 1e-9)
    filled = equal.capacity / equal.fill_rate
    late = round((filled - (combines - 1) * equal.travel_time) / STEP)
    works = endless(equal)
    for n, work in enumerate(works[1:], start=1):
        grain = np.concatenate([np.zeros(late), work.grain[: len(work.grain) - late]])
        works[n] = replace(work, grain=grain)
    visits = plan(equal, works=works).visits
    found = [visit.load_at_start for visit in visits[:combines]]
    accuracy = 4 * equal.fill_rate * STEP
    assert found[0] == pytest.approx(equal.capacity, abs=accuracy)
    assert found[-1] == pytest.approx(equal.capacity, abs=accuracy)
    assert (np.array(found) >= np.array(forms.loads_at_start(equal)) - accuracy).all()
    starts = [visit.start_unloading for visit in visits if visit.combine == 0][:8]
    assert np.diff(starts)[2:] == pytest.approx(forms.period(equal), abs=4 * STEP)


def test_the_cart_waits_with_an_emptied_combine_until_it_has_to_leave():
    equal = slower(2, 0.5)
    for visit in plan(equal).visits[1:6]:
        assert visit.arrive == pytest.approx(visit.start_unloading, abs=2 * STEP)
        assert visit.wait == pytest.approx(forms.waiting_time(equal), abs=4 * STEP)


def windowed(seed):
    """Work with corners, links and waits at random."""
    rng = np.random.default_rng(seed)
    count = 4000
    cuts = np.repeat(rng.random(count // 40) < 0.8, 40)
    grain = np.concatenate([[0.0], np.cumsum(cuts * 2.0 * STEP)])
    reachable = np.repeat(rng.random(count // 20) < 0.8, 20)
    places = np.cumsum(rng.normal(0.0, 1.0, (count + 1, 2)), axis=0)
    return Work(STEP, grain, reachable, places)


@pytest.mark.parametrize("seed", range(5))
def test_all_grain_is_taken_and_the_tanks_say_so_throughout(seed):
    works = [windowed(10 * seed + n) for n in range(3)]
    timetable = plan(EQUAL, works=works)
    for n, work in enumerate(works):
        mine = [visit for visit in timetable.visits if visit.combine == n]
        assert sum(visit.taken for visit in mine) == pytest.approx(work.grain[-1])
        times = timetable.tanks[n].times
        taken = sum(np.where(times >= visit.leave, visit.taken, 0.0) for visit in mine)
        between = np.ones(len(times), dtype=bool)
        for visit in mine:
            between &= (times <= visit.start_unloading) | (times >= visit.leave)
        cut = np.interp(times, STEP * np.arange(len(work.grain)), work.grain)
        held = timetable.tanks[n].loads
        assert held[between] == pytest.approx((cut - taken)[between], abs=1e-6)
        assert (held >= -1e-9).all()
    assert timetable.carts[0].loads[-1] == pytest.approx(sum(w.grain[-1] for w in works))


@pytest.mark.parametrize("seed", range(5))
def test_tanks_fill_up_to_the_level_and_no_further_where_the_cart_comes_in_time(seed):
    works = [windowed(10 * seed + n) for n in range(2)]
    timetable = plan(EQUAL, works=works)
    for visit in timetable.visits:
        late = visit.arrive == visit.start_unloading
        assert late or visit.load_at_start <= EQUAL.capacity + 1e-9


def test_a_cart_of_finite_capacity_goes_by_the_truck_before_it_is_full():
    equal = slower(2, 0.3)
    truck = Truck(cart_capacity=2.5 * equal.capacity, travel_time=60.0, unload_rate=100.0)
    timetable = plan(equal, truck, endless(equal, 2.0))
    assert any(visit.by_truck for visit in timetable.visits)
    assert timetable.carts[0].loads.max() <= truck.cart_capacity
    by_truck = [k for k, visit in enumerate(timetable.visits) if visit.by_truck]
    for k in by_truck:
        gone = timetable.visits[k + 1].arrive - timetable.visits[k].leave
        assert gone >= 2 * truck.travel_time


@pytest.mark.parametrize("seed", range(20))
def test_pouring_agrees_with_ever_smaller_steps(seed):
    """An integration with 50 steps for one, which pours drop by drop."""
    work = windowed(seed)
    rng = np.random.default_rng(seed)
    first, load, rate = int(rng.integers(0, 3000)), float(rng.uniform(0, 3000)), 15.0
    emptied, loads = pour(work.grain, work.reachable, first, -1, load, rate, STEP)
    held, fine = load, 50
    for k in range(first, 2 * len(work.reachable)):
        inside = k < len(work.reachable)
        rate_in = (work.grain[k + 1] - work.grain[k]) / fine if inside else 0.0
        for _ in range(fine):
            held += rate_in
            if not inside or work.reachable[k]:
                held = max(held - rate * STEP / fine, 0.0)
        if k + 1 - first < len(loads):
            assert loads[k + 1 - first] == pytest.approx(held, abs=rate * STEP / fine + 1e-6)
        if held <= 0.0:
            assert emptied == pytest.approx(k + 1, abs=1)
            break
    else:
        assert math.isinf(emptied)
