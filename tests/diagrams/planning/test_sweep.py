"""Sweeping the direction of the goal (Figure 3.10)."""

import math

import numpy as np
import pytest

from sightfield.diagrams.planning import sweep as module
from sightfield.diagrams.planning.methods import METHODS, PlanningQuestion
from sightfield.diagrams.planning.sweep import sweep_ratios
from sightfield.systems.numerics.planning.goal import Goal
from sightfield.systems.numerics.planning.plan import Plan

WIDE = (0.5, 0.5, 0.63, 0.63)


def test_one_table_serves_all_starts():
    sweep = sweep_ratios(["value-function"], WIDE, 3, grid_step=0.5)
    goal = Goal(state=(0.0, 0.0, 0.0, 0.0), tolerance=WIDE)
    own = METHODS["value-function"](
        PlanningQuestion(start=(-12.0, -4.0, 0.0, 0.0), goal=goal, grid_step=0.5)
    )
    # On another grid places of nodes are rounded otherwise.
    assert sweep.times["value-function"][-1] == pytest.approx(own.time, rel=1e-12)
    # Coarse tables promise less than they keep, but nothing beats the bound.
    assert (sweep.times["value-function"] >= sweep.lower_bounds).all()


def test_each_grid_is_solved_on_once():
    passes = []
    for step in (0.5, 0.4):
        sweep_ratios(
            ["value-function"], WIDE, 2, grid_step=step, progress=lambda k, _: passes.append(k)
        )
    # The count of passes starts with each solution.
    assert passes.count(1) == 2


def test_what_did_not_converge_is_missing_and_said():
    sweep = sweep_ratios(["value-function", "primitive"], (0.2, 0.2, 0.25, 0.25), 2, grid_step=0.5)
    assert np.isnan(sweep.times["value-function"]).all()
    assert np.isfinite(sweep.times["primitive"]).all()
    (remark,) = sweep.remarks
    assert remark.startswith("value-function: ")
    assert remark.endswith("(2 of 2)")
    assert sweep.as_object()["methods"]["value-function"] == [None, None]


def test_one_ratio_is_no_sweep():
    with pytest.raises(ValueError, match="`count` must be at least 2"):
        sweep_ratios(["primitive"], WIDE, 1)


@pytest.mark.parametrize("width", [0.5, 0.05, math.inf])
def test_what_planners_are_asked_in_a_sweep_is_as_recorded(width, monkeypatch, as_recorded):
    asked = []

    def answer(ask):
        asked.append([*ask.start, ask.table, ask.grid_step, *ask.goal.tolerance])
        far = ask.start[0] < -6
        status = "lost on the way" if far else "arrived"
        return Plan(
            method="any", goal=ask.goal, status=status, converged=not far, time=-ask.start[0]
        )

    monkeypatch.setattr(module, "METHODS", {"value-function": answer, "casadi": answer})
    monkeypatch.setattr(module, "lower_bound", lambda trailer, start, goal: -start[0] / 2)
    monkeypatch.setattr(module, "solve_value_function", lambda *question, progress: "a table")
    for methods in (["value-function", "casadi"], ["casadi"]):
        found = module.sweep_ratios(methods, (0.5, width, 0.63, 0.63), 4, grid_step=0.5)
        as_recorded(found, f"found by {len(methods)}")
        as_recorded(found.as_object(), f"object of {len(methods)}")
    as_recorded(asked, "asked")
