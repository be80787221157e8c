"""Plans by linear programming: the closed forms for equal combines, and valid for all others."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.harvest.schedule import closed_forms as forms
from sightfield.systems.numerics.harvest.schedule.closed_forms import EqualCombines
from sightfield.systems.numerics.harvest.schedule.fleet import Fleet, Truck, sequential_round
from sightfield.systems.numerics.harvest.schedule.limits import best_round, driving_scale
from sightfield.systems.numerics.harvest.schedule.periodic_plan import (
    Aim,
    plan_round,
    travel_scale_max,
)
from sightfield.systems.numerics.harvest.schedule.simulation import (
    CartRun,
    plan_timetable,
    simulate_schedule,
)


def at_limit(combines, factor):
    limit = forms.travel_time_max(EqualCombines(combines, 100.0, 1.0, 12.0, 0.0))
    return EqualCombines(combines, 100.0, 1.0, 12.0, factor * limit)


@st.composite
def fleets(draw):
    """Two to five combines of all sorts; a cart unloads them in less than 0.9 of its time."""
    count = draw(st.integers(2, 5))
    each = st.lists(st.floats(0.1, 1.0), min_size=count, max_size=count)
    capacities, fills, shares = draw(each), draw(each), draw(each)
    shares = [share * 0.9 / sum(shares) for share in shares]
    rows = st.lists(each, min_size=count, max_size=count)
    ways = [[0.0 if i == j else way for j, way in enumerate(r)] for i, r in enumerate(draw(rows))]
    return Fleet(
        capacities=tuple(100 * capacity for capacity in capacities),
        fill_rates=tuple(fills),
        unload_rates=tuple(fill / share for fill, share in zip(fills, shares, strict=True)),
        travel_times=tuple(tuple(row) for row in ways),
    )


@pytest.mark.parametrize("combines", range(2, 9))
def test_equal_combines_have_the_closed_forms_plan(combines):
    each = at_limit(combines, 0.9)
    round_ = sequential_round(each.fleet())
    plan = plan_round(each.fleet(), round_)
    assert plan.period == pytest.approx(forms.period(each), rel=1e-9)
    assert plan.waits == pytest.approx([forms.waiting_time(each)] * combines, rel=1e-7)
    assert plan.loads_at_start == pytest.approx([each.capacity] * combines, rel=1e-9)
    early = plan_round(each.fleet(), round_, aim=Aim.EARLY)
    assert early.period == pytest.approx(forms.period_min(each), rel=1e-9)
    assert travel_scale_max(each.fleet(), round_) == pytest.approx(1 / 0.9, rel=1e-9)


@pytest.mark.parametrize("combines", range(2, 9))
def test_above_the_limit_there_is_no_plan(combines):
    each = at_limit(combines, 1.01)
    round_ = sequential_round(each.fleet())
    assert plan_round(each.fleet(), round_) is None
    assert travel_scale_max(each.fleet(), round_) == pytest.approx(1 / 1.01, rel=1e-9)


def test_two_combines_begin_a_way_apart():
    # Figure 3.4, read as two combines that start one after the other.
    each = at_limit(2, 0.5)
    stagger = plan_round(each.fleet(), sequential_round(each.fleet())).stagger
    assert stagger == pytest.approx((-100.0, -each.travel_time))


@pytest.mark.parametrize("scale", [1e-7, 1e-4, 1e4, 1e7])
@pytest.mark.parametrize("aim", Aim)
def test_small_tanks_beside_one_another_are_served_as_large_ones_far_apart(scale, aim):
    def fleet_of(size):
        ways = size * np.array([[0.0, 3.0, 5.0], [4.0, 0.0, 2.0], [6.0, 1.0, 0.0]])
        capacities = tuple(size * each for each in (90.0, 70.0, 100.0))
        return Fleet(capacities, (1.0, 0.8, 1.1), (12.0, 10.0, 14.0), tuple(map(tuple, ways)))

    usual, small = (
        plan_round(each, sequential_round(each), aim=aim) for each in map(fleet_of, (1.0, scale))
    )
    assert small.period == pytest.approx(scale * usual.period, rel=1e-9)
    assert small.waits == pytest.approx(
        [scale * each for each in usual.waits], rel=1e-7, abs=1e-7 * scale
    )
    assert small.loads_at_start == pytest.approx(
        [scale * each for each in usual.loads_at_start], rel=1e-7
    )


@settings(max_examples=25)
@given(fleet=fleets(), share=st.floats(0.1, 1.0))
def test_unequal_combines_never_overflow(fleet, share, check_timetable):
    round_ = sequential_round(fleet)
    scale = share * travel_scale_max(fleet, round_)
    ways = tuple(tuple(scale * way * (1 - 1e-9) for way in row) for row in fleet.travel_times)
    fleet = Fleet(fleet.capacities, fleet.fill_rates, fleet.unload_rates, ways)
    plan = plan_round(fleet, sequential_round(fleet))
    check_timetable(fleet, plan_timetable(plan, 10), rel=1e-6)


@settings(max_examples=25)
@given(fleet=fleets())
def test_the_programmes_limit_on_driving_is_that_of_the_formula(fleet):
    round_ = sequential_round(fleet)
    assert travel_scale_max(fleet, round_) == pytest.approx(driving_scale(fleet, round_), rel=1e-6)


@settings(max_examples=15)
@given(fleet=fleets())
def test_no_longer_period_is_possible_and_none_shorter(fleet):
    round_ = sequential_round(fleet)
    scale = 0.7 * travel_scale_max(fleet, round_)
    ways = tuple(tuple(scale * way for way in row) for row in fleet.travel_times)
    fleet = Fleet(fleet.capacities, fleet.fill_rates, fleet.unload_rates, ways)
    round_ = sequential_round(fleet)
    full, early = plan_round(fleet, round_), plan_round(fleet, round_, aim=Aim.EARLY)
    assert early.period < full.period
    middle = (early.period + full.period) / 2
    assert plan_round(fleet, round_, period=middle).period == pytest.approx(middle)
    assert plan_round(fleet, round_, period=full.period * 1.001) is None
    assert plan_round(fleet, round_, period=early.period * 0.999) is None


@pytest.mark.parametrize("every", range(1, 8))
def test_with_trips_after_any_number_of_visits_the_cart_is_never_too_full(every, check_timetable):
    fleet = Fleet.equal(3, 100.0, 1.0, 12.0, 2.0)
    truck = Truck(cart_capacity=500.0, travel_time=5.0, unload_rate=50.0, stop_time=1.0)
    plan = plan_round(fleet, sequential_round(fleet, truck=truck, visits_per_trip=every))
    timetable = plan_timetable(plan, 3)
    check_timetable(fleet, timetable, rel=1e-6)
    assert timetable.carts[0].loads.max() <= 500 * (1 + 1e-6)
    visits = [visit.by_truck for visit in timetable.visits]
    assert visits == [(k + 1) % every == 0 for k in range(len(visits))]


def test_a_cart_that_holds_little_drives_by_the_truck_more_often():
    fleet = Fleet.equal(3, 100.0, 1.0, 12.0, 2.0)
    trips = []
    for room in (130.0, 4000.0):
        round_, scale = best_round(fleet, (0, 1, 2), Truck(room, 5.0, 50.0))
        assert scale > 1
        trips.append(sum(round_.trips) / round_.size)
    assert trips[0] > trips[1]


def test_a_truck_at_no_distance_neither_costs_nor_saves_a_way():
    each = at_limit(4, 0.8)
    plan = plan_round(each.fleet(), sequential_round(each.fleet(), truck=Truck(1e9)))
    # The cart drives back to the first combine, be the truck beside it or not.
    busy = 4 * (each.emptying + plan.waits[0]) + 6 * each.travel_time
    assert plan.period == pytest.approx(busy)
    assert plan.period == pytest.approx(forms.period(each))


def test_the_truck_moves_no_cart():
    fleet = Fleet.equal(4, 9000.0, 20.0, 150.0, 60.0)
    for room in (12_000.0, 36_000.0, 1e9):
        assert best_round(fleet, (0, 1, 2, 3), Truck(room))[1] < 1
    assert best_round(fleet, (0, 1, 2, 3), None)[1] < 1


def test_a_full_cart_leaves_grain_behind_and_drives_by_the_truck():
    fleet = Fleet.equal(2, 100.0, 1.0, 12.0, 2.0)
    truck = Truck(cart_capacity=60.0, travel_time=3.0)
    run = CartRun(round=sequential_round(fleet, truck=truck))
    visit = simulate_schedule(fleet, run, 1, initial_loads=(100.0, 0.0)).visits[0]
    assert visit.taken == pytest.approx(60.0)
    assert visit.by_truck
    # The auger delivers 12: eleven off the load and one that is cut meanwhile.
    assert visit.leave == pytest.approx(5.0)


def test_what_runs_over_is_counted():
    fleet = Fleet.equal(2, 100.0, 1.0, 12.0, 0.0)
    run = CartRun(round=sequential_round(fleet), first_start=150.0)
    timetable = simulate_schedule(fleet, run, 1)
    assert timetable.overflows == {0: 100.0, 1: 100.0}
    assert timetable.lost == pytest.approx((50.0, 50.0 + 100 / 11))
    assert timetable.tanks[0]([50.0, 120.0, 150.0]) == pytest.approx([50.0, 100.0, 100.0])


def test_from_empty_tanks_the_first_round_is_early_and_the_rest_follows_the_plan(check_timetable):
    each = at_limit(4, 0.9)
    plan = plan_round(each.fleet(), sequential_round(each.fleet()), fill=0.95)
    timetable = plan_timetable(plan, 6, initial_loads=(10.0, 0, 30.0, 0), start_times=(0, 5, 9, 14))
    check_timetable(each.fleet(), timetable)
    first, later = timetable.visits[:4], timetable.visits[4:]
    assert max(visit.load_at_start for visit in first) == pytest.approx(95.0)
    assert [visit.load_at_start for visit in later] == pytest.approx([95.0] * 20)
    starts = np.array([visit.start_unloading for visit in timetable.visits]).reshape(6, 4)
    assert np.diff(starts, axis=0) == pytest.approx(plan.period)


def test_a_cart_that_comes_late_catches_up():
    each = at_limit(3, 0.6)
    plan = plan_round(each.fleet(), sequential_round(each.fleet()), fill=0.8)
    on_time = plan_timetable(plan, 12)
    late = plan_timetable(plan, 12, start_times=plan.stagger, ready=15.0)
    assert late.visits[0].start_unloading == 15.0
    assert not late.overflows
    assert late.visits[-1].load_at_start == pytest.approx(on_time.visits[-1].load_at_start)


def test_one_combine_is_served_when_its_tank_is_full(check_timetable):
    fleet = Fleet.equal(1, 100.0, 1.0, 12.0, 5.0)
    plan = plan_round(fleet, sequential_round(fleet))
    timetable = plan_timetable(plan, 5)
    check_timetable(fleet, timetable)
    assert [visit.load_at_start for visit in timetable.visits] == pytest.approx([100.0] * 5)
    assert plan.period == pytest.approx(100 + 100 / 11)
    assert travel_scale_max(fleet, plan.round) == math.inf


@pytest.mark.parametrize("fill", [0.0, -1.0, 1.1])
def test_only_parts_of_a_tank_can_be_used(fill):
    fleet = Fleet.equal(2, 100.0, 1.0, 12.0, 1.0)
    with pytest.raises(InvalidInput, match="`fill` must lie above 0"):
        plan_round(fleet, sequential_round(fleet), fill=fill)


@pytest.mark.parametrize("order", [(), (0, 0), (0, 5), (-1,)])
def test_a_round_serves_each_combine_once(order):
    with pytest.raises(InvalidInput, match="`order` must name"):
        sequential_round(Fleet.equal(2, 100.0, 1.0, 12.0, 1.0), order)
