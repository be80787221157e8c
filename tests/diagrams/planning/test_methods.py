"""The planners by name: what they share, and what they do not apply to."""

import math

import pytest

from sightfield.diagrams.planning import methods
from sightfield.diagrams.planning.methods import (
    METHODS,
    PlanningQuestion,
    chosen_methods,
    memory_of,
    promises_optimum,
    quarter_of_memory,
    too_large,
)
from sightfield.diagrams.planning.verdict import ask_methods, contradictions
from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.planning.footprint import covering_discs
from sightfield.systems.numerics.planning.goal import THESIS_TOLERANCE, Goal
from sightfield.systems.numerics.planning.plan import Plan
from sightfield.systems.numerics.planning.trailer import Trailer
from sightfield.systems.numerics.planning.value_function.grid import StateGrid
from sightfield.systems.numerics.planning.value_function.solve import open_field_table

GOAL = Goal(state=(4.0, 4.0, 0.0, 0.0), tolerance=THESIS_TOLERANCE)
START = (1.0, 1.0, 0.0, 0.0)


def test_polished_and_casadi_agree_and_end_at_the_goal():
    question = PlanningQuestion(start=START, goal=GOAL, grid_step=0.4)
    verdict = ask_methods(question, ["casadi", "polished"])
    assert contradictions(verdict) == []
    for row in verdict.rows:
        assert row.plan.time == pytest.approx(4.3476, abs=1e-4)
        assert row.violation < 1e-6


def test_one_table_serves_planners_starts_and_goals():
    other = Goal(state=(-3.0, 7.0, 2.0, 0.0), tolerance=THESIS_TOLERANCE)
    questions = [
        PlanningQuestion(start=START, goal=GOAL, grid_step=0.4),
        PlanningQuestion(start=(-4.0, 6.0, 1.0, 0.3), goal=other, grid_step=0.4),
    ]
    table = open_field_table(Trailer(), START, GOAL, 0.4).table
    for question in questions:
        plan = METHODS["value-function"](question)
        assert plan.notes["value_function"].table is table


def test_polished_paths_know_no_walls():
    field = make_world([[0, 0], [6, 0], [6, 6], [0, 6]], [])
    plan = METHODS["polished"](PlanningQuestion(start=START, goal=GOAL, world=field))
    assert plan.status == "not applicable among walls"
    assert not plan.converged


def test_who_promises_the_optimum():
    there = PlanningQuestion(start=START, goal=GOAL)
    back = PlanningQuestion(start=START, goal=GOAL, trailer=Trailer(reverse=True))
    assert [name for name in METHODS if promises_optimum(name, there)] == ["casadi", "polished"]
    assert [name for name in METHODS if promises_optimum(name, back)] == ["casadi"]


FIELD = make_world([[0, 0], [6, 0], [6, 6], [0, 6]], [])
GRID = StateGrid(
    x_min=0.0, y_min=0.0, step=0.5, x_count=9, y_count=10, theta_count=11, beta_count=12
)


def test_a_table_takes_bytes_for_every_node_and_more_among_walls():
    nodes = 9 * 10 * 11 * 12
    assert memory_of(GRID, False) == 24 * nodes
    assert memory_of(GRID, True) == 24 * nodes + 9 * 10 * 11 * 256
    for world, bytes_ in ((None, 24 * nodes), (FIELD, 24 * nodes + 9 * 10 * 11 * 256)):
        for memory, large in ((bytes_, False), (bytes_ - 1, True)):
            ask = PlanningQuestion(start=START, goal=GOAL, world=world, memory=memory)
            assert too_large(ask, GRID) is large


def test_a_quarter_of_the_memory_is_taken(monkeypatch):
    known = {"SC_PAGE_SIZE": 4096, "SC_PHYS_PAGES": 1000}
    monkeypatch.setattr(methods.os, "sysconf", known.__getitem__)
    assert quarter_of_memory() == 1024000
    for error in (AttributeError, OSError, ValueError):

        def fail(name, error=error):
            raise error

        monkeypatch.setattr(methods.os, "sysconf", fail)
        assert quarter_of_memory() == 2e9


BENT = Trailer(jackknife=0.75, length=2.0)


@pytest.mark.parametrize(
    ("within", "beyond", "name"),
    [
        ({"start": (1, 1, 0, 0.75 - math.tau)}, {"start": (1, 1, 0, -0.76)}, "start"),
        ({}, {"start": (1, 1, 0)}, "start"),
        ({"goal": Goal(state=(4, 4, 0, -0.75))}, {"goal": Goal(state=(4, 4, 0, 0.76))}, "goal"),
        (
            {"goal": Goal(state=(4, 4, 0, 1.0), tolerance=(1, 1, 1, 0.25))},
            {"goal": Goal(state=(4, 4, 0, 1.0), tolerance=(1, 1, 1, 0.24))},
            "goal",
        ),
        ({"width": 0.04}, {"width": 0.039}, "width"),
        ({}, {"width": 0.0}, "width"),
        ({}, {"width": 1.0, "footprint": covering_discs(BENT)}, "width"),
        ({"footprint": covering_discs(BENT)}, {"memory": 0.0}, "memory"),
        ({"grid_step": 1}, {"grid_step": 1.01}, "grid"),
        ({}, {"grid_step": 0.0}, "grid"),
        ({}, {"start": (1e8, 1, 0, 0)}, "start"),
    ],
)
def test_questions_are_refused_beyond_their_ranges(within, beyond, name):
    values = {"start": (1, 1, 0, 0), "goal": Goal(state=(4, 4, 0, 0)), "trailer": BENT}
    PlanningQuestion(**{**values, **within})
    with pytest.raises(InvalidInput, match=name):
        PlanningQuestion(**{**values, **beyond})


def test_a_cart_is_as_wide_as_it_is_said_to_be():
    ask = PlanningQuestion(start=START, goal=GOAL, width=0.3)
    assert set(ask.discs.radii) == {0.15}
    assert set(PlanningQuestion(start=START, goal=GOAL).discs.radii) == {0.25}
    discs = covering_discs(Trailer(), 0.7)
    assert PlanningQuestion(start=START, goal=GOAL, footprint=discs).discs is discs


PLANNERS = (
    "plan_by_casadi",
    "plan_by_value_function",
    "plan_polished",
    "plan_by_averaging",
    "plan_by_extremals",
    "plan_by_primitives",
)


@pytest.fixture
def asked(monkeypatch):
    """What planners are asked: by name, their options; and open tables by their grid's step."""
    told = []
    for name in PLANNERS:

        def answer(trailer, start, goal, name=name, **options):
            told.append((name, options))
            return Plan(method=name, goal=goal, status="asked", converged=True)

        monkeypatch.setattr(methods, name, answer)
    monkeypatch.setattr(methods, "open_field_table", lambda *question: ("table", question[3]))
    return told


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    "ask",
    [
        PlanningQuestion(start=START, goal=GOAL, grid_step=0.4),
        PlanningQuestion(start=START, goal=GOAL, grid_step=0.4, memory=1e4),
        PlanningQuestion(start=START, goal=GOAL, grid_step=0.4, world=FIELD),
        PlanningQuestion(start=START, goal=GOAL, grid_step=0.4, world=FIELD, memory=1e4),
        PlanningQuestion(start=START, goal=GOAL, grid_step=0.4, trailer=Trailer(reverse=True)),
        PlanningQuestion(
            start=START, goal=Goal(state=GOAL.state, tolerance=(0.2, math.inf, 0.3, 0.3))
        ),
    ],
    ids=["open", "little memory", "walled", "walled with little", "reverse", "free"],
)
def test_who_is_asked_what_is_as_recorded(method, ask, asked, as_recorded):
    plan = METHODS[method](ask)
    options = [
        [name, {key: repr(each)[:90] for key, each in sorted(options.items())}]
        for name, options in asked
        if name not in ("plan_by_extremals", "plan_by_primitives")
    ]
    as_recorded([plan.method, plan.status, plan.converged, options])


def test_a_table_that_is_given_is_used(asked):
    ask = PlanningQuestion(start=START, goal=GOAL, memory=1e4, table="given")
    METHODS["value-function"](ask)
    METHODS["polished"](ask)
    assert [options["value"] for _, options in asked] == ["given", "given"]


def test_all_methods_are_all_but_variants():
    assert chosen_methods("all") == [name for name in METHODS if name != "averaging"]
    assert chosen_methods("averaging") == ["averaging"]


@pytest.mark.parametrize("entry", range(4))
def test_extremals_promise_the_optimum_where_they_meet_x_y_and_theta(entry):
    tolerance = tuple(0.1 if k == entry else 0.0 for k in range(4))
    goal = Goal(state=GOAL.state, tolerance=tolerance)
    ask = PlanningQuestion(start=START, goal=goal)
    assert promises_optimum("extremal", ask) is (entry == 3)
    walled = PlanningQuestion(start=START, goal=goal, world=FIELD)
    assert promises_optimum("polished", ask)
    assert not promises_optimum("polished", walled)
    assert promises_optimum("casadi", walled)
