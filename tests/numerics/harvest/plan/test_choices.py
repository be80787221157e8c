"""Which plans are tried, in which order, and which is taken: with plans of made-up times."""

import itertools
from types import SimpleNamespace

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput, NoPlan
from sightfield.systems.numerics.harvest.carts.cart_plan import Failure
from sightfield.systems.numerics.harvest.field.field import Field
from sightfield.systems.numerics.harvest.machines import Cart, Combine
from sightfield.systems.numerics.harvest.paths import MachinePath
from sightfield.systems.numerics.harvest.plan import harvest_plan
from sightfield.systems.numerics.harvest.plan.harvest_plan import (
    CombinePlan,
    TroddenCrop,
    find_combine_plans,
    plan_combines,
    plan_harvest,
    swath_lines,
)
from sightfield.systems.numerics.harvest.timing.timetable import Block, Standstill

FIELD, TEAM = Field.rectangle(100.0, 70.0), [Combine()] * 2
STANDSTILL = Standstill((Block(1, 20.0, (3.0, 4.0), 0, 70.0, "in the way"),), (5, 7))


def made_up(makespan, waiting=0.0, **told):
    """A plan of two combines that takes so long, and waits for a part of that."""
    plan = object.__new__(CombinePlan)
    lost = np.zeros((2, 2, 2))
    lost[0, 1, 0] = waiting * makespan * 2
    timetable = SimpleNamespace(makespan=makespan, waiting=lost, paths=(None, None))
    for name, value in {"timetable": timetable, "field": FIELD, "machines": TEAM, **told}.items():
        object.__setattr__(plan, name, value)
    return plan


@pytest.fixture
def plans_of(monkeypatch):
    """A function of estimates of ways to cut a field, and of what they come to: plans in order."""

    def found(estimates, results):
        ways = [SimpleNamespace(times=np.array([time, time - 5.0])) for time in estimates]
        plans = [made_up(each) if isinstance(each, float) else each for each in results]
        of = {id(way): plan for way, plan in zip(ways, plans, strict=True)}
        monkeypatch.setattr(harvest_plan, "find_coverages", lambda *_, **__: iter(ways))
        monkeypatch.setattr(harvest_plan, "_time", lambda *given: of[id(given[2])])
        return [each.makespan for each in find_combine_plans(FIELD, TEAM)]

    return found


@pytest.mark.parametrize(
    ("estimates", "results", "order"),
    [
        # Three are timed, and the quickest comes first; then come others.
        ([100, 90, 80, 300, 70], [120.0, 100.0, 110.0, 400.0, 90.0], [100, 110, 120, 400, 90]),
        # A way that cannot be quicker, by its estimate, is not timed before it is asked for.
        ([100, 130, 50], [120.0, 140.0, 60.0], [120, 140, 60]),
        ([100, 120, 50], [120.0, 110.0, 60.0], [120, 110, 60]),
        ([100, 119, 50], [120.0, 110.0, 60.0], [60, 110, 120]),
        # What is blocked is left out, and more are timed until one is not.
        ([100, 90, 80, 70, 60], [STANDSTILL] * 3 + [75.0, 65.0], [75, 65]),
        ([100, 90, 80, 70], [150.0, STANDSTILL, TroddenCrop(0.004), 75.0], [150, 75]),
    ],
)
def test_the_quickest_of_three_ways_is_first(plans_of, estimates, results, order):
    assert plans_of(estimates, results) == order


def test_where_every_way_is_blocked_the_reason_is_told(plans_of):
    with pytest.raises(
        NoPlan, match=r"`combines` must be fewer.* all of 3 ways .* machine 1 at 20"
    ):
        plans_of([90, 80, 70], [TroddenCrop(0.004), STANDSTILL, TroddenCrop(0.005)])
    words = (
        r"`header_width` must be larger, got 9 m: bodies would drive over 0\.40% of the crop in "
    )
    with pytest.raises(NoPlan, match=words + "the first of 2 ways to cut the field"):
        plans_of([90, 80], [TroddenCrop(0.004), TroddenCrop(0.005)])


def test_a_reach_is_positive():
    for reach in (0.0, -1.0):
        with pytest.raises(InvalidInput, match="`reach` must be positive"):
            plan_combines(FIELD, TEAM, reach=reach)


@pytest.mark.parametrize(
    ("plan", "others", "parts", "taken"),
    [
        # Little waiting is no matter.
        (made_up(100.0, 0.0299), [], [], 100.0),
        (made_up(100.0, 0.0301), [made_up(90.0)], [1.0], 90.0),
        (made_up(100.0, 0.5), [made_up(100.0, 0.4)], [1.0], 100.0),
        (made_up(100.0, 0.5), [None], [1.0], 100.0),
        (made_up(100.0, 0.5), [TroddenCrop(0.01), made_up(80.0)], [1.0, 0.5], 80.0),
        (made_up(100.0, 0.5), [TroddenCrop(0.01)] * 3, [1.0, 0.5, 0.25], 100.0),
        (made_up(100.0, 0.5), [STANDSTILL], [1.0], 100.0),
        (STANDSTILL, [made_up(120.0)], [1.0], 120.0),
    ],
)
def test_slivers_are_given_up_where_waits_are_long(monkeypatch, plan, others, parts, taken):
    timed, asked = iter([plan, *others]), []

    def precedence(*_, slivers):
        asked.append(slivers)
        return SimpleNamespace(given_up=others[len(asked) - 1] is not None)

    monkeypatch.setattr(harvest_plan, "_time_journeys", lambda *_: next(timed))
    monkeypatch.setattr(harvest_plan, "find_precedence", precedence)
    monkeypatch.setattr(harvest_plan, "replace", lambda coverage, **_: coverage)
    path = MachinePath.of([[0.0, 0.0, 0.0], [9.0, 0.0, 0.0]])
    coverage = SimpleNamespace(paths=(path, path))
    assert harvest_plan._time(FIELD, TEAM, coverage, 0).makespan == taken
    assert asked == parts


@pytest.mark.parametrize(("share", "fits"), [(0.0019, True), (0.00191, False), (0.5, None)])
def test_plans_that_give_up_crop_may_drive_over_a_little_of_it(monkeypatch, share, fits):
    timetable = SimpleNamespace(paths=())
    monkeypatch.setattr(harvest_plan, "time_machines", lambda *_, **__: timetable)
    monkeypatch.setattr(harvest_plan, "crop_under_bodies", lambda *_: share * FIELD.area)
    precedence = SimpleNamespace(given_up=fits is not None, needs=())
    coverage = SimpleNamespace(precedence=precedence)
    found = harvest_plan._time_journeys(FIELD, TEAM, coverage, (), 0)
    if fits is False:
        assert str(found) == f"bodies would drive over {share:.2%} of the crop"
    else:
        assert isinstance(found, CombinePlan)
        assert found.machines == tuple(TEAM)


@pytest.fixture
def served(monkeypatch):
    """A function of what carts can serve: how often they were asked, and with which trucks."""

    def tried(works, failure=None):
        asked, firsts = [], []

        def serve(*given):
            asked.append(given[9])
            if not works(given[9], len(asked)):
                raise NoPlan(f"`carts` must serve; got try {len(asked)}")
            return SimpleNamespace()

        def places(_team, _cart, count, first):
            firsts.append(first)
            return np.zeros((count, 3))

        teams = itertools.repeat(made_up(100.0))
        monkeypatch.setattr(harvest_plan, "find_combine_plans", lambda *_, **__: teams)
        monkeypatch.setattr(harvest_plan, "swath_lines", lambda _: [])
        monkeypatch.setattr(harvest_plan, "serve_combines", serve)
        monkeypatch.setattr(harvest_plan, "truck_places", places)
        made_up_paths = SimpleNamespace(makespan=100.0, paths=())
        for team in [next(teams)]:
            object.__setattr__(team, "timetable", made_up_paths)
        told = {"carts": 2, "density": 0.8, "failure": failure}
        try:
            plan_harvest(FIELD, TEAM, Cart(), **told)
        except NoPlan as fault:
            return asked, firsts, str(fault)
        return asked, firsts, ""

    return tried


def test_six_plans_of_the_combines_are_tried_with_trucks_elsewhere(served):
    asked, firsts, fault = served(lambda *_: False)
    assert asked == [None] * 6
    assert firsts == pytest.approx([0.125 + 0.38 * k for k in range(6)])
    # The first reason is told.
    assert fault.endswith("try 1")
    asked, _, fault = served(lambda _, number: number == 3)
    assert (asked, fault) == ([None] * 3, "")


def test_where_only_the_failure_of_a_cart_is_the_matter_no_other_plan_is_tried(served):
    failure = Failure(0, 50.0)
    asked, _, fault = served(lambda fails, _: fails is None, failure)
    assert asked == [failure, None]
    assert fault.endswith("try 1")
    # Where it does not work without the failure either, others are.
    asked, _, _ = served(lambda *_: False, failure)
    assert asked == [failure, None] * 6
    asked, _, fault = served(lambda _, number: number == 3, failure)
    assert (asked, fault) == ([failure, None, failure], "")


def test_straight_pieces_of_work_of_thirty_metres_are_lines_for_carts():
    poses = [[0.0, 0.0, 0.0], [30.5, 0.0, 0.0], [60.0, 0.0, 0.0], [100.0, 0.0, 0.0]]
    poses += [[120.0, 9.0, 0.9], [160.0, 59.41, 0.9]]
    down = np.array([True, True, False, True, True])
    path = MachinePath(np.array(poses), np.ones(5, dtype=int), down, np.zeros(5, dtype=int))
    path.poses[5, :2] = path.poses[4, :2] + 50.0 * np.array([np.cos(0.9), np.sin(0.9)])
    lines = swath_lines(SimpleNamespace(paths=(SimpleNamespace(path=path),)))
    np.testing.assert_allclose(lines, [path.poses[0:2, :2], path.poses[4:6, :2]])
