"""Whole plans of carts, audited by outlines, with grain counted."""

import gc
import weakref

import numpy as np
import pytest

from sightfield.systems.numerics.errors import NoPlan
from sightfield.systems.numerics.harvest.carts import service, visits
from sightfield.systems.numerics.harvest.carts.cart_plan import Supply
from sightfield.systems.numerics.harvest.carts.cut_times import CELL, cut_times
from sightfield.systems.numerics.harvest.carts.surroundings import is_in_reach
from sightfield.systems.numerics.harvest.carts.visits import serve_combines
from sightfield.systems.numerics.harvest.carts.windows import beside
from sightfield.systems.numerics.harvest.machines import STANDING, Cart, Combine, is_alongside

TRUCKS = np.array([[60.0, -13.0, 0.1], [120.0, -14.0, 0.0]])


@pytest.mark.parametrize(
    ("combines", "carts", "density", "capacity", "hitch", "stops"),
    [
        (1, 1, 0.9, np.inf, 0.0, 0),
        (2, 1, 1.1, 20000.0, 0.6, 1),
        (2, 2, 1.6, 25000.0, 0.0, 1),
    ],
)
def test_all_grain_comes_to_the_trucks(
    hand_made, audit, combines, carts, density, capacity, hitch, stops
):
    made = hand_made(198.0, 140.0, combines)
    cart = Cart(capacity=capacity, hitch_offset=hitch)
    supply = Supply(density=density, trucks=TRUCKS[:carts])
    shares: list[float] = []
    plan = serve_combines(
        made.field,
        [made.combine] * len(made.plans),
        cart,
        made.plans,
        made.swaths,
        supply,
        made.retime,
        progress=shares.append,
    )
    # It is told how far the plan has come.
    assert shares[-1] == 1.0
    assert sum(0.0 < share < 1.0 for share in shares) >= 3
    cut = cut_times(made.field, made.combine, plan.plans)
    grain = density * CELL**2 * (cut.cutter >= 0).sum()
    assert plan.left == pytest.approx(0.0, abs=2.0 * combines)
    assert sum(trip.delivered for trip in plan.trips) == pytest.approx(grain, abs=2.0 * combines)
    assert sum(visit.taken for visit in plan.visits) == pytest.approx(grain, abs=2.0 * combines)
    assert len(plan.stops) <= stops
    reach = made.combine.header_width / 2 + made.combine.cart_gap + cart.width / 2
    for number, own in enumerate(plan.plans):
        # No tank runs over: what was cut until then, less what was taken.
        at = np.arange(0.0, own.end, 2.0)
        moments = np.sort(cut.times[cut.cutter == number])
        load = density * CELL**2 * np.searchsorted(moments, at)
        for visit in plan.visits:
            if visit.combine == number:
                share = np.clip((at - visit.begin) / (visit.end - visit.begin), 0, 1)
                load = load - share * visit.taken
        assert load.max() <= made.combine.capacity + 60.0
        assert load.min() >= -60.0
    for visit in plan.visits:
        times = np.linspace(visit.begin, visit.end, 9)
        _, trailer = plan.motions[visit.cart].poses_at(times)
        middle = trailer[:, :2] + 0.15 * cart.length * np.stack(
            [np.cos(trailer[:, 2]), np.sin(trailer[:, 2])], axis=1
        )
        poses = plan.plans[visit.combine].pose_at(times)
        moves = plan.plans[visit.combine].speed_at(times).max() > 0
        away = np.hypot(*(middle - poses[:, :2]).T)
        assert away.max() < (reach + 0.6 if moves else STANDING * reach)
        assert (visit.taken / (visit.end - visit.begin)) < made.combine.unload_rate * 1.05 + 10.0
    for trip in plan.trips:
        pose = plan.motions[trip.cart].timed.pose_at(np.array([trip.begin, trip.end]))
        assert np.abs(pose[:, :2] - TRUCKS[trip.cart, :2]).max() < 1e-6
    found = audit(made.field, made.combine, cart, plan.plans, plan.motions)
    assert found.combine_gap >= 0.5
    assert found.cart_gap >= 0.5
    assert found.crop < 0.05
    assert found.outside == 0.0
    # With a reserve, so that no log has to be let off anything.
    assert found.along <= 0.97 * cart.acceleration + 1e-6
    assert found.across <= 0.97 * cart.lateral_acceleration + 1e-6
    assert found.curvature <= 1 / cart.turning_radius + 1e-9


@pytest.mark.parametrize("bent", [-0.7, 0.0, 0.3])
def test_what_is_surely_in_reach_of_a_standing_combine_is_alongside(bent):
    combine, cart = Combine(), Cart()
    pose, reach = np.array([12.3, -4.5, 0.7]), beside(combine, cart).left
    random = np.random.default_rng(8)
    found = []
    for _ in range(400):
        state = np.array([*(pose[:2] + random.uniform(-25, 25, 2)), random.uniform(-4, 4), bent])
        sure = is_in_reach(combine, cart, pose, state)
        found.append(sure)
        nudged = state + np.array([*random.uniform(-0.1, 0.1, 2), 0.0, 0.0])
        if sure:
            assert is_alongside(pose, nudged, cart.length, cart.hitch_offset, reach, True)
    assert 20 < sum(found) < 380


def served_both_ways(made, density, strategy, kinds=("greedy", "revised")):
    """What carts do where nothing is given up for others, and where it is."""
    supply = Supply(density=density, trucks=TRUCKS[:1])
    pair = [made.combine] * len(made.plans)
    return [
        serve_combines(
            *(made.field, pair, Cart(), made.plans, made.swaths, supply, made.retime),
            strategy=strategy,
            visits=kind,
        )
        for kind in kinds
    ]


def test_visits_are_given_up_for_others_where_somebody_would_have_to_wait(hand_made, audit):
    made = hand_made(162.0, 120.0, 2)
    greedy, revised = served_both_ways(made, 1.7, "on-demand")
    assert len(greedy.stops) == 1
    assert revised.stops == []
    assert max(plan.end for plan in revised.plans) < max(plan.end for plan in greedy.plans) - 60.0
    taken = [sum(visit.taken for visit in plan.visits) for plan in (greedy, revised)]
    assert taken[1] == pytest.approx(taken[0], abs=2.0)
    found = audit(made.field, made.combine, Cart(), revised.plans, revised.motions)
    assert min(found.combine_gap, found.cart_gap) >= 0.5
    assert found.crop < 0.05


def test_who_has_to_wait_anyway_waits_no_longer(hand_made):
    greedy, revised = served_both_ways(hand_made(198.0, 140.0, 2), 1.9, "sequential")
    assert greedy.stops
    waits = [sum(stop.duration for stop in plan.stops) for plan in (greedy, revised)]
    assert waits[1] <= waits[0]


def test_where_somebody_has_to_wait_that_is_chosen_of_which_all_wait_least(hand_made, audit):
    made = hand_made(216.0, 140.0, 3)
    greedy, revised = served_both_ways(made, 2.6, "on-demand")
    waits = [sum(stop.duration for stop in plan.stops) for plan in (greedy, revised)]
    assert revised.stops
    assert len(revised.stops) < len(greedy.stops)
    assert waits[1] < 0.5 * waits[0]
    found = audit(made.field, made.combine, Cart(), revised.plans, revised.motions)
    assert min(found.combine_gap, found.cart_gap) >= 0.5


def test_few_worlds_are_kept_and_the_others_are_made_again_as_they_were(hand_made, monkeypatch):
    made = hand_made(126.0, 100.0, 2)
    changed, worlds, living = service.changed_surroundings, [], []

    def counted(*args):
        world, since = changed(*args)
        worlds.append(weakref.ref(world))
        gc.collect()
        living.append(sum(each() is not None for each in worlds))
        return world, since

    usual = served_both_ways(made, 3.2, "on-demand", ("revised",))
    monkeypatch.setattr(service, "changed_surroundings", counted)
    monkeypatch.setattr(service, "MOST_WORLDS", 2)
    # What there was before is not looked through each time.
    gc.freeze()
    try:
        plans = served_both_ways(made, 3.2, "on-demand", ("revised",))
    finally:
        gc.unfreeze()
    for plan, other in zip(plans, usual, strict=True):
        assert (plan.visits, plan.stops) == (other.visits, other.stops)
        assert plan.stops
    # Beside those that are kept, the first one and those that the work at hand holds.
    assert len(worlds) > 15
    assert max(living) <= 5


def test_more_is_tried_where_there_are_more_visits(hand_made, monkeypatch):
    """A number for a whole field would be used up by the first of many waits."""
    made = hand_made(162.0, 120.0, 2)
    monkeypatch.setattr(visits, "FEWEST_OTHERS", 0)
    stops = []
    for others in (0, visits.OTHERS_A_VISIT):
        monkeypatch.setattr(visits, "OTHERS_A_VISIT", others)
        stops.append(len(served_both_ways(made, 1.7, "on-demand", ("revised",))[0].stops))
    assert stops == [1, 0]


def test_fewer_trials_may_give_up_the_same_visits(hand_made, monkeypatch):
    """They begin where nobody could come in time, with all that was planned before."""
    serve_all, tried = visits._serve_all, []

    def fail_first(service, past, *others):
        serve_all(service, past, *others)
        tried.append(past.most_others)
        if len(tried) == 1:
            past.others = visits.MOST_OTHERS
            raise NoPlan("`carts` must do better")

    monkeypatch.setattr(visits, "_serve_all", fail_first)
    made = hand_made(162.0, 120.0, 2)
    plan = served_both_ways(made, 1.7, "on-demand", ("revised",))[0]
    assert tried == [visits.MOST_OTHERS, visits.FEWEST_OTHERS]
    assert plan.stops == []
