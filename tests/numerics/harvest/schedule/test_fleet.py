"""Fleets, trucks and rounds: what is refused, and what lies between two visits."""

import math
from dataclasses import replace

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.harvest.schedule.answer import (
    Holds,
    InfeasibilityCertificate,
    answer_schedule,
    first_visits,
)
from sightfield.systems.numerics.harvest.schedule.carts import find_remedies
from sightfield.systems.numerics.harvest.schedule.fleet import (
    LEAST,
    MOST,
    Fleet,
    Round,
    Truck,
    line_of,
    require_count,
    round_of,
    sequential_round,
    way_by_truck,
)
from sightfield.systems.numerics.harvest.schedule.limits import (
    certain_limit,
    driving_scale,
    earliest_loads,
    first_to_overflow,
    is_excluded,
    last_factor,
    least_carts,
    unloading_share,
)
from sightfield.systems.numerics.harvest.schedule.simulation import CartRun, simulate_schedule

FLEET = Fleet((90.0, 60.0, 70.0), (1.0, 1.4, 0.9), (10.0, 12.0, 9.0), line_of((3.0, 7.0)))
TRUCK = Truck(130.0, 4.0, 50.0, 2.5)


def test_ways_along_a_line_are_sums_of_its_gaps():
    assert line_of((3.0, 7.0)) == ((0.0, 3.0, 10.0), (3.0, 0.0, 7.0), (10.0, 7.0, 0.0))
    assert line_of(()) == ((0.0,),)
    with pytest.raises(InvalidInput, match="`travel_time` must be zero or positive"):
        line_of((3.0, -1e-9))


@pytest.mark.parametrize("value", [LEAST, MOST])
def test_amounts_and_rates_may_be_as_small_and_as_large_as_told(value):
    assert (LEAST, MOST) == (1e-9, 1e12)
    Fleet((value,), (0.5 * LEAST * 2,), (1.0,), ((0.0,),))
    Fleet((1.0,), (LEAST,), (MOST,), ((0.0,),))
    Truck(value, MOST, value, MOST)
    beyond = value * (0.999 if value == LEAST else 1.001)
    with pytest.raises(InvalidInput, match="`capacity` must lie between"):
        Fleet((beyond,), (1.0,), (2.0,), ((0.0,),))
    with pytest.raises(InvalidInput, match="`cart_capacity` must lie between"):
        Truck(beyond)
    with pytest.raises(InvalidInput, match="`truck_unload_rate` must lie between"):
        Truck(1.0, 0.0, beyond)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"capacities": ()}, "`combines` must be at least 1; got 0"),
        ({"fill_rates": (1.0, 1.0)}, "`fill_rates` must have one entry for each of the 3"),
        ({"unload_rates": (9.0,) * 4}, "`unload_rates` must have one entry"),
        ({"travel_times": ((0.0,),)}, "`travel_times` must have one entry"),
        ({"travel_times": ((0.0, 1.0), (0.0, 1.0), (0.0, 1.0))}, "be a square matrix"),
        ({"travel_times": ((0.0, 1.0, 2.0), (1.0, 0.5, 1.0), (1.0, 2.0, 0.0))}, "combine 1 to it"),
        ({"travel_times": ((0.0, 2e12, 2.0), (1.0, 0.0, 1.0), (1.0, 2.0, 0.0))}, "at most 1e"),
        ({"travel_times": ((0.0, -1.0, 2.0), (1.0, 0.0, 1.0), (1.0, 2.0, 0.0))}, "zero or pos"),
        ({"fill_rates": (1.0, 12.0, 0.9)}, "`unload_rate` must exceed the fill rate"),
        ({"fill_rates": (1.0, 1.0, 1e-10)}, "`fill_rate` must lie between"),
        ({"unload_rates": (9.0, 9.0, 1e13)}, "`unload_rate` must lie between"),
    ],
)
def test_fleets_that_no_field_has_are_refused(changes, message):
    with pytest.raises(InvalidInput, match=message):
        replace(FLEET, **changes)


def test_the_longest_way_is_allowed():
    ways = ((0.0, MOST, 0.0), (1.0, 0.0, 1.0), (1.0, 2.0, 0.0))
    assert replace(FLEET, travel_times=ways).travel_times == ways


@pytest.mark.parametrize(
    ("told", "message"),
    [
        ((0.0,), "`cart_capacity` must be positive"),
        ((9.0, -1.0), "`truck_travel_time` must be zero or positive"),
        ((9.0, 1.001 * MOST), "`truck_travel_time` must be at most 1e"),
        ((9.0, 0.0, 0.0), "`truck_unload_rate` must be positive"),
        ((9.0, 0.0, 5.0, -1.0), "`truck_stop_time` must be zero or positive"),
        ((9.0, 0.0, 5.0, 1.001 * MOST), "`truck_stop_time` must be at most 1e"),
    ],
)
def test_trucks_that_no_road_has_are_refused(told, message):
    with pytest.raises(InvalidInput, match=message):
        Truck(*told)


def test_by_default_a_truck_costs_no_time():
    truck = Truck(9.0)
    assert (truck.travel_time, truck.unload_rate, truck.stop_time) == (0.0, math.inf, 0.0)


@pytest.mark.parametrize("value", [True, 1.0, "1", 0])
def test_a_count_is_a_whole_number_from_one_on(value):
    require_count("carts", 1)
    with pytest.raises(InvalidInput, match="`carts` must be"):
        require_count("carts", value)


def test_a_part_of_a_fleet_is_numbered_anew():
    part = FLEET.part((2, 0))
    assert part.size == 2
    assert part == Fleet((70.0, 90.0), (0.9, 1.0), (9.0, 10.0), ((0.0, 10.0), (10.0, 0.0)))
    assert FLEET.net_rate(1) == pytest.approx(10.6)
    assert FLEET.filling_time(2) == pytest.approx(70 / 0.9)


def test_the_way_by_the_truck_is_there_and_back_and_no_shorter_than_the_way_without():
    assert way_by_truck(FLEET, TRUCK, 0, 1) == 8.0
    assert way_by_truck(FLEET, TRUCK, 0, 2) == 10.0
    round_ = round_of(FLEET, (1, 2, 0), (True, False, True), TRUCK)
    assert round_.travel_times == (8.0, 10.0, 8.0)
    assert round_of(FLEET, (1, 2, 0), (True, False, True)).travel_times == (7.0, 10.0, 3.0)


def test_who_was_visited_last_and_whose_grain_a_trip_brings():
    rng = np.random.default_rng(6)
    for _ in range(60):
        size = int(rng.integers(1, 8))
        word, trips = rng.integers(0, 3, size).tolist(), (rng.random(size) < 0.4).tolist()
        round_ = Round(tuple(word), (1.0,) * size, tuple(trips), TRUCK)
        for visit in range(size):
            back = next(k for k in range(1, size + 1) if word[(visit - k) % size] == word[visit])
            assert round_.previous(visit) == back
            block, at = [visit], (visit - 1) % size
            while not trips[at] and at != visit:
                block.append(at)
                at = (at - 1) % size
            assert round_.block(visit) == block


def test_trips_need_a_truck_and_carts_that_share_one_visit_to_each():
    with pytest.raises(InvalidInput, match="`visits_per_trip` must come with a truck"):
        sequential_round(FLEET, None, None, 2)
    with pytest.raises(InvalidInput, match="`visits_per_trip` must be at least 1"):
        sequential_round(FLEET, None, TRUCK, 0)
    with pytest.raises(InvalidInput, match="`round` must visit each combine once"):
        round_of(FLEET, (0, 1, 0), (False,) * 3, None, 2)
    with pytest.raises(ValueError, match="argument"):
        round_of(FLEET, (0, 1), (False,))
    assert round_of(FLEET, (0, 1, 0), (False,) * 3).carts == 1
    assert round_of(FLEET, (0, 1, 2), (False,) * 3, None, 2).carts == 2
    assert sequential_round(FLEET, (2, 0)).combines == (2, 0)
    assert sequential_round(FLEET, None, TRUCK).trips == (False, False, True)
    six = sequential_round(FLEET, None, TRUCK, 2)
    assert six.combines == (0, 1, 2, 0, 1, 2)
    assert six.trips == (False, True) * 3


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"fill": 0.0}, "`fill` must lie above 0 and up to 1"),
        ({"fill": 1.001}, "`fill` must lie above 0 and up to 1"),
        ({"jitter": 0.1, "fill": 0.9}, "`jitter` must come without fill"),
        ({"jitter": -0.1}, "`jitter` must be zero or positive"),
        ({"jitter": 1.001 * MOST}, "`jitter` must be at most 1e"),
        ({"carts": 0}, "`carts` must be at least 1"),
    ],
)
def test_questions_that_make_no_sense_are_refused(options, message):
    with pytest.raises(InvalidInput, match=message):
        answer_schedule(FLEET, **options)


def test_no_jitter_and_the_largest_are_asked_for():
    assert answer_schedule(FLEET, jitter=0.0).feasible
    assert not answer_schedule(FLEET, jitter=MOST).feasible


@pytest.mark.parametrize(
    ("resource", "limit", "words"),
    [
        ("unload_rate", 0.0, "unloading takes more time than the carts have, whatever carts do"),
        ("travel_time", 0.0, "ways would have to take none of their time, whatever carts do"),
        ("travel_time", -1.0, "ways would have to take none of their time, whatever carts do"),
        ("travel_time", 0.81237, "ways would have to take at most 0.8124 of their time, whatever"),
    ],
)
def test_a_certificate_says_what_there_is_too_little_of(resource, limit, words):
    assert InfeasibilityCertificate(resource, limit, Holds.ANY).says.startswith(words)


def test_the_first_visit_to_each_combine():
    assert first_visits((2, 0, 2, 1, 0)) == {2: 0, 0: 1, 1: 3}
    assert first_visits(()) == {}


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"cycles": 0}, "`cycles` must be at least 1"),
        ({"start_times": (0.0,) * 2}, "`start_times` must have 3 entries"),
        ({"initial_loads": (0.0,) * 4}, "`initial_loads` must have 3 entries"),
        ({"initial_loads": (0.0, -1e-9, 0.0)}, "`initial_loads` must fit into the tanks"),
        ({"initial_loads": (90.001, 0.0, 0.0)}, "`initial_loads` must fit into the tanks"),
    ],
)
def test_a_simulation_asks_for_numbers_that_fit(options, message):
    run = CartRun(sequential_round(FLEET))
    full = simulate_schedule(FLEET, run, 1, initial_loads=FLEET.capacities)
    assert full.visits[0].load_at_start == 90.0
    with pytest.raises(InvalidInput, match=message):
        simulate_schedule(FLEET, run, **{"cycles": 1, **options})


def test_carts_that_are_just_busy_all_the_time_are_enough():
    # Four combines of which each fills half a tank while it is emptied.
    busy = Fleet.equal(4, 100.0, 6.0, 12.0, 0.0)
    assert least_carts(busy) == 2
    assert certain_limit(busy, 2) == math.inf
    assert not is_excluded(busy, 2)
    assert is_excluded(busy, 1)
    assert certain_limit(busy, 1) == 0.0
    # With the time at the truck there are three.
    truck = Truck(1_000.0, 0.0, 24.0, 0.0)
    assert least_carts(busy, truck) == 3
    assert not is_excluded(busy, 3, truck)
    assert is_excluded(busy, 3, replace(truck, stop_time=1e-3))
    assert certain_limit(busy, 3, replace(truck, stop_time=1e-3)) == 0.0


def test_a_cart_that_never_drives_bears_any_change_but_augers_as_slow_as_headers():
    factors = find_remedies(Fleet.equal(1, 100.0, 1.0, 2.0, 0.0)).factors
    assert factors["travel_time"] == math.inf
    assert factors["capacity"] == 0.0
    # Grain is cut half as fast as it is unloaded.
    assert factors["fill_rate"] == pytest.approx(2.0)
    assert factors["unload_rate"] == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("combines", "apart", "excluded"), [(8, 1400, False), (8, 1600, True), (9, 1600, False)]
)
def test_one_cart_has_to_go_to_and_fro_between_two_groups(combines, apart, excluded):
    # On the mean it might stay in each of them for a time: up to eight combines that is ruled out.
    places = np.arange(combines) % 2
    ways = np.where(places[:, None] == places, 1.0, float(apart))
    np.fill_diagonal(ways, 0.0)
    rates = (1.0,) * combines, (200.0,) * combines
    fleet = Fleet((1_500.0,) * combines, *rates, tuple(map(tuple, ways.tolist())))
    assert is_excluded(fleet, 1) == excluded
    assert not is_excluded(fleet, 2)


def test_loads_of_a_cart_that_never_waits_are_those_of_its_period():
    fleet = Fleet((90.0, 60.0), (1.0, 1.5), (10.0, 12.0), ((0.0, 4.0), (5.0, 0.0)))
    round_ = sequential_round(fleet)
    share = 1 / 10 + 1.5 / 12
    period = 9.0 / (1 - share)
    loads = 1.0 * 0.9 * period, 1.5 * (1 - 1.5 / 12) * period
    assert unloading_share(fleet, (0, 1)) == pytest.approx(share)
    assert earliest_loads(fleet, round_) == pytest.approx(loads)
    assert driving_scale(fleet, round_) == pytest.approx(min(90 / loads[0], 60 / loads[1]))
    assert first_to_overflow(fleet, round_) == (1,)
    # Where nothing is driven loads vanish, unless there are too many to unload.
    still = Fleet.equal(4, 90.0, 3.0, 12.0, 0.0)
    assert earliest_loads(still, sequential_round(still)) == (0.0,) * 4
    assert driving_scale(still, sequential_round(still)) == math.inf
    many = Fleet.equal(5, 90.0, 3.0, 12.0, 0.0)
    assert earliest_loads(many, sequential_round(many)) == (math.inf,) * 5
    assert first_to_overflow(many, sequential_round(many)) == (0, 1, 2, 3, 4)
    busy = Fleet.equal(4, 90.0, 3.0, 12.0, 1.0)
    assert earliest_loads(busy, sequential_round(busy)) == (math.inf,) * 4


def test_the_last_factor_is_bracketed_as_nearly_as_asked():
    for limit in (0.3, 1.0, 7.7):
        low, high = last_factor(lambda factor, limit=limit: factor <= limit, 0.0, 1.0, 1e-6, 1e9)
        assert low <= limit < high
        assert high - low <= 1e-6 * high
    assert last_factor(lambda factor: True, 0.0, 1.0, 1e-6, 100.0) == (math.inf, math.inf)
    asked = []
    last_factor(lambda factor: asked.append(factor) or True, 0.0, 1.0, 1e-6, 100.0)
    assert asked == [1, 2, 4, 8, 16, 32, 64, 128]
    # A limit at which it still holds is not beyond it.
    low, high = last_factor(lambda factor: factor <= 64, 0.0, 1.0, 1e-6, 64.0)
    assert low <= 64.0 < high
