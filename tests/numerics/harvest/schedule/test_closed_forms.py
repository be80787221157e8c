"""The closed forms hold in a simulation that knows nothing of them."""

from dataclasses import replace

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.harvest.schedule import closed_forms as forms
from sightfield.systems.numerics.harvest.schedule.closed_forms import EqualCombines

TEAMS = range(2, 9)
RATES = [(100.0, 1.0, 12.0), (9000.0, 12.5, 130.0), (0.7, 0.31, 3.0)]


def equal(combines, travel_time, rates=RATES[0]):
    return EqualCombines(combines, *rates, travel_time)


def at_limit(combines, factor, rates=RATES[0]):
    """Combines whose travel time is a factor of the largest."""
    return equal(combines, factor * forms.travel_time_max(equal(combines, 0.0, rates)), rates)


def simulate(event_simulation, each, rounds):
    """From the thesis's start: the first is full, the others began (N - 1) dT ago."""
    back = (each.combines - 1) * each.travel_time
    wait = max(forms.waiting_time(each), 0.0)
    feasible = forms.is_feasible(each)
    middle = forms.first_waits(each) if feasible else (0.0,) * (each.combines - 2)
    return event_simulation(
        capacity=each.capacity,
        fill=each.fill_rate,
        unload=each.unload_rate,
        travel=[each.travel_time] * (each.combines - 1) + [back],
        wait=wait,
        first_wait=[wait, *middle, wait],
        loads=[each.capacity] + [each.fill_rate * back] * (each.combines - 1),
        rounds=rounds,
    )


@pytest.mark.parametrize("rates", RATES)
@pytest.mark.parametrize("combines", TEAMS)
def test_a_percent_below_the_limit_no_tank_overflows_for_a_hundred_rounds(
    event_simulation, combines, rates
):
    each = at_limit(combines, 0.99, rates)
    largest, _, _ = simulate(event_simulation, each, 100)
    assert forms.is_feasible(each)
    assert largest == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize("rates", RATES)
@pytest.mark.parametrize("combines", TEAMS)
def test_a_percent_above_the_limit_a_tank_overflows(event_simulation, combines, rates):
    each = at_limit(combines, 1.01, rates)
    largest, _, _ = simulate(event_simulation, each, 100)
    assert not forms.is_feasible(each)
    assert largest > 1.001


@pytest.mark.parametrize("combines", TEAMS)
def test_above_the_limit_empty_tanks_at_the_start_do_not_help(event_simulation, combines):
    each = at_limit(combines, 1.01)
    back = (each.combines - 1) * each.travel_time
    largest, _, _ = event_simulation(
        capacity=each.capacity,
        fill=each.fill_rate,
        unload=each.unload_rate,
        travel=[each.travel_time] * (combines - 1) + [back],
        wait=0.0,
        first_wait=[0.0] * combines,
        loads=[0.0] * combines,
        rounds=100,
    )
    assert largest > 1.001


@pytest.mark.parametrize("factor", [0.5, 0.99, 1.0])
@pytest.mark.parametrize("combines", TEAMS)
def test_first_loads_and_the_period_are_those_of_the_formulas(event_simulation, combines, factor):
    each = at_limit(combines, factor)
    _, starts, found = simulate(event_simulation, each, 20)
    assert found[0] == pytest.approx(forms.loads_at_start(each), rel=1e-9)
    assert found[1:] == pytest.approx(each.capacity, rel=1e-9)
    assert np.diff(starts, axis=0) == pytest.approx(forms.period(each), rel=1e-9)


@pytest.mark.parametrize("combines", TEAMS)
def test_a_cart_that_never_waits_settles_at_the_shortest_period(event_simulation, combines):
    each = at_limit(combines, 0.6)
    back = (each.combines - 1) * each.travel_time
    _, starts, found = event_simulation(
        capacity=each.capacity,
        fill=each.fill_rate,
        unload=each.unload_rate,
        travel=[each.travel_time] * (combines - 1) + [back],
        wait=0.0,
        first_wait=[0.0] * combines,
        loads=[0.0] * combines,
        rounds=200,
    )
    assert starts[-1] - starts[-2] == pytest.approx(forms.period_min(each), rel=1e-9)
    # Loads are to the tank as the travel time is to its limit.
    assert found[-1] == pytest.approx(0.6 * each.capacity, rel=1e-9)


def test_two_and_three_combines_are_those_of_the_thesis():
    r_u, r_f, capacity = 12.0, 1.0, 100.0
    two, three = equal(2, 0.0), equal(3, 0.0)
    limit_2 = (r_u - 2 * r_f) * capacity / (2 * r_f * (r_u - r_f))
    limit_3 = (r_u - 3 * r_f) * capacity / (4 * r_f * (r_u - r_f))
    assert forms.travel_time_max(two) == pytest.approx(limit_2)  # (3.1)
    assert forms.travel_time_max(three) == pytest.approx(limit_3)  # (3.7)
    load = (3 * r_u - 5 * r_f) * capacity / (4 * (r_u - r_f))
    assert forms.loads_at_start(at_limit(3, 1.0))[1] == pytest.approx(load)  # (3.6)


@pytest.mark.parametrize("combines", range(3, 9))
def test_first_waits_obey_the_thesiss_second_expression_with_the_sign_corrected(combines):
    # t'_n = C'_(n+1) / r_f - dT - C'_n / (r_u - r_f) - C'_n / r_f; (3.5) prints "=" for a minus.
    each = at_limit(combines, 0.8)
    loads = np.array(forms.loads_at_start(each))[1:]
    net = each.unload_rate - each.fill_rate
    waits = np.diff(loads) / each.fill_rate - each.travel_time - loads[:-1] / net
    assert forms.first_waits(each) == pytest.approx(waits)


def test_the_sum_of_waits_vanishes_at_the_limit_and_is_positive_below():
    assert forms.waiting_sum(at_limit(5, 1.0)) == pytest.approx(0, abs=1e-9)
    assert forms.waiting_sum(at_limit(5, 0.9)) > 0


def test_the_most_combines_leave_no_time_to_drive():
    assert forms.combines_max(1.0, 12.0) == 12
    assert forms.combines_max(0.1, 0.3) == 3  # whose quotient is rounded down to 2.99...96
    assert forms.travel_time_max(equal(12, 0.0)) == pytest.approx(0, abs=1e-12)
    assert forms.travel_time_max(equal(13, 0.0)) < 0
    assert forms.is_feasible(equal(12, 0.0))
    assert not forms.is_feasible(equal(13, 0.0))


def test_one_combine_has_no_limit():
    one = equal(1, 1e6)
    assert forms.is_feasible(one)
    assert forms.travel_time_max(one) == np.inf
    assert forms.loads_at_start(one) == (100.0,)
    assert forms.period(one) == pytest.approx(100 / 1 + 100 / 11)


@pytest.mark.parametrize(
    ("change", "limit"),
    [
        ("capacity", forms.capacity_min),
        ("unload_rate", forms.unload_rate_min),
        ("fill_rate", forms.fill_rate_max),
        ("travel_time", forms.travel_time_max),
        ("combines", forms.combines_feasible),
    ],
)
@pytest.mark.parametrize("travel_time", [4.0, 9.0, 12.0])
def test_each_change_is_just_enough(change, limit, travel_time):
    each = equal(5, travel_time)
    bound = limit(each)
    worse = -1 if change in ("capacity", "unload_rate") else 1
    if change == "combines":
        assert forms.is_feasible(replace(each, combines=bound))
        assert not forms.is_feasible(replace(each, combines=bound + 1))
    else:
        assert forms.is_feasible(replace(each, **{change: bound * (1 - worse * 1e-9)}))
        assert not forms.is_feasible(replace(each, **{change: bound * (1 + worse * 1e-6)}))


def test_no_unload_rate_makes_up_for_driving_that_fills_a_tank():
    assert forms.unload_rate_min(equal(3, 25.0)) == np.inf


@pytest.mark.parametrize("combines", [2, 3, 6])
def test_the_largest_jitter_is_what_a_cart_that_never_waits_stands(event_simulation, combines):
    each = at_limit(combines, 0.7)
    back = (combines - 1) * each.travel_time
    for factor, stands in ((0.999, True), (1.001, False)):
        slower = (1 + forms.jitter_max(each)) * factor
        net = (each.unload_rate - each.fill_rate) / slower
        largest, _, _ = event_simulation(
            capacity=each.capacity,
            fill=each.fill_rate,
            unload=each.fill_rate + net,
            travel=[slower * each.travel_time] * (combines - 1) + [slower * back],
            wait=0.0,
            first_wait=[0.0] * combines,
            loads=[0.0] * combines,
            rounds=300,
        )
        assert (largest <= 1) == stands


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((0, 100.0, 1.0, 12.0, 1.0), "`combines` must be at least 1; got 0"),
        ((2.5, 100.0, 1.0, 12.0, 1.0), "`combines` must be a whole number"),
        ((3, 0.0, 1.0, 12.0, 1.0), "`capacity` must be positive; got 0.0"),
        ((3, 100.0, -1.0, 12.0, 1.0), "`fill_rate` must be positive"),
        ((3, 100.0, 2.0, 2.0, 1.0), "`unload_rate` must exceed the fill rate"),
        ((3, 100.0, 1.0, float("nan"), 1.0), "`unload_rate` must be a finite number"),
        ((3, 100.0, 1.0, 12.0, -1.0), "`travel_time` must be zero or positive"),
    ],
)
def test_absurd_inputs_are_refused(arguments, message):
    with pytest.raises(InvalidInput, match=message):
        EqualCombines(*arguments)


def test_augers_that_just_keep_up_leave_no_time_to_drive():
    # Five combines at a fifth of what an auger delivers take all of the cart's time.
    just, over = EqualCombines(5, 100.0, 2.0, 10.0, 0.0), EqualCombines(5, 100.0, 2.0, 9.9, 0.0)
    assert forms.period_min(just) == 0.0
    assert forms.capacity_min(just) == 0.0
    assert forms.capacity_min(over) == np.inf
    assert forms.is_feasible(just)
    assert not forms.is_feasible(over)
    driving = replace(just, travel_time=1e-6)
    assert forms.period_min(driving) == np.inf
    assert forms.capacity_min(driving) == np.inf
    assert forms.combines_max(2.0, 10.0) == 5
    assert forms.combines_max(2.0, 9.9) == 4
    with pytest.raises(InvalidInput, match="`fill_rate` must be comparable"):
        forms.combines_max(1e-300, 1e300)


def test_ways_that_just_fill_a_tank_leave_nothing_to_any_auger():
    assert forms.unload_rate_min(EqualCombines(2, 100.0, 2.0, 10.0, 25.0)) == np.inf
    barely = forms.unload_rate_min(EqualCombines(2, 100.0, 2.0, 10.0, 24.9))
    assert barely == pytest.approx(2.0 * (1 + 100 / 0.4))
    assert forms.jitter_max(EqualCombines(1, 100.0, 2.0, 10.0, 3.0)) == np.inf
    assert forms.jitter_max(EqualCombines(2, 100.0, 2.0, 10.0, 0.0)) == pytest.approx(3.0)


def test_the_limit_of_ways_is_allowed_but_for_rounding():
    limit = forms.travel_time_max(equal(4, 0.0))
    slack = 1e-12 * equal(4, 0.0).filling
    assert forms.is_feasible(equal(4, limit + 0.9 * slack))
    assert not forms.is_feasible(equal(4, limit + 1.2 * slack))


@pytest.mark.parametrize("combines", [1, 2, 6])
def test_the_largest_fill_rate_solves_its_equation(combines):
    each = EqualCombines(combines, 9_300.0, 2.7, 118.0, 14.3)
    rate, a = forms.fill_rate_max(each), 2 * (combines - 1) * 14.3
    left = a * rate**2 - (combines * 9_300.0 + a * 118.0) * rate + 9_300.0 * 118.0
    assert left == pytest.approx(0.0, abs=1e-6)
    assert rate <= 118.0 / combines * (1 + 1e-12)


@pytest.mark.parametrize("travel_time", [15.0, 21.2, 26.8, 44.9])
def test_a_cart_that_is_just_busy_all_the_time_is_enough(travel_time):
    """In spite of rounding: each combine is full again as the cart comes back to it."""
    emptying, others = 30.1, 7
    filling = others * (2 * travel_time + emptying)
    rate = 9000.0 / filling
    just = EqualCombines(2, 9000.0, rate, rate + 9000.0 / emptying, travel_time)
    assert forms.combines_feasible(just) == 1 + others
