"""Which ways to cut a field are tried, refused and compared: with made-up ones."""

import itertools
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.errors import InvalidInput, NoPlan
from sightfield.systems.numerics.geometry.world import world_from_polygon
from sightfield.systems.numerics.harvest.coverage import plan_coverage
from sightfield.systems.numerics.harvest.coverage.driver import NoWay
from sightfield.systems.numerics.harvest.coverage.plan_coverage import (
    CoveragePaths,
    find_coverages,
)
from sightfield.systems.numerics.harvest.coverage.precedence import CropPrecedence
from sightfield.systems.numerics.harvest.coverage.swaths import (
    FILLED,
    OPEN,
    STANDS,
    UNTROUBLED,
    SwathTimes,
    _anneal,
    _total,
    _trouble,
    order_swaths,
    split_chain,
)
from sightfield.systems.numerics.harvest.field.field import Field
from sightfield.systems.numerics.harvest.machines import Combine
from sightfield.systems.numerics.harvest.paths import MachinePath

FIELD, TEAM = Field.rectangle(100.0, 70.0), [Combine()] * 2


def candidate(rounds):
    return SimpleNamespace(rounds=(None,) * rounds)


def test_four_ways_with_a_number_of_rounds_come_before_other_numbers():
    given = [candidate(n) for n in (2, 1, 1, 1, 1, 1, 2, 1, 3, 2, 2, 2)]
    order = plan_coverage._spread(given)
    numbers = [next(k for k, each in enumerate(given) if each is way) for way in order]
    assert numbers == [0, 1, 2, 3, 4, 6, 8, 9, 10, 5, 7, 11]
    many = [candidate(n) for n in range(40)]
    assert plan_coverage._spread(many) == many[:24]
    assert plan_coverage._spread([]) == []


def way(**told):
    """A way to cut the field with which nothing is wrong, but for what is told."""
    path = MachinePath.of([[0.0, 0, 0], [5.0, 0, 0], [9.0, 0, 1.0]])
    stations = np.arange(3.0)
    needs = ((np.zeros(3), told.pop("needs", np.zeros(3))), (np.zeros(3), np.zeros(3)))
    under = told.pop("under", 0.0)
    precedence = CropPrecedence(needs, (stations, stations), under * 1000.0, False)
    usual = {
        "paths": (path, path),
        "precedence": precedence,
        "area": 1000.0,
        "covered_area": 990.0,
        "times": np.array([60.0, 70.0]),
        "off_paths": np.ones((2, 2), dtype=bool),
    }
    return CoveragePaths(**{**usual, **told})


@pytest.mark.parametrize(
    ("told", "fault"),
    [
        ({}, ""),
        ({"covered_area": 985.0}, ""),
        ({"covered_area": 984.9}, "98.5% would be cut"),
        ({"needs": np.array([0.0, 2.0, 2.1])}, "combines would wait for one another"),
        ({"under": 0.0015}, ""),
        ({"under": 0.00151}, "bodies would drive over 0.15% of the crop"),
    ],
)
def test_a_way_is_sound_up_to_its_limits(told, fault):
    ground = SimpleNamespace(admits=lambda path, footprint: True)
    plan = way(**told)
    sharpest = float(np.abs(plan.paths[0].curvatures).max())
    assert plan_coverage._what_is_wrong(plan, ground, None, sharpest) == fault
    if not fault:
        less = 0.999 * sharpest
        words = "combines would turn too sharply"
        assert plan_coverage._what_is_wrong(plan, ground, None, less) == words
        off = SimpleNamespace(admits=lambda path, footprint: False)
        words = "combines would leave the ground"
        assert plan_coverage._what_is_wrong(plan, off, None, sharpest) == words


def test_a_way_knows_its_share_and_its_length():
    plan = way()
    assert plan.coverage == 0.99
    assert plan.length == pytest.approx(2 * plan.paths[0].length)


@pytest.fixture
def cut(monkeypatch):
    """A function of a field and of what comes of each candidate: the ways that are found."""

    def found(field, results, count=99):
        candidates = [candidate(n) for n in range(len(results))]

        def build(_field, _team, each, *_, **__):
            result = results[candidates.index(each)]
            if isinstance(result, str):
                raise NoWay(result)
            return result

        monkeypatch.setattr(plan_coverage, "find_candidates", lambda *_, **__: candidates)
        monkeypatch.setattr(plan_coverage, "_build", build)
        monkeypatch.setattr(
            plan_coverage, "_what_is_wrong", lambda plan, *_: getattr(plan, "wrong", "")
        )
        return list(itertools.islice(find_coverages(field, TEAM), count))

    return found


def made_up(time, coverage=1.0, wrong=""):
    return SimpleNamespace(times=np.array([time - 3.0, time]), coverage=coverage, wrong=wrong)


def test_the_quickest_of_three_ways_comes_first_and_patchy_ones_last(cut):
    ways = [made_up(time) for time in (90, 70, 80, 60, 65)]
    assert [each.times.max() for each in cut(FIELD, ways)] == [70, 80, 90, 60, 65]
    patchy = [made_up(50, 0.9949), "no way", made_up(55, 0.9951), made_up(40, 0.994), made_up(95)]
    assert [each.times.max() for each in cut(FIELD, patchy)] == [50, 55, 95, 40]
    many = [made_up(50, 0.99), made_up(80), made_up(90), made_up(95), made_up(10, 0.991)]
    assert [each.times.max() for each in cut(FIELD, many)] == [80, 90, 95, 10, 50]
    assert [each.times.max() for each in cut(FIELD, [made_up(9, 1.0, "bad"), made_up(8)])] == [8]


@pytest.mark.parametrize(("ponds", "first"), [(2, 20.0), (3, 10.0)])
def test_with_three_holes_more_crop_may_be_left(cut, ponds, first):
    holes = [shapely.box(20 * k + 10, 30, 20 * k + 14, 34) for k in range(ponds)]
    field = Field(world_from_polygon(shapely.box(0, 0, 100, 70) - shapely.union_all(holes)))
    ways = [made_up(10, 0.985), made_up(20), made_up(30), made_up(40)]
    assert cut(field, ways, 1)[0].times.max() == first


def test_why_there_is_no_way_is_told_by_one_that_can_be_driven(cut, monkeypatch):
    monkeypatch.setattr(plan_coverage, "_wider_margin", lambda *_: "; more")
    words = (
        r"`field` must have room for 2 combines with headers of 9 m and turns of 6 m; got 0\.70 "
    )
    words += r"ha with a margin of 12 m \(it tips over\); more"
    with pytest.raises(NoPlan, match=words):
        cut(FIELD, ["from here to there", made_up(9, 1.0, "it tips over"), made_up(8, 1.0, "bad")])
    with pytest.raises(NoPlan, match=r"12 m \(from here to there\); more"):
        cut(FIELD, ["from here to there", "elsewhere"])


@pytest.mark.parametrize(
    ("margin", "works", "words"),
    [
        (2.0, 6.0, "; a margin of 6 m has room for their paths"),
        (2.0, 24.0, "; a margin of 24 m has room for their paths"),
        (6.0, 6.0, "; a margin of 12 m has room for their paths"),
        (6.0, 12.0, "; a margin of 12 m has room for their paths"),
        (2.0, 25.0, ""),
        (24.0, 0.0, ""),
    ],
)
def test_a_wider_margin_that_has_room_is_told(monkeypatch, margin, works, words):
    monkeypatch.setattr(
        plan_coverage, "_sound_coverages", lambda field, *_: iter([1] * (field.margin >= works))
    )
    narrow = replace(FIELD, margin=margin)
    assert plan_coverage._wider_margin(narrow, TEAM, "lands", np.inf) == words


@pytest.mark.parametrize(
    ("team", "options", "message"),
    [
        ([Combine()] * 33, {}, "`combines` must be at most 32; got 33"),
        ([Combine(header_width=3.6)], {}, "`header_width` must be larger than the body's width of"),
        ([Combine()], {"pattern": "spiral"}, "`pattern` must be"),
    ],
)
def test_teams_and_patterns_that_there_are_not_are_refused(team, options, message):
    with pytest.raises(InvalidInput, match=message):
        next(find_coverages(FIELD, team, **options))


def swath_times(seed, count):
    rng = np.random.default_rng(seed)
    left = rng.integers(-2, count, 2 * count)
    return SwathTimes(
        rng.uniform(5, 60, (2 * count, 2 * count)),
        rng.uniform(5, 60, 2 * count),
        left,
        rng.uniform(20, 60, 2 * count),
        rng.uniform(0.2, 0.8, count),
    )


def test_the_cost_of_an_order_is_that_of_ways_closed_swaths_and_full_tanks():
    assert _trouble(UNTROUBLED) == 0.0
    assert _trouble(UNTROUBLED + 0.5) == pytest.approx(FILLED / 4)
    rng = np.random.default_rng(4)
    for seed in range(30):
        times = swath_times(seed, 6)
        order = 2 * rng.permutation(6) + rng.integers(0, 2, 6)
        total, filled, run, done = times.first[order[0]], [], 0.0, set()
        total += times.between[order[:-1], order[1:]].sum()
        for node in order:
            beside = times.left[node]
            if beside == STANDS or (beside != OPEN and beside not in done):
                total += times.closed[node]
                run += times.fill[node // 2]
            else:
                filled.append(run)
                run = 0.0
            done.add(node // 2)
        total += FILLED * sum(max(each - UNTROUBLED, 0.0) ** 2 for each in [*filled, run])
        assert _total(order, times, np.ones(6, dtype=bool)) == pytest.approx(total)


@pytest.mark.parametrize("steps", [1, 7, 60, 400])
def test_annealing_is_as_recorded(steps, as_recorded):
    times = swath_times(3, 7)
    draws = np.random.default_rng(steps).random((steps, 5))
    order, best = 2 * np.arange(7), np.zeros(7, dtype=np.int64)
    cost = _anneal(order, best, times, draws, 40.0, 0.3)
    assert cost == pytest.approx(_total(best, times, np.zeros(7, dtype=bool)))
    as_recorded([cost, best, order])


def test_orders_of_swaths_are_as_recorded(as_recorded):
    as_recorded([order_swaths(swath_times(seed, 2 + seed), seed) for seed in range(4)])
    assert order_swaths(swath_times(1, 0), 0) == []


def test_parts_of_a_chain_are_as_many_as_workers():
    with pytest.raises(ValueError, match="argument"):
        split_chain(np.ones((3, 4)), np.zeros(2))
    assert split_chain(np.ones((2, 0)), np.zeros(2)) == [slice(0, 0), slice(0, 0)]
    # One after whom nothing is left to do has nothing.
    assert split_chain(np.ones((2, 2)), np.array([0.0, 90.0])) == [slice(0, 2), slice(2, 2)]
