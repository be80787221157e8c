"""Which of several ways becomes the plan of a table, and what is told of it; solvers are stubs."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.planning.footprint import covering_discs
from sightfield.systems.numerics.planning.goal import Goal
from sightfield.systems.numerics.planning.minimum_time.problem import Attempt, Problem
from sightfield.systems.numerics.planning.plan import Plan, TrailerPath, driven_path
from sightfield.systems.numerics.planning.planners import from_table
from sightfield.systems.numerics.planning.trailer import Trailer
from sightfield.systems.numerics.planning.value_function.policy import Rollout

CART = Trailer(speed=1.5, turn_rate=0.75, length=1.2)
START = (1.0, 1.0, 0.2, 0.1)
GOAL = Goal(state=(6.0, 2.0, 0.3, 0.1), tolerance=(0.2, 0.2, 0.2, 0.2))
WORLD = make_world([(-1.0, -1.0), (9.0, -1.0), (9.0, 5.0), (-1.0, 5.0)])
DISCS = covering_discs(CART)


def path_of(time):
    return driven_path(CART, START, [(1.5, 0.1, time)], 0.5)


def table(**changes):
    """What of a table is looked at."""
    told = {
        "trailer": CART,
        "grid": SimpleNamespace(shape=(8, 9, 10, 11), step=0.4),
        "goal": GOAL,
        "sweeps": 12,
        "scheme": "linear",
        "residual": 0.01,
        "converged": True,
        "warnings": (),
        "looked_up": lambda state: 3.1,
    }
    return SimpleNamespace(**{**told, **changes})


@pytest.fixture
def stubs(monkeypatch):
    """A function of how long ways take: driven (None: lost), quicker ones, and polished ones."""

    def put(driven=3.4, quicker=(), polished=(None,), saved=0.0, reach=2.9, overlap=-0.1):
        asked = []
        path = (
            path_of(driven)
            if driven
            else TrailerPath(np.zeros(1), np.zeros((1, 4)), np.zeros((0, 2)))
        )
        monkeypatch.setattr(
            from_table, "roll_out", lambda value, start: Rollout(path, driven is not None, 3.1)
        )
        monkeypatch.setattr(
            from_table, "_quicker_ways", lambda *question: [path_of(each) for each in quicker]
        )

        def casadi(trailer, start, goal, **options):
            time = polished[len(asked) % len(polished)]
            seeds = options.get("seeds")
            times = None if seeds is None else [each.times[-1] for each in seeds]
            asked.append([times, options.get("known", math.inf)])
            return Plan(
                method="casadi",
                goal=goal,
                status="optimal",
                converged=time is not None,
                time=time or math.inf,
                path=None if time is None else path_of(time),
                residual=1e-8,
                notes={"overlap": 2e-4},
            )

        monkeypatch.setattr(from_table, "plan_by_casadi", casadi)
        monkeypatch.setattr(from_table, "saved_by_narrow_passages", lambda *question: saved)
        monkeypatch.setattr(from_table, "path_overlap", lambda *question: overlap)
        monkeypatch.setattr(from_table, "look_up_in_reach", lambda value, start: reach)
        return asked

    return put


def told_of(plan):
    notes = {key: each for key, each in plan.notes.items() if key != "value_function"}
    reached = [plan.time, None if plan.path is None else plan.path.times[-1], plan.residual]
    return [plan.method, plan.status, plan.converged, *reached, plan.iterations, notes]


@pytest.mark.parametrize(
    ("ways", "changes"),
    [
        ({}, {}),
        ({"polished": (3.3,)}, {}),
        ({"polished": (3.4 * (1 - 0.9e-6),)}, {}),
        ({"polished": (3.5,)}, {"warnings": ("a wider box",)}),
        ({"polished": (None,)}, {"warnings": ("a wider box",)}),
        ({"quicker": (3.2, 3.3), "polished": (3.3, 3.15)}, {"converged": False}),
        ({"quicker": (3.2,), "polished": (3.1, None)}, {}),
        ({"saved": 2.0}, {}),
        ({"saved": 2.01, "overlap": 3e-4}, {"warnings": ("a wider box",)}),
        ({"driven": None}, {"warnings": ("a wider box",)}),
        ({"reach": 2.5}, {"looked_up": lambda state: math.inf}),
        ({"reach": math.inf}, {"looked_up": lambda state: math.inf}),
    ],
)
def test_the_way_that_becomes_the_plan_is_as_recorded(ways, changes, stubs, as_recorded):
    asked = stubs(**ways)
    plan = from_table.plan_from_table(table(**changes), START, GOAL, WORLD, DISCS)
    as_recorded([told_of(plan), asked])


@pytest.mark.parametrize("time", [None, 3.2])
@pytest.mark.parametrize(
    "ways",
    [
        {"driven": None, "polished": (2.9,)},
        {"driven": 3.4, "polished": (3.1, 3.0)},
        {"driven": 3.4, "polished": (3.3, 3.2 * (1 - 0.9e-6))},
        {"driven": 3.4, "polished": (None,)},
    ],
)
def test_ways_through_narrow_passages_are_as_recorded(time, ways, stubs, as_recorded):
    asked = stubs(**ways)
    path = None if time is None else path_of(time)
    plan = Plan(
        method="value-function",
        goal=GOAL,
        status="as it was",
        converged=time is not None,
        time=time or math.inf,
        path=path,
        notes={"warnings": ["narrow"], "sweeps": 3},
    )
    found = from_table._through_narrow_passages(plan, table(), START, GOAL, WORLD, DISCS)
    as_recorded([told_of(found), asked])


@pytest.mark.parametrize("share", [0.9985, 0.9995])
def test_a_small_programme_has_to_save_a_thousandth(share, monkeypatch):
    monkeypatch.setattr(from_table, "other_ways", lambda value, start: [path_of(5.0)])
    calls = []

    def solve(self, guess):
        calls.append([len(guess.controls), self.max_iterations])
        time = 3.4 * share if len(calls) == 2 else 3.4
        return Attempt(path_of(time), 0.0, "optimal", 1)

    monkeypatch.setattr(Problem, "solve", solve)
    found = from_table._quicker_ways(table(), START, GOAL, WORLD, DISCS, path_of(3.4))
    assert [path.times[-1] for path in found] == ([3.4 * share] if share < 0.999 else [])
    assert len(calls) > 2
    assert all(each == [30, 100] for each in calls)


@pytest.mark.parametrize(
    ("promised", "time", "warnings"),
    [
        (3.1, 3.4, ()),
        (3.1, 3.4, ("a wider box",)),
        (2.0, 3.3, ()),
        (1.0, 3.3, ()),
        (math.inf, None, ()),
        (3.1, None, ()),
    ],
)
def test_what_is_said_of_a_way_in_the_open_is_as_recorded(
    promised, time, warnings, monkeypatch, as_recorded
):
    path = TrailerPath(np.zeros(1), np.zeros((1, 4)), np.zeros((0, 2)))
    path = path if time is None else path_of(time)
    monkeypatch.setattr(
        from_table, "roll_out", lambda value, start: Rollout(path, time is not None, promised)
    )
    solved = table(warnings=warnings)
    asked = []

    def solve(*question, **options):
        asked.append([question[2].shape, options])
        return solved

    monkeypatch.setattr(from_table, "solve_value_function", solve)
    plan = from_table.plan_by_value_function(CART, START, GOAL, step=0.5, polish=3)
    as_recorded([told_of(plan), asked])


@pytest.mark.parametrize("narrow", [True, False])
def test_a_slimmer_cart_is_asked_where_passages_are_narrow(narrow, monkeypatch):
    asked = []

    def solve(trailer, goal, grid, **options):
        asked.append(options["discs"].radii[0])
        return ("table", options["discs"].radii[0], options["polish"])

    def plan_from_table(value, start, goal, world, discs):
        return Plan(
            method="m", goal=goal, status=str(value), converged=True, notes={"narrow": narrow}
        )

    def through(plan, slim, start, goal, world, discs):
        return Plan(method="m", goal=goal, status=str(slim), converged=True)

    monkeypatch.setattr(from_table, "solve_value_function", solve)
    monkeypatch.setattr(from_table, "plan_from_table", plan_from_table)
    monkeypatch.setattr(from_table, "_through_narrow_passages", through)
    plan = from_table.plan_by_value_function(CART, START, GOAL, step=0.1, polish=2, obstacles=WORLD)
    # Half a step of 0.2 m is left out on either side.
    assert asked == pytest.approx([0.3, 0.2] if narrow else [0.3])
    assert plan.status == str(("table", asked[-1], 2))


def test_where_nothing_is_left_for_a_line_of_nodes_there_is_no_other_way():
    corridor = make_world([(0.0, 0.0), (9.0, 0.0), (9.0, 1.0), (0.0, 1.0)])
    discs = covering_discs(Trailer(length=0.8), 0.5)
    start, end = (1.0, 0.5), (8.0, 0.5)
    assert from_table.saved_by_narrow_passages(corridor, discs, 0.6, start, end) == math.inf
    assert from_table.saved_by_narrow_passages(corridor, discs, 0.1, start, end) == 0.0
