"""Planners side by side: gaps, bounds, and answers that cannot all be true."""

import io
import json
import math
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console

from sightfield.diagrams.planning.methods import PlanningQuestion, chosen_methods
from sightfield.diagrams.planning.report import as_object, as_table, write_planning_report
from sightfield.diagrams.planning.sweep import sweep_ratios
from sightfield.diagrams.planning.verdict import (
    AGREEMENT,
    BOUND_TOLERANCE,
    DRIVEN_TOLERANCE,
    PlanningVerdict,
    Row,
    ask_methods,
    contradictions,
    reasons,
    resimulate,
)
from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.planning.goal import THESIS_TOLERANCE, Goal
from sightfield.systems.numerics.planning.lower_bound import lower_bound
from sightfield.systems.numerics.planning.trailer import Trailer

EXACT = ["casadi", "extremal", "primitive"]
START, GOAL = (1.0, 1.0, 0.0, 0.0), (4.0, 4.0, 0.0, 0.0)


@pytest.fixture(scope="module")
def verdict():
    """Planners on the thesis's case, the trailer within one cell of its grid."""
    goal = Goal(state=GOAL, tolerance=(0.0, 0.0, 0.0, 0.251))
    return ask_methods(PlanningQuestion(start=START, goal=goal), EXACT)


def row_of(verdict, method):
    return next(row for row in verdict.rows if row.method == method)


def with_time(verdict, method, time):
    """The verdict as it would be if one planner had said another time."""
    rows = tuple(
        Row(row.method, replace(row.plan, time=time) if row.method == method else row.plan, None)
        for row in verdict.rows
    )
    return PlanningVerdict(verdict.question, verdict.lower_bound, rows)


def test_every_planner_answers_and_nothing_contradicts(verdict):
    assert [row.method for row in verdict.rows] == EXACT
    assert all(row.plan.converged for row in verdict.rows)
    assert contradictions(verdict) == []


def test_what_a_table_promises_stands_beside_what_its_path_takes(verdict):
    row = row_of(verdict, "casadi")
    plan = replace(row.plan, notes={"time_to_go": 5.2})
    told = as_object(replace(verdict, rows=(replace(row, plan=plan), *verdict.rows[1:])))
    assert told["methods"]["casadi"]["time_to_go"] == 5.2
    assert told["methods"]["casadi"]["time"] == plan.time
    assert told["methods"]["extremal"]["time_to_go"] is None


def test_what_is_shown_moves_as_a_cart_does():
    """Planners know long arcs by their ends; between those a cart follows no chord."""
    cart = Trailer(speed=1.3, turn_rate=0.98, length=5.0, hitch_offset=1.0)
    goal = Goal(state=(2.0, -6.0, 2.2, 0.0), tolerance=(0.3, 0.3, 0.25, 0.25))
    question = PlanningQuestion(start=(39.0, 20.0, 2.5, 0.6), goal=goal, trailer=cart)
    asked = ask_methods(question, ["casadi"])
    (row,) = asked.rows
    plan, shown = row.plan.path, asked.shown[row.method]
    assert np.diff(plan.times).max() > 2.0
    places = np.searchsorted(shown.times, plan.times)
    np.testing.assert_array_equal(shown.states[places], plan.states)
    # Every chord along the heading in its middle, as wheels roll.
    steps, middle = np.diff(shown.states, axis=0), (shown.states[1:] + shown.states[:-1]) / 2
    forwards = steps[:, 0] * np.cos(middle[:, 2]) + steps[:, 1] * np.sin(middle[:, 2])
    aside = steps[:, 1] * np.cos(middle[:, 2]) - steps[:, 0] * np.sin(middle[:, 2])
    np.testing.assert_allclose(forwards, cart.speed * np.diff(shown.times), rtol=2e-4, atol=1e-6)
    np.testing.assert_allclose(aside, 0.0, atol=1e-6)
    assert np.abs(np.diff(shown.states[:, 2:], axis=0)).max() < 0.15


def test_gaps_are_relative_to_the_best_and_to_the_bound(verdict):
    best = row_of(verdict, "casadi")
    arcs = row_of(verdict, "primitive")
    assert verdict.best_time == min(row.plan.time for row in verdict.rows)
    assert verdict.best_time == pytest.approx(5.0995, abs=1e-3)
    assert verdict.gap_to_best(best) == pytest.approx(0.0, abs=1e-6)
    assert verdict.gap_to_best(arcs) == pytest.approx(arcs.plan.time / 5.099476 - 1, abs=1e-5)
    assert verdict.gap_to_bound(best) == pytest.approx(5.0995 / 4.46243 - 1, abs=1e-3)


def test_driven_plans_end_where_they_say(verdict):
    for row in verdict.rows:
        assert row.violation < 1e-6
        assert abs(row.beta_final) <= 0.251 + 1e-6


def test_a_plan_below_the_bound_is_a_contradiction(verdict):
    said = contradictions(with_time(verdict, "primitive", 4.4))
    assert len(said) == 1
    assert "primitive takes 4.4 s, below the bound 4.46243 s" in said[0]


def test_planners_that_promise_the_optimum_must_agree(verdict):
    said = contradictions(verdict, exact=lambda method, _: method in ("casadi", "primitive"))
    assert len(said) == 1
    assert "planners that promise the optimum differ" in said[0]


def test_a_path_that_leads_elsewhere_is_a_contradiction(verdict):
    shifted = Goal(state=(4.1, 4.0, 0.0, 0.0))
    other = ask_methods(PlanningQuestion(start=START, goal=shifted), ["casadi"])
    wrong = Row("casadi", row_of(verdict, "casadi").plan, other.rows[0].driven)
    wrong = replace(wrong, driven=replace(wrong.driven, goal_miss=(0.1, 0.0, 0.0, 0.0)))
    said = contradictions(PlanningVerdict(verdict.question, verdict.lower_bound, (wrong,)))
    assert said == ["casadi misses by 0.1 when it is driven"]


def test_the_object_is_json_without_infinities(verdict):
    goal = Goal(state=GOAL)
    point = ask_methods(PlanningQuestion(start=START, goal=goal), ["primitive"])
    said = json.loads(json.dumps(as_object(point), allow_nan=False))
    assert said["methods"]["primitive"]["time"] is None
    assert said["lower_bound"] == pytest.approx(4.46243, abs=1e-4)
    keys = {
        "time",
        "time_to_go",
        "beta_final",
        "status",
        "converged",
        "optimal_because",
        "gap_to_best",
    }
    keys |= {"gap_to_bound", "violation", "miss", "wall_time"}
    assert set(as_object(verdict)["methods"]["casadi"]) == keys
    said = as_object(verdict)["methods"]["primitive"]
    assert said["gap_to_best"] == verdict.gap_to_best(row_of(verdict, "primitive")) > 0
    assert max(said["miss"]) < 1e-6
    assert said["converged"]


def test_optimal_needs_a_reason(verdict):
    said = as_object(verdict)["methods"]
    assert said["casadi"]["status"] == "optimal: as quick as extremal"
    assert said["casadi"]["optimal_because"] == ["as quick as extremal"]
    assert said["primitive"]["optimal_because"] == []
    # The same programme from other seeds is no other witness, and alone there is none.
    twin = replace(row_of(verdict, "casadi"), method="polished")
    for rows in ((row_of(verdict, "casadi"), twin), (row_of(verdict, "casadi"),)):
        alone = as_object(replace(verdict, rows=rows))["methods"]["casadi"]
        assert (alone["status"], alone["optimal_because"]) == ("locally optimal", [])
    assert alone["gap_to_best"] is None
    on_bound = replace(verdict, rows=rows, lower_bound=verdict.best_time)
    assert as_object(on_bound)["methods"]["casadi"]["optimal_because"] == ["meets the bound"]


def test_a_plan_that_misses_when_it_is_driven_is_not_the_best(verdict):
    row = row_of(verdict, "casadi")
    missing = replace(row.driven, goal_miss=(0.0, 8.4e-3, 0.0, 0.0))
    wrong = replace(row, plan=replace(row.plan, time=4.9), driven=missing)
    told = replace(verdict, rows=(wrong, row_of(verdict, "extremal")))
    assert told.best_time == row_of(verdict, "extremal").plan.time
    said = as_object(told)["methods"]["casadi"]
    assert not said["converged"]
    assert said["status"] == "optimal, but misses by 0.0084 when it is driven"
    assert said["gap_to_best"] is None


def test_one_that_is_quicker_than_a_promised_optimum_contradicts_it(verdict):
    said = contradictions(with_time(verdict, "primitive", 4.9))
    assert len(said) == 1
    assert "promises the optimum, 5.09948 s, and primitive takes 4.9 s" in said[0]


def test_the_value_function_answers_for_a_box_and_says_when_it_needs_a_wider_one():
    box = Goal(state=GOAL, tolerance=THESIS_TOLERANCE)
    inside = ask_methods(PlanningQuestion(start=START, goal=box), ["casadi", "value-function"])
    assert contradictions(inside) == []
    row = row_of(inside, "value-function")
    assert row.plan.converged
    assert row.violation < 1e-6
    assert inside.gap_to_best(row) < 1e-3
    point = ask_methods(PlanningQuestion(start=START, goal=Goal(state=GOAL)), ["value-function"])
    assert not point.rows[0].plan.converged
    assert point.gap_to_bound(point.rows[0]) is None
    assert contradictions(point) == []
    text = as_table(point).caption
    assert "value-function: arrived in a wider box" in text
    assert "value-function: tolerance below one cell of the grid" in text
    assert any("shorter than to the goal" in remark for remark in as_object(point)["remarks"])


def test_a_planner_that_did_without_its_usual_means_says_so(verdict):
    row = row_of(verdict, "casadi")
    notes = {"fell_back": ["all seeds"]}
    told = replace(verdict, rows=(replace(row, plan=replace(row.plan, notes=notes)),))
    assert as_object(told)["remarks"] == ["casadi: all seeds"]
    assert "casadi: all seeds" in as_table(told).caption


def test_planners_that_cannot_say_so():
    goal = Goal(state=GOAL, tolerance=(math.inf, 0.2, 0.251, 0.251))
    free = ask_methods(PlanningQuestion(start=START, goal=goal), ["value-function"])
    assert free.rows[0].plan.status.startswith("not applicable")


def test_only_methods_that_see_walls_answer_among_walls():
    world = make_world([(-1, -1), (9, -1), (9, 4), (-1, 4)], [[(3, -1), (4, -1), (4, 1), (3, 1)]])
    goal = Goal(state=(6.5, 1.0, 0.0, 0.0), tolerance=(0.4, 0.4, 0.55, 0.55))
    question = PlanningQuestion(start=START, goal=goal, world=world, grid_step=0.4)
    verdict = ask_methods(question, chosen_methods("all"))
    for row in verdict.rows:
        if row.plan.method in ("casadi", "value-function"):
            assert row.plan.converged
            assert row.plan.notes["overlap"] < 1e-3
        else:
            assert row.plan.status == "not applicable among walls"
    assert row_of(verdict, "value-function").plan.time == pytest.approx(verdict.best_time, rel=1e-3)


def test_the_sweep_never_beats_its_bound():
    sweep = sweep_ratios(["casadi", "primitive"], (0.0, 0.0, 0.0, 0.251), 3)
    assert sweep.ratios.tolist() == [0.5, 1.75, 3.0]
    for times in sweep.times.values():
        assert (times >= sweep.lower_bounds - 1e-6).all()
    assert (sweep.times["casadi"] <= sweep.times["primitive"] + 1e-6).all()


def test_a_report_holds_the_paths(verdict, tmp_path):
    names = write_planning_report(verdict, tmp_path)
    assert {path.name for path in tmp_path.glob("[!.]*")} == set(names)
    with np.load(tmp_path / "paths.npz") as arrays:
        assert arrays["casadi/times"][-1] == row_of(verdict, "casadi").plan.time
        assert arrays["casadi/states"].shape[1] == 4


def test_unknown_methods_and_starts_are_refused():
    with pytest.raises(InvalidInput, match="`method` must be one of casadi"):
        chosen_methods("magic")
    with pytest.raises(InvalidInput, match="`start` must be a finite number"):
        PlanningQuestion(start=(math.nan, 0.0, 0.0, 0.0), goal=Goal(state=GOAL))


def test_a_path_down_a_table_that_the_programme_has_shortened_is_no_other_witness(verdict):
    row = row_of(verdict, "casadi")
    for polished, said in (
        (True, "locally optimal"),
        (False, "optimal: as quick as value-function"),
    ):
        plan = replace(row.plan, notes={"programme": polished})
        other = replace(row, method="value-function", plan=plan)
        told = as_object(replace(verdict, rows=(row, other)))["methods"]["casadi"]
        assert told["status"] == said


def test_what_is_odd_in_a_path_is_remarked(verdict):
    row = row_of(verdict, "casadi")
    assert as_object(replace(verdict, rows=(row,)))["remarks"] == []
    states = row.plan.path.states.copy()
    states[5, 3] = 6.2
    path = replace(row.plan.path, states=states)
    odd = replace(row, plan=replace(row.plan, path=path, notes={"overlap": 0.0012}))
    assert as_object(replace(verdict, rows=(odd,)))["remarks"] == [
        "casadi: between its nodes the cart is up to 1.2 mm in a wall",
        "casadi: the trailer turns right round its hitch, to 6.20 rad (`--jackknife`)",
    ]


def test_only_a_path_is_driven(verdict):
    with pytest.raises(InvalidInput, match="`path` must be of type TrailerPath; got NoneType"):
        resimulate(verdict.question.trailer, None, verdict.question.goal)


FIVE = ["casadi", "extremal", "value-function", "polished", "primitive"]
TELLING = {
    "five": (FIVE, {}),
    "one": (["casadi"], {"tolerance": (0.0, 0.0, 0.0, math.inf)}),
    "point": (["extremal"], {"tolerance": (0.0, 0.0, 0.0, 0.0)}),
    "free": (["primitive", "polished"], {"tolerance": (math.inf, 0.2, 0.0, 0.1)}),
}


@pytest.mark.parametrize("case", TELLING)
def test_what_is_told_is_as_recorded(case, by_hand, as_recorded):
    methods, options = TELLING[case]
    told = by_hand(*methods, **options)
    as_recorded(as_object(told), "object", relative=1e-5, absolute=1e-7)
    for width in (110, 44):
        console = Console(width=width, record=True, file=io.StringIO())
        console.print(as_table(told))
        as_recorded(console.export_text().splitlines(), f"table of {width}")


def row_with(verdict, time, method="casadi", miss=0.0, **changes):
    """A row that takes a time and misses by so much."""
    row = verdict.rows[0]
    driven = replace(
        row.driven, goal_miss=(0.0, miss, 0.0, 0.0), control_excess=0.0, jackknife_excess=0.0
    )
    return Row(method, replace(row.plan, time=time, **changes), driven)


def test_a_plan_that_misses_by_the_tolerance_still_holds(by_hand):
    verdict = by_hand("casadi")
    assert row_with(verdict, 3.0, miss=DRIVEN_TOLERANCE).holds
    assert not row_with(verdict, 3.0, miss=1.01 * DRIVEN_TOLERANCE).holds
    assert not row_with(verdict, 3.0, converged=False).holds
    for excess in ("control_excess", "jackknife_excess"):
        row = row_with(verdict, 3.0)
        row = replace(row, driven=replace(row.driven, **{excess: 0.2}))
        assert row.violation == 0.2
        assert contradictions(replace(verdict, rows=(row,))) == [
            "casadi misses by 0.2 when it is driven"
        ]
    exact = replace(verdict, rows=(row_with(verdict, 3.0, miss=DRIVEN_TOLERANCE),))
    assert contradictions(exact) == []
    there = by_hand("polished").rows[0]
    assert there.violation == 0.0
    assert there.holds
    assert there.beta_final == pytest.approx(0.2)
    states = there.plan.path.states.copy()
    states[-1, 3] = -math.pi
    path = replace(there.plan.path, states=states)
    assert replace(there, plan=replace(there.plan, path=path)).beta_final == math.pi
    assert by_hand("extremal").rows[0].beta_final is None


def test_plans_agree_up_to_a_share_of_their_time(by_hand):
    verdict, best = by_hand("casadi"), 3.0
    edge = (1 + AGREEMENT) * best
    for time, agree in ((edge, True), (edge * (1 + 1e-9), False)):
        rows = row_with(verdict, best), row_with(verdict, time, "primitive")
        told = replace(verdict, rows=rows, lower_bound=1.0)
        said = ["as quick as primitive"] if agree else []
        assert reasons(told, rows[0]) == said
        assert reasons(told, rows[1]) == (["as quick as casadi"] if agree else [])
        both = contradictions(told, exact=lambda method, _: True)
        assert (both == []) is agree
        reaching = replace(verdict, rows=(row_with(verdict, time),), lower_bound=best)
        assert reasons(reaching, reaching.rows[0]) == (["meets the bound"] if agree else [])
        slow = row_with(verdict, time), row_with(verdict, best, "primitive")
        promised = contradictions(
            replace(verdict, rows=slow, lower_bound=1.0), exact=lambda method, _: method == "casadi"
        )
        assert (promised == []) is agree


def test_a_bound_is_met_up_to_a_rounding(by_hand):
    verdict = by_hand("casadi")
    least = (1 - BOUND_TOLERANCE) * 2.75
    for time, beyond in ((least, False), (least * (1 - 1e-9), True)):
        told = replace(verdict, rows=(row_with(verdict, time),))
        assert any("below the bound" in said for said in contradictions(told)) is beyond
    # What is below the bound contradicts no promise.
    rows = row_with(verdict, 3.0), row_with(verdict, 2.0, "primitive")
    said = contradictions(replace(verdict, rows=rows), exact=lambda method, _: method == "casadi")
    assert len(said) == 1
    assert verdict.gap_to_bound(row_with(verdict, 5.5)) == pytest.approx(1.0)
    assert replace(verdict, lower_bound=0.0).gap_to_bound(verdict.rows[0]) is None
    assert replace(verdict, rows=()).best_time == math.inf


def test_small_overlaps_and_turns_are_not_told(by_hand):
    verdict = by_hand("casadi")
    row = verdict.rows[0]
    for overlap, told in ((0.99e-4, False), (1e-4, True)):
        each = replace(row, plan=replace(row.plan, notes={"overlap": overlap}))
        remarks = as_object(replace(verdict, rows=(each,)))["remarks"]
        assert remarks == (
            ["casadi: between its nodes the cart is up to 0.1 mm in a wall"] if told else []
        )
    for beyond, told in ((0.9e-6, False), (1.4e-6, True)):
        states = row.plan.path.states.copy()
        states[3, 3] = -math.pi - beyond
        path = replace(row.plan.path, states=states)
        each = replace(row, plan=replace(row.plan, path=path))
        assert bool(as_object(replace(verdict, rows=(each,)))["remarks"]) is told


def test_a_report_without_a_path_has_no_states(by_hand, tmp_path):
    names = ["verdict.json", "paths.npz", "paths.png", "replay.html"]
    assert write_planning_report(by_hand("extremal"), tmp_path) == names


def test_what_is_asked_is_driven(by_hand, monkeypatch):
    answered = {name: by_hand(name).rows[0] for name in FIVE}
    monkeypatch.setattr(
        "sightfield.diagrams.planning.verdict.METHODS",
        {name: lambda _, name=name: answered[name].plan for name in FIVE},
    )
    question = by_hand("casadi").question
    told = ask_methods(question, FIVE)
    assert [row.driven is not None for row in told.rows] == [True, False, True, False, True]
    assert told.lower_bound == lower_bound(question.trailer, question.start, question.goal)
    walled = by_hand("casadi", walled=True).question
    with pytest.raises(InvalidInput, match="walls"):
        ask_methods(replace(walled, start=(2.9, 0.3, 0.0, 0.0)), FIVE)
