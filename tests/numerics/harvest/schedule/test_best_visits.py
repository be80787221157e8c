"""Visits in any order: never worse than any word, and certain where they say so."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from sightfield.systems.numerics.harvest.schedule import closed_forms as forms
from sightfield.systems.numerics.harvest.schedule.answer import (
    Holds,
    answer_schedule,
    answer_timetable,
)
from sightfield.systems.numerics.harvest.schedule.best_visits import (
    Outcome,
    best_visits,
    find_visits,
    visits_that_serve,
)
from sightfield.systems.numerics.harvest.schedule.closed_forms import EqualCombines
from sightfield.systems.numerics.harvest.schedule.fleet import Fleet, Truck, line_of
from sightfield.systems.numerics.harvest.schedule.limits import certain_limit, is_excluded

# One combine of four fills its small tank in 300 s, the others theirs in 1500 s.
HURRIED = Fleet(
    capacities=(12_000.0, 6_000.0, 12_000.0, 12_000.0),
    fill_rates=(8.0, 20.0, 8.0, 8.0),
    unload_rates=(150.0,) * 4,
    travel_times=line_of((50.0,) * 3),
)


def slower(fleet, factor):
    """The same with longer ways."""
    rows = tuple(tuple(factor * way for way in row) for row in fleet.travel_times)
    return Fleet(fleet.capacities, fleet.fill_rates, fleet.unload_rates, rows)


def largest_load(fleet, word, rounds, enough=1e3):
    """The fullest that any tank gets, as a part of it: a cart follows a word from empty tanks.

    It shares nothing with the package: all tanks are advanced from event to event, until one holds
    more than is enough.
    """
    capacities, fill = np.array(fleet.capacities), np.array(fleet.fill_rates)
    loads, here, largest = np.zeros(fleet.size), word[-1], 0.0
    for there in word * rounds:
        loads = loads + fill * fleet.travel_times[here][there]
        largest = max(largest, (loads / capacities).max())
        stay = loads[there] / (fleet.unload_rates[there] - fill[there])
        loads = loads + fill * stay
        loads[there] = 0.0
        largest = max(largest, (loads / capacities).max())
        if largest > enough:
            break
        here = there
    return largest


def limit_of_word(fleet, word):
    """The factor on all ways with which a word fills a tank to the brim, by its fixed point.

    Loads grow in proportion to the ways, so that one run says it.
    """
    largest = largest_load(fleet, word, 60)
    return 1.0 / largest if largest > 0 else math.inf


def words(combines, most):
    """Words of visits to all of some combines, none twice in a row, up to rotation."""
    for size in range(combines, most + 1):
        for tail in itertools.product(range(combines), repeat=size - 1):
            word = (0, *tail)
            if len(set(word)) < combines or any(a == b for a, b in itertools.pairwise((*word, 0))):
                continue
            if word == min(word[k:] + word[:k] for k in range(size) if word[k] == 0):
                yield word


@st.composite
def fleets(draw, most=3):
    """Combines of all sorts at random places, which one cart has time to unload."""
    count = draw(st.integers(2, most))
    seed = draw(st.integers(0, 10_000))
    rng = np.random.default_rng(seed)
    unload = rng.uniform(80.0, 200.0, count)
    shares = rng.uniform(0.05, 1.0, count)
    shares *= rng.uniform(0.2, 0.9) / shares.sum()
    places = rng.uniform(0.0, 100.0, (count, 2))
    ways = np.hypot(*(places[:, None] - places).transpose(2, 0, 1))
    return Fleet(
        tuple(rng.uniform(3_000.0, 12_000.0, count).tolist()),
        tuple((shares * unload).tolist()),
        tuple(unload.tolist()),
        tuple(map(tuple, ways.tolist())),
    )


def test_a_combine_in_a_hurry_is_visited_more_than_once_a_round():
    # One visit a round ends at 40.8 s, as (3.10) would have it for the one in a hurry.
    best = best_visits(HURRIED, (0, 1, 2, 3))
    assert best.round.combines.count(1) > 1
    assert largest_load(HURRIED, (0, 1, 2, 3, 1), 400) < 0.82
    assert 50 * best.scale >= 50 * limit_of_word(HURRIED, (0, 1, 2, 3, 1)) > 61.15
    # And no order at all reaches a thousandth further.
    assert best.bound == pytest.approx(best.scale, rel=2e-3)
    answer = answer_schedule(HURRIED)
    assert answer.feasible
    timetable = answer_timetable(answer, 100)
    assert not timetable.overflows
    assert max(line.loads.max() for line in timetable.tanks) <= 12_000 * (1 + 1e-9)


@settings(max_examples=15)
@given(fleet=fleets())
def test_no_word_of_twice_the_combines_is_better(fleet):
    order = tuple(range(fleet.size))
    best = best_visits(fleet, order)
    limits = {word: limit_of_word(fleet, word) for word in words(fleet.size, 2 * fleet.size)}
    longest = max(limits.values())
    assert best.scale >= longest * (1 - 1e-3)
    assert longest <= best.bound * (1 + 1e-6)
    # The search through all orders comes to one as good by itself.
    assert find_visits(fleet, order, longest * (1 - 1e-3))[1] is Outcome.FOUND
    assert best.bound < math.inf
    assert certain_limit(fleet, 1) >= best.scale * (1 - 1e-6)


@settings(max_examples=15)
@given(fleet=fleets(4), seed=st.integers(0, 10_000))
def test_beyond_the_bound_every_order_of_visits_lets_a_tank_run_over(fleet, seed):
    bound = best_visits(fleet, tuple(range(fleet.size))).bound
    # Of a search that was given up nothing is said.
    assume(bound < math.inf)
    late = slower(fleet, 1.001 * bound)
    assert find_visits(late, tuple(range(fleet.size)))[1] is Outcome.NONE
    rng = np.random.default_rng(seed)
    for _ in range(50):
        word = tuple(rng.integers(0, fleet.size, rng.integers(fleet.size, 16)).tolist())
        if len(set(word)) == fleet.size:
            assert largest_load(late, word, 100, enough=1.0) > 1


@settings(max_examples=8)
@given(fleet=fleets(4))
def test_what_is_feasible_runs_for_ever(fleet):
    best = best_visits(fleet, tuple(range(fleet.size)))
    answer = answer_schedule(slower(fleet, 0.995 * best.scale))
    assert answer.feasible
    timetable = answer_timetable(answer, 400)
    assert not timetable.overflows
    for line, capacity in zip(timetable.tanks, fleet.capacities, strict=True):
        assert line.loads.max() <= capacity * (1 + 1e-6)


@pytest.mark.parametrize("combines", range(2, 7))
def test_for_equal_combines_no_order_beats_the_thesis(combines):
    # (3.10) was for one visit a round; the search goes through all orders.
    limit = forms.travel_time_max(EqualCombines(combines, 9_000.0, 8.0, 150.0, 0.0))
    fleet = Fleet.equal(combines, 9_000.0, 8.0, 150.0, 1.001 * limit)
    assert find_visits(fleet, tuple(range(combines)))[1] is Outcome.NONE
    assert best_visits(fleet, tuple(range(combines))).scale == pytest.approx(1 / 1.001)


CHANGES = {
    "capacity": lambda fleet, truck: (
        Fleet(
            tuple(1.1 * each for each in fleet.capacities),
            fleet.fill_rates,
            fleet.unload_rates,
            fleet.travel_times,
        ),
        truck,
    ),
    "unload rate": lambda fleet, truck: (
        Fleet(
            fleet.capacities,
            fleet.fill_rates,
            tuple(1.1 * each for each in fleet.unload_rates),
            fleet.travel_times,
        ),
        truck,
    ),
    "ways": lambda fleet, truck: (slower(fleet, 0.9), truck),
    "cart": lambda fleet, truck: (
        fleet,
        truck and Truck(1.1 * truck.cart_capacity, truck.travel_time),
    ),
    "truck": lambda fleet, truck: (
        fleet,
        truck and Truck(truck.cart_capacity, 0.9 * truck.travel_time),
    ),
    "no truck": lambda fleet, _truck: (fleet, None),
}


@settings(max_examples=5)
@given(fleet=fleets(), room=st.floats(1.0, 6.0), away=st.floats(0.0, 3.0))
@pytest.mark.parametrize("change", CHANGES)
def test_more_never_makes_it_worse(change, fleet, room, away):
    truck = Truck(room * max(fleet.capacities), away * max(map(max, fleet.travel_times)))
    before = answer_schedule(fleet, 1, truck)
    after = answer_schedule(*_with_carts(CHANGES[change](fleet, truck), 1))
    another = answer_schedule(fleet, 2, truck)
    assert after.travel_scale >= before.travel_scale * (1 - 2e-3)
    assert another.travel_scale >= before.travel_scale * (1 - 2e-3)


# A cart that is often full leaves some grain behind. At half a per cent below what its ways allow,
# what it took too much of one combine it lacked for the next, more so from round to round, until a
# tank ran over after 30 rounds, and after 80.
SHORT_OF_ROOM = [
    (
        Fleet(
            (3_863.0, 9_750.6), (9.3644, 78.939), (98.454, 153.38), ((0.0, 8.7416), (8.7416, 0.0))
        ),
        Truck(20_281.0, 61.57, 593.32, 25.133),
    ),
    (
        Fleet(
            (9_489.3, 4_896.2, 7_138.7, 4_259.2),
            (26.712, 25.102, 12.071, 14.86),
            (115.48, 107.86, 120.84, 139.84),
            (
                (0.0, 26.115, 43.83, 37.982),
                (26.115, 0.0, 18.097, 37.356),
                (43.83, 18.097, 0.0, 42.535),
                (37.982, 37.356, 42.535, 0.0),
            ),
        ),
        Truck(12_956.0, 6.8737, 593.23, 11.422),
    ),
]


@pytest.mark.parametrize(("fleet", "truck"), SHORT_OF_ROOM)
def test_a_cart_that_leaves_grain_behind_goes_on_for_ever(fleet, truck):
    factor = 0.995 * answer_schedule(fleet, 1, truck).travel_scale
    nearer = replace(truck, travel_time=factor * truck.travel_time)
    answer = answer_schedule(slower(fleet, factor), 1, nearer)
    assert max(answer.plans[0].left_over) > 500
    timetable = answer_timetable(answer, 400)
    assert not timetable.overflows
    assert max(line.loads.max() for line in timetable.carts) <= truck.cart_capacity * (1 + 1e-9)


def test_rounding_makes_no_cart_late_whose_combines_cut_nearly_what_augers_deliver():
    # Each second of delay is nine more beside the combine; a tank ran over after 13 rounds.
    fleet = Fleet(
        (8_726.4, 4_947.1), (93.037, 28.705), (103.375, 180.687), ((0.0, 19.0), (19.0, 0.0))
    )
    truck = Truck(34_030.0, 48.9, 221.27, 10.363)
    factor = 0.995 * answer_schedule(fleet, 2, truck).travel_scale
    nearer = replace(truck, travel_time=factor * truck.travel_time)
    answer = answer_schedule(slower(fleet, factor), 2, nearer)
    assert {cart.group.carts for cart in answer.carts} == {2}
    timetable = answer_timetable(answer, 400)
    assert not timetable.overflows
    starts = [visit.start_unloading for visit in timetable.of_cart(0)]
    period = answer.plans[0].period
    np.testing.assert_allclose(np.diff(starts[::2]), period, rtol=1e-6)


def test_a_quicker_truck_never_makes_what_carts_could_do_less():
    # As it is two carts follow one another. With a truck quicker by a tenth each has combines of
    # its own: that is enough, though not all that they could do.
    fleet = Fleet(
        (10_569.0, 11_104.0, 7_415.4),
        (25.487, 24.297, 25.195),
        (138.66, 88.952, 184.08),
        ((0.0, 39.594, 37.744), (39.594, 0.0, 76.339), (37.744, 76.339, 0.0)),
    )
    answers = [
        answer_schedule(fleet, 2, Truck(17_957.0, 42.384, rate, 19.224))
        for rate in (174.98, 183.73, 192.48)
    ]
    scales = [answer.travel_scale for answer in answers]
    assert all(more >= less for less, more in itertools.pairwise(scales))
    assert [answer.carts[0].group.carts for answer in answers] == [2, 2, 1]


def test_carts_that_share_combines_drive_by_the_truck_after_whichever_visits_are_best():
    # Whichever way round the tour is told: a trip after its last visit was taken for granted.
    places = np.array([[0.0, 0.0], [90.0, 5.0], [80.0, 60.0], [10.0, 70.0]])
    ways = np.hypot(*(places[:, None] - places).transpose(2, 0, 1))
    fleet = Fleet(
        (8_000.0, 5_000.0, 9_000.0, 6_000.0),
        (30.0, 12.0, 26.0, 9.0),
        (120.0, 110.0, 150.0, 130.0),
        tuple(map(tuple, ways.tolist())),
    )
    truck = Truck(14_000.0, 20.0, 300.0, 10.0)
    scales = [
        best_visits(fleet, order, truck, 2).scale
        for turn in range(4)
        for way in (1, -1)
        for order in [tuple(np.roll((0, 1, 2, 3), turn)[::way].tolist())]
    ]
    assert min(scales) > 0
    assert scales == pytest.approx([scales[0]] * 8, rel=1e-6)


def _with_carts(changed, carts):
    fleet, truck = changed
    return fleet, carts, truck


@pytest.mark.parametrize("room", [100.0, 12_000.0, 36_000.0, 1e9])
def test_a_cart_of_finite_room_is_never_better_than_one_that_holds_all(room):
    fleet = Fleet.equal(4, 9_000.0, 20.0, 150.0, 60.0)
    assert visits_that_serve(fleet, (0, 1, 2, 3), None) is None
    for away in (0.0, 60.0, 200.0):
        assert visits_that_serve(fleet, (0, 1, 2, 3), Truck(room, away)) is None


def test_carts_that_follow_one_another_serve_what_no_split_does():
    fleet = Fleet.equal(6, 9_000.0, 20.0, 150.0, 60.0)
    truck = Truck(20_000.0, 225.0)
    answer = answer_schedule(fleet, 4, truck)
    assert answer.feasible
    assert {cart.group.carts for cart in answer.carts} == {4}
    assert [cart.phase for cart in answer.carts] == pytest.approx(
        [k / 4 * answer.carts[0].plan.period for k in range(4)]
    )
    timetable = answer_timetable(answer, 300)
    assert not timetable.overflows
    assert max(line.loads.max() for line in timetable.carts) <= 20_000 * (1 + 1e-6)
    # Nobody unloads two carts at once.
    for n in range(6):
        visits = [visit for visit in timetable.visits if visit.combine == n]
        assert {visit.cart for visit in visits} == set(range(4))
        for here, there in itertools.pairwise(visits):
            assert there.start_unloading >= here.leave - 1e-6


@settings(max_examples=8)
@given(fleet=fleets(4), carts=st.integers(1, 3), room=st.floats(1.0, 6.0))
@example(fleet=HURRIED, carts=1, room=2.0)
def test_no_answer_is_better_than_what_is_certain(fleet, carts, room):
    truck = Truck(room * max(fleet.capacities), 40.0, 300.0, 5.0)
    for each in (None, truck):
        answer = answer_schedule(fleet, carts, each)
        assert answer.travel_scale <= certain_limit(fleet, carts, each) * (1 + 1e-6)
        assert not (answer.feasible and is_excluded(fleet, carts, each))


def test_certificates_say_for_whom_they_hold():
    too_slow = answer_schedule(Fleet.equal(13, 100.0, 1.0, 12.0, 0.0)).certificate
    assert (too_slow.resource, too_slow.limit, too_slow.holds) == ("unload_rate", 0.0, Holds.ANY)
    too_far = answer_schedule(Fleet.equal(3, 100.0, 1.0, 12.0, 25.0)).certificate
    assert too_far.resource == "travel_time"
    assert too_far.holds in (Holds.ANY, Holds.ORDERS)
    assert 900 / 44 / 25 <= too_far.limit < 1
    close = answer_schedule(slower(HURRIED, 70 / 50)).certificate
    assert close.holds is Holds.ORDERS
    assert 70 * close.limit == pytest.approx(67.4, abs=0.1)
    assert "for every order of visits" in close.says
    assert answer_schedule(HURRIED).certificate is None
