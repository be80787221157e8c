"""Several carts: no split is better than the one that is found."""

from itertools import combinations, permutations

import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.harvest.schedule import closed_forms as forms
from sightfield.systems.numerics.harvest.schedule.answer import answer_schedule, answer_timetable
from sightfield.systems.numerics.harvest.schedule.carts import (
    assign_combines,
    find_remedies,
    shortest_tour,
    tour_time,
)
from sightfield.systems.numerics.harvest.schedule.closed_forms import EqualCombines
from sightfield.systems.numerics.harvest.schedule.fleet import Fleet, Truck, line_of
from sightfield.systems.numerics.harvest.schedule.limits import best_round

MIXED = Fleet(
    capacities=(90.0, 60.0, 120.0, 100.0, 70.0, 80.0),
    fill_rates=(1.0, 1.4, 0.9, 1.2, 0.7, 1.1),
    unload_rates=(10.0, 12.0, 9.0, 14.0, 8.0, 11.0),
    travel_times=line_of((3.0, 7.0, 2.0, 5.0, 4.0)),
)
EQUAL = Fleet.equal(6, 100.0, 1.0, 12.0, 5.0)


def slowest_driving(fleet, group):
    """How much slower a cart may drive in a group: brute force over orders, from first principles.

    In a period P the cart drives D and stays r_f P / r_u with each; a tank fills in the rest.
    """
    way = min(tour_time(fleet, order) for order in permutations(group))
    shares = {n: fleet.fill_rates[n] / fleet.unload_rates[n] for n in group}
    spare = 1 - sum(shares.values())
    return min(
        fleet.capacities[n] / fleet.fill_rates[n] / (1 - shares[n]) * spare / way for n in group
    )


@pytest.mark.parametrize("fleet", [EQUAL, MIXED], ids=["equal", "mixed"])
def test_two_carts_with_six_combines_do_at_least_as_well_as_any_even_split(fleet):
    found = assign_combines(fleet, 2)
    worst = min(group.travel_scale for group in found)
    for first in combinations(range(6), 3):
        others = tuple(n for n in range(6) if n not in first)
        even = min(slowest_driving(fleet, first), slowest_driving(fleet, others))
        assert worst >= even * (1 - 1e-9)
    # Other orders of visits may be better still than one visit to each.
    once = [best_round(fleet, group.order, None)[1] for group in found]
    assert min(once) == pytest.approx(min(slowest_driving(fleet, group.order) for group in found))
    assert worst >= min(once) * (1 - 1e-9)
    assert sorted(n for group in found for n in group.order) == list(range(6))


def test_equal_combines_are_split_into_neighbours():
    assert [group.order for group in assign_combines(EQUAL, 2)] == [(0, 1, 2), (3, 4, 5)]
    assert [group.order for group in assign_combines(EQUAL, 3)] == [(0, 1), (2, 3), (4, 5)]


def test_more_carts_than_combines_are_not_used():
    assert len(assign_combines(Fleet.equal(2, 100.0, 1.0, 12.0, 5.0), 4)) == 2


def test_many_combines_are_cut_into_pieces():
    found = assign_combines(Fleet.equal(16, 100.0, 1.0, 12.0, 1.0), 4)
    assert [len(group.order) for group in found] == [4, 4, 4, 4]


@pytest.mark.parametrize("carts", [0, -1])
def test_without_a_cart_nothing_is_served(carts):
    with pytest.raises(InvalidInput, match="`carts` must be at least 1"):
        assign_combines(EQUAL, carts)


def test_the_tour_is_the_shortest():
    # A square: crossing its diagonals is the longer way.
    ways = ((0.0, 14.0, 10.0, 10.0), (14.0, 0.0, 10.0, 10.0), (10.0, 10.0, 0.0, 14.0))
    fleet = Fleet((1.0,) * 4, (1.0,) * 4, (9.0,) * 4, (*ways, (10.0, 10.0, 14.0, 0.0)))
    tour = shortest_tour(fleet, (0, 1, 2, 3))
    assert tour_time(fleet, tour) == 40.0
    assert tour_time(fleet, (0, 1, 2, 3)) == 48.0


def test_rows_are_served_in_their_order_where_that_is_shortest():
    assert shortest_tour(MIXED, (0, 2, 3, 5)) == (0, 2, 3, 5)


@pytest.mark.parametrize("truck", [None, Truck(500.0, 5.0, 50.0, 1.0)], ids=["no truck", "truck"])
@pytest.mark.parametrize("fleet", [EQUAL, MIXED], ids=["equal", "mixed"])
def test_the_timetable_of_two_carts_serves_all(fleet, truck, check_timetable):
    answer = answer_schedule(fleet, 2, truck, fill=0.95)
    assert answer.feasible
    timetable = answer_timetable(answer, 5)
    check_timetable(fleet, timetable, rel=1e-6)
    assert {visit.combine for visit in timetable.visits} == set(range(6))
    # Every tank is as full as the plan says in every round, from the first.
    for cart in answer.carts:
        served = [visit for visit in timetable.visits if visit.combine == cart.group.order[0]]
        loads = {round(visit.load_at_start, 6) for visit in served}
        assert len(loads) <= cart.plan.round.size


def test_carts_with_one_period_take_turns():
    answer = answer_schedule(EQUAL, 2)
    periods = [cart.plan.period for cart in answer.carts]
    assert periods[0] == pytest.approx(periods[1])
    assert [cart.phase for cart in answer.carts] == pytest.approx([0, periods[0] / 2])


def test_remedies_are_those_of_the_closed_forms():
    each = EqualCombines(5, 100.0, 1.0, 12.0, 9.0)
    remedies = find_remedies(each.fleet())
    assert not forms.is_feasible(each)
    assert remedies.factors["travel_time"] == pytest.approx(forms.travel_time_max(each) / 9)
    assert remedies.factors["capacity"] == pytest.approx(forms.capacity_min(each) / 100)
    assert remedies.factors["fill_rate"] == pytest.approx(forms.fill_rate_max(each) / 1)
    assert remedies.factors["unload_rate"] == pytest.approx(forms.unload_rate_min(each) / 12)
    assert remedies.combines == forms.combines_feasible(each)
    assert remedies.carts == 2


def test_an_infeasible_schedule_says_why():
    too_many = answer_schedule(Fleet.equal(13, 100.0, 1.0, 12.0, 0.0))
    assert not too_many.feasible
    assert "unloading alone takes 1.083 of its time" in too_many.reasons[0]
    too_far = answer_schedule(Fleet.equal(3, 100.0, 1.0, 12.0, 25.0))
    assert "driving takes too long; it would have to take 0.8182" in too_far.reasons[0]
    too_rough = answer_schedule(EQUAL, jitter=10.0)
    assert "stand a jitter of 10" in too_rough.reasons[0]
    too_low = answer_schedule(EQUAL, fill=0.1)
    assert "0.1 of each tank is too little" in too_low.reasons[0]
    with pytest.raises(InvalidInput, match="`answer` must be feasible"):
        answer_timetable(too_far, 1)


def test_neighbours_stay_together_where_that_is_asked_for():
    free = assign_combines(MIXED, 2)
    kept = assign_combines(MIXED, 2, neighbours=True)
    assert sorted(n for group in kept for n in group.order) == list(range(6))
    assert all(max(group.order) - min(group.order) == len(group.order) - 1 for group in kept)
    assert min(g.travel_scale for g in kept) <= min(g.travel_scale for g in free) + 1e-9
