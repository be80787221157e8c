"""Schedules of unlike combines are as they were recorded: visits, times, limits and remedies."""

from dataclasses import replace

import numpy as np
import pytest

from sightfield.systems.numerics.harvest.schedule import closed_forms as forms
from sightfield.systems.numerics.harvest.schedule.answer import (
    answer_schedule,
    answer_timetable,
    drawn_timetable,
    first_loads,
)
from sightfield.systems.numerics.harvest.schedule.best_visits import (
    best_visits,
    find_visits,
    travel_time_limit,
    visits_that_serve,
)
from sightfield.systems.numerics.harvest.schedule.carts import find_remedies
from sightfield.systems.numerics.harvest.schedule.closed_forms import EqualCombines
from sightfield.systems.numerics.harvest.schedule.fleet import (
    Fleet,
    Truck,
    line_of,
    round_of,
    sequential_round,
)
from sightfield.systems.numerics.harvest.schedule.limits import (
    best_rotation,
    best_round,
    certain_limit,
    earliest_loads,
    first_to_overflow,
    least_carts,
    unloading_share,
)
from sightfield.systems.numerics.harvest.schedule.periodic_plan import Aim, plan_round
from sightfield.systems.numerics.harvest.schedule.simulation import (
    CartRun,
    can_stand,
    plan_for_jitter,
    plan_jitter,
    plan_timetable,
    simulate_schedule,
)

# Ways that differ there and back, so that no two tours are equally long.
FLEET = Fleet(
    capacities=(10_544.0, 4_583.6, 10_951.0, 6_129.6, 8_320.0),
    fill_rates=(9.885, 9.671, 5.8175, 7.921, 6.4),
    unload_rates=(108.35, 101.6, 120.14, 124.68, 97.3),
    travel_times=(
        (0.0, 30.1, 42.3, 13.7, 51.2),
        (31.4, 0.0, 43.5, 26.9, 18.8),
        (40.9, 44.7, 0.0, 47.2, 22.5),
        (14.6, 25.3, 45.8, 0.0, 37.1),
        (52.6, 19.9, 21.2, 38.4, 0.0),
    ),
)
HURRIED = Fleet(
    (9281.0, 5298.0, 3834.0, 6610.0),
    (10.7, 17.4, 20.3, 5.4),
    (120.0, 107.0, 121.0, 168.0),
    ((0, 26.3, 1.1, 33.0), (26.9, 0, 25.8, 53.4), (1.3, 24.8, 0, 34.1), (32.0, 55.4, 35.1, 0)),
)
TRUCK = Truck(22_963.0, 26.375, 381.29, 12.926)
SMALL = Truck(8_150.0, 19.4, 244.8, 7.5)

CASES = {
    "one cart": (FLEET.part(range(3)), 1, None, {}),
    "hurried": (HURRIED, 1, None, {}),
    "hurried and a truck": (HURRIED, 1, TRUCK, {}),
    "a truck": (FLEET.part((3, 0, 1)), 1, TRUCK, {"fill": 0.93}),
    "a small cart": (FLEET.part((1, 4)), 1, SMALL, {}),
    "two carts": (FLEET, 2, None, {"fill": 0.9}),
    "two with a truck": (FLEET, 2, TRUCK, {}),
    "neighbours": (FLEET, 2, None, {"neighbours": True}),
    "jitter": (FLEET.part(range(3)), 1, None, {"jitter": 0.15}),
    "jitter and a truck": (FLEET.part((4, 2)), 1, TRUCK, {"jitter": 0.1}),
    "too far": (replace(FLEET, capacities=(2_000.0,) * 5), 1, TRUCK, {}),
    "too slow": (replace(FLEET, unload_rates=(31.0, 29.0, 27.0, 33.0, 30.0)), 1, None, {}),
    "too rough": (FLEET.part(range(3)), 1, None, {"jitter": 3.0}),
    "too little": (FLEET.part(range(3)), 1, None, {"fill": 0.02}),
    "alone": (FLEET.part((3,)), 1, None, {"fill": 0.8}),
    "shared": (HURRIED.part((0, 1, 2)), 2, SMALL, {}),
    "six": (
        Fleet(
            tuple(9_000.0 + 137.0 * n for n in range(6)),
            tuple(9.0 - 0.21 * n for n in range(6)),
            (130.0,) * 6,
            line_of((11.0, 12.5, 9.3, 14.1, 10.2)),
        ),
        3,
        Truck(30_000.0, 20.0, 300.0, 10.0),
        {},
    ),
}


def told(plan):
    if plan is None:
        return None
    names = ("period", "starts", "emptied", "leaves", "loads_at_start", "taken", "left_over")
    return [plan.waits, *(getattr(plan, name) for name in names)]


def plain(timetable):
    each = (*timetable.tanks, *timetable.carts)
    lines = [np.concatenate([getattr(line, name) for line in each]) for name in ("times", "loads")]
    visits = np.array(
        [[float(each) for each in vars(visit).values()] for visit in timetable.visits]
    )
    return [visits, lines, timetable.lost, timetable.overflows]


@pytest.fixture(scope="module", params=CASES)
def answer(request):
    fleet, carts, truck, options = CASES[request.param]
    return answer_schedule(fleet, carts, truck, **options)


def test_an_answer_is_as_recorded(answer, as_recorded):
    said = [answer.travel_scale, answer.feasible, answer.reasons, answer.certificate]
    as_recorded([*said, answer.certificate and answer.certificate.says], relative=1e-5)
    as_recorded(
        [
            {
                "group": [each.group.order, each.group.carts, each.unloading_share(answer.fleet)],
                "best": [each.group.best.scale, each.group.best.bound],
                "words": [
                    (round_.combines, round_.trips)
                    for round_ in (each.group.best.round, each.round)
                ],
                "ways": each.round.travel_times,
                "period": [each.plan and each.plan.period, each.period_min, each.phase],
                "jitter": [each.jitter, each.jitter_max],
            }
            for each in answer.carts
        ],
        "carts",
        relative=1e-5,
        absolute=1e-6,
    )


def test_timetables_are_as_recorded(answer, as_recorded):
    drawn = drawn_timetable(answer, 2)
    as_recorded([plain(drawn), first_loads(answer.fleet, drawn)], "drawn", relative=1e-4)
    if answer.feasible:
        as_recorded(plain(answer_timetable(answer, 3)), "answered", relative=1e-4)


@pytest.mark.parametrize("truck", [None, TRUCK, SMALL], ids=["no truck", "truck", "small cart"])
@pytest.mark.parametrize("fleet", [FLEET.part((2, 0, 3)), HURRIED], ids=["three", "hurried"])
def test_limits_are_as_recorded(fleet, truck, as_recorded):
    order = tuple(range(fleet.size))[::-1]
    round_, scale = best_round(fleet, order, truck)
    again, rotated = best_rotation(fleet, order, truck, 2)
    best = best_visits(fleet, order, truck)
    found = visits_that_serve(fleet, order, truck)
    as_recorded(
        {
            "round": [round_.combines, round_.trips, scale],
            "rotation": [again.combines, again.trips, rotated],
            "best": [best.round.combines, best.round.trips, best.scale, best.bound],
            "serves": found and [found.combines, found.trips],
            "limit": [certain_limit(fleet, carts, truck) for carts in (1, 2)],
            "least": least_carts(fleet, truck),
            "first": [first_to_overflow(fleet, each) for each in (round_, best.round)],
            "share": unloading_share(fleet, order[:2]),
            "loads": earliest_loads(fleet, sequential_round(fleet, order)),
            "ways": travel_time_limit(fleet, best.round),
        },
        relative=1e-5,
    )


def test_visits_of_a_search_are_as_recorded(as_recorded):
    said = [find_visits(HURRIED, (0, 2, 1, 3), scale) for scale in (0.4, 0.8, 1.0, 1.3, 2.0)]
    as_recorded([[round_ and round_.combines, outcome] for round_, outcome in said])


ROUNDS = {
    "once": (FLEET.part(range(3)), (0, 2, 1), (False,) * 3, None, 1),
    "twice": (HURRIED, (0, 2, 1, 2, 3, 1), (False,) * 6, None, 1),
    "trips": (FLEET.part(range(4)), (2, 1, 0, 1, 3), (False, True, False, False, True), TRUCK, 1),
    "small": (FLEET.part((0, 1)), (0, 1), (True, True), SMALL, 1),
    "shared": (HURRIED.part((0, 1, 2)), (2, 0, 1), (False, True, False), TRUCK, 2),
    "alone": (FLEET.part((1,)), (0,), (False,), None, 1),
}


@pytest.mark.parametrize("name", ROUNDS)
def test_plans_of_a_round_are_as_recorded(name, as_recorded):
    fleet, word, trips, truck, carts = ROUNDS[name]
    round_ = round_of(fleet, word, trips, truck, carts)
    full = plan_round(fleet, round_, 0.97)
    early = plan_round(fleet, round_, aim=Aim.EARLY)
    as_recorded([told(full), told(early)], "plans", relative=1e-4)
    as_recorded(full.stagger, "stagger", relative=1e-4)
    middle = plan_round(fleet, round_, period=0.4 * full.period + 0.6 * early.period)
    rough = plan_for_jitter(fleet, round_, 0.07)
    as_recorded([told(middle), told(rough)], "middle and rough", relative=1e-4)
    tolerated = [each and plan_jitter(each) for each in (full, early, middle, rough)]
    as_recorded([tolerated, can_stand(fleet, round_, 0.05)], "jitter", 1e-4, 1e-6)
    loads = tuple(0.1 * each for each in fleet.capacities)
    late = plan_timetable(middle, 2, loads, ready=1.3 * middle.period)
    as_recorded(plain(late), "timetable", relative=1e-4)
    run = CartRun(round_, 37.0, full, 1 + 0.3 * np.arange(3), [1.2, 0.9])
    begins = [-50.0 - 20.0 * n for n in range(fleet.size)]
    as_recorded(plain(simulate_schedule(fleet, run, 4, loads, begins)), "shaken", relative=1e-4)


@pytest.mark.parametrize("name", ["one cart", "a small cart", "two with a truck", "too far"])
def test_remedies_are_as_recorded(name, as_recorded):
    fleet, carts, truck, _ = CASES[name]
    as_recorded(find_remedies(fleet.part(range(min(fleet.size, 3))), carts, truck), "", 1e-5)


@pytest.mark.parametrize("combines", [1, 2, 5])
def test_closed_forms_are_as_recorded(combines, as_recorded):
    each = EqualCombines(combines, 9_300.0, 12.7, 118.0, 14.3)
    names = (
        "waiting_sum", "travel_time_max", "is_feasible", "waiting_time", "period", "period_min",
        "loads_at_start", "first_waits", "jitter_max", "capacity_min", "unload_rate_min",
        "fill_rate_max", "combines_feasible",
    )  # fmt: skip
    as_recorded({name: getattr(forms, name)(each) for name in names})
    as_recorded(forms.combines_max(each.fill_rate, each.unload_rate), "most")
