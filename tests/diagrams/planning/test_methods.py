"""The planners by name: what they share, and what they do not apply to."""

import pytest

from sightfield.diagrams.planning.methods import METHODS, PlanningQuestion, promises_optimum
from sightfield.diagrams.planning.verdict import ask_methods, contradictions
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.planning.goal import THESIS_TOLERANCE, Goal
from sightfield.systems.numerics.planning.trailer import Trailer
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
