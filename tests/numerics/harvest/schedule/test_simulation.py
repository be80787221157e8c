"""Jitter: what is promised is stood, whatever the times are within it."""

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.harvest.schedule import closed_forms as forms
from sightfield.systems.numerics.harvest.schedule.closed_forms import EqualCombines
from sightfield.systems.numerics.harvest.schedule.fleet import (
    Fleet,
    Truck,
    round_of,
    sequential_round,
)
from sightfield.systems.numerics.harvest.schedule.periodic_plan import Aim, plan_round
from sightfield.systems.numerics.harvest.schedule.simulation import (
    CartRun,
    first_run,
    jitter_limit,
    plan_for_jitter,
    plan_jitter,
    plan_timetable,
    simulate_schedule,
)

EQUAL = EqualCombines(4, 100.0, 1.0, 12.0, 8.0)
MIXED = Fleet(
    capacities=(80.0, 100.0, 140.0),
    fill_rates=(1.0, 0.8, 1.5),
    unload_rates=(10.0, 12.0, 11.0),
    travel_times=((0.0, 6.0, 9.0), (6.0, 0.0, 4.0), (9.0, 4.0, 0.0)),
)
FLEETS = pytest.mark.parametrize("fleet", [EQUAL.fleet(), MIXED], ids=["equal", "mixed"])


def shaken(plan, jitter, generator, rounds=60):
    """A timetable whose ways and emptyings take as long as chance will have it."""
    run, begins = first_run(plan)
    size = rounds * plan.round.size
    worst = generator.random() < 0.5
    # Half of the runs use nothing but the two ends.
    draw = (lambda: generator.choice([-jitter, jitter], size)) if worst else (
        lambda: generator.uniform(-jitter, jitter, size)
    )  # fmt: skip
    run = CartRun(run.round, run.first_start, run.plan, 1 + draw(), 1 + draw())
    return simulate_schedule(plan.fleet, run, rounds, start_times=begins)


def test_the_largest_jitter_of_equal_combines_is_the_closed_form():
    round_ = sequential_round(EQUAL.fleet())
    assert jitter_limit(EQUAL.fleet(), round_) == pytest.approx(forms.jitter_max(EQUAL), rel=1e-9)


@FLEETS
def test_a_cart_that_never_waits_stands_the_limit_and_no_more(fleet):
    round_ = sequential_round(fleet)
    limit = jitter_limit(fleet, round_)
    for part, stands in ((0.999, True), (1.001, False)):
        slower = (1 + limit) * part
        run = CartRun(round_, travel_factors=slower, unload_factors=slower)
        assert (not simulate_schedule(fleet, run, 300).overflows) == stands


def test_full_tanks_stand_no_jitter():
    plan = plan_round(EQUAL.fleet(), sequential_round(EQUAL.fleet()))
    assert plan_jitter(plan) == pytest.approx(0, abs=1e-7)
    run = CartRun(plan.round, plan=plan, travel_factors=1.001)
    begins = plan.stagger
    assert simulate_schedule(plan.fleet, run, 3, start_times=begins).overflows


@FLEETS
def test_the_plan_of_the_shortest_period_stands_all_that_can_be_stood(fleet):
    round_ = sequential_round(fleet)
    early = plan_round(fleet, round_, aim=Aim.EARLY)
    assert plan_jitter(early) == pytest.approx(jitter_limit(fleet, round_), rel=1e-5)


@FLEETS
@pytest.mark.parametrize("part", [0.2, 0.6, 0.95])
def test_a_plan_for_a_jitter_stands_it(fleet, part):
    round_ = sequential_round(fleet)
    jitter = part * jitter_limit(fleet, round_)
    plan = plan_for_jitter(fleet, round_, jitter)
    assert plan_jitter(plan) >= jitter * (1 - 1e-8)
    generator = np.random.default_rng(5)
    for _ in range(20):
        assert not shaken(plan, min(jitter, 0.99), generator).overflows


@FLEETS
def test_a_plan_for_a_jitter_drives_no_more_than_it_has_to(fleet):
    round_ = sequential_round(fleet)
    jitter = 0.3 * jitter_limit(fleet, round_)
    plan = plan_for_jitter(fleet, round_, jitter)
    longer = plan_round(fleet, round_, fill=1.0, period=plan.period * 1.02)
    assert plan_jitter(longer) < jitter


def test_beyond_the_limit_there_is_no_plan():
    round_ = sequential_round(MIXED)
    assert plan_for_jitter(MIXED, round_, jitter_limit(MIXED, round_) * 1.01) is None


def test_with_a_truck_the_promise_holds_too():
    truck = Truck(cart_capacity=900.0, travel_time=10.0, unload_rate=60.0, stop_time=5.0)
    round_ = sequential_round(MIXED, truck=truck)
    plan = plan_for_jitter(MIXED, round_, 0.1)
    generator = np.random.default_rng(6)
    for _ in range(20):
        assert not shaken(plan, 0.1, generator).overflows


def test_a_full_cart_goes_by_the_truck_when_planned_where_it_takes_nothing_more():
    """The last visit before the truck takes nothing: the cart is full after the one before it."""
    fleet = Fleet(
        (9281.0, 5298.0, 3834.0, 6610.0),
        (10.7, 17.4, 20.3, 5.4),
        (120.0, 107.0, 121.0, 168.0),
        ((0, 26.3, 1.1, 33.0), (26.3, 0, 25.8, 53.4), (1.1, 25.8, 0, 34.1), (33.0, 53.4, 34.1, 0)),
    )
    visits = (0, 2, 1, 0, 2, 2, 1, 2, 0, 2, 3, 2, 1, 2, 0)
    trips = tuple(visit in (4, 6, 14) for visit in range(len(visits)))
    round_ = round_of(fleet, visits, trips, Truck(24975.0, 10.16, 244.8, 28.7))
    plan = plan_round(fleet, round_)
    assert plan is not None
    assert any(trip and taken < 1e-6 for trip, taken in zip(trips, plan.taken, strict=True))
    timetable = plan_timetable(plan, 40)
    assert not timetable.overflows


@pytest.mark.parametrize("told", [{"initial_loads": (1.0, 2.0)}, {"start_times": (1.0,) * 4}])
def test_loads_and_starts_are_those_of_all_combines(told):
    plan = plan_round(MIXED, sequential_round(MIXED))
    (name,) = told
    with pytest.raises(InvalidInput, match=f"`{name}` must have 3 entries"):
        first_run(plan, **told)
