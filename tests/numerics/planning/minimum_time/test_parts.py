"""What the planner makes of the solver's attempts; the solver is a stub."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.planning.footprint import Discs
from sightfield.systems.numerics.planning.goal import Goal
from sightfield.systems.numerics.planning.minimum_time import planner
from sightfield.systems.numerics.planning.minimum_time.kept_clear import Kept
from sightfield.systems.numerics.planning.minimum_time.planner import plan_by_casadi
from sightfield.systems.numerics.planning.minimum_time.problem import Attempt, Problem
from sightfield.systems.numerics.planning.plan import TrailerPath, driven_path
from sightfield.systems.numerics.planning.trailer import Trailer

CART = Trailer(speed=1.3, turn_rate=0.8, length=1.1, hitch_offset=0.25)
START = (1.0, 1.2, 0.3, 0.2)
GOAL = Goal(state=(8.0, 4.6, 0.8, 0.1), tolerance=(0.3, 0.2, 0.2, 0.3))
FIELD = make_world([(-1.0, -0.8), (11.0, -1.0), (10.8, 7.5), (-0.9, 7.3)])


@pytest.fixture
def solved(monkeypatch):
    """A function of what attempts end with: violations and statuses, in turn; returns the calls."""

    def answer(*script):
        calls = []

        def solve(self, guess):
            violation, status = script[len(calls) % len(script)]
            calls.append([len(guess.controls), len(guess.durations), self.max_iterations])
            intervals = len(guess.controls) // len(guess.durations)
            steps = np.repeat(guess.durations / intervals, intervals)
            times = np.append(0.0, np.cumsum(steps))
            path = TrailerPath(times, guess.states, guess.controls)
            return Attempt(path, violation, status, 7)

        monkeypatch.setattr(Problem, "solve", solve)
        return calls

    return answer


def told_of(plan):
    time = None if plan.path is None else plan.path.times[-1]
    reached = [plan.time, time, plan.iterations, plan.residual]
    return [plan.method, plan.status, plan.converged, *reached, plan.notes]


LOST, NEARLY, WELL = (0.3, "iteration limit"), (0.0, "nearly optimal"), (1e-7, "optimal")


@pytest.mark.parametrize(
    "script",
    [[LOST], [LOST, (0.2, "no path found"), LOST], [WELL, LOST], [NEARLY], [LOST] * 7 + [WELL]],
    ids=["lost", "lost otherwise", "well", "nearly", "late"],
)
def test_plans_in_the_open_are_as_recorded(script, solved, as_recorded):
    calls = solved(*script)
    as_recorded(told_of(plan_by_casadi(CART, START, GOAL)), "plan", relative=1e-4)
    as_recorded(calls, "calls")
    calls.clear()
    seeds = [driven_path(CART, START, [(1.3, 0.1, 5.0)])] * 2
    plan = plan_by_casadi(CART, START, GOAL, intervals=2, seeds=seeds, max_iterations=1)
    as_recorded([told_of(plan), calls], "from seeds", relative=1e-4)


@pytest.mark.parametrize("overlap", [None, -0.1, 1.05e-3, 1.2e-3])
@pytest.mark.parametrize("script", [[LOST], [WELL]], ids=["lost", "well"])
def test_plans_among_walls_are_as_recorded(overlap, script, solved, as_recorded, monkeypatch):
    calls, asked = solved(*script), []

    def kept_clear(problem, attempts, known):
        asked.append([len(attempts), known, attempts[-1].status, attempts[-1].violation])
        return (None if overlap is None else Kept(attempts[0], overlap)), 11

    monkeypatch.setattr(planner, "best_kept_clear", kept_clear)
    plan = plan_by_casadi(CART, START, GOAL, obstacles=FIELD)
    seeds = [driven_path(CART, START, [(1.3, 0.1, 5.0)])]
    other = plan_by_casadi(
        CART, START, GOAL, obstacles=FIELD, seeds=seeds, max_iterations=90, known=5.5
    )
    as_recorded([told_of(plan), told_of(other), asked, calls], relative=1e-4)


def test_a_goal_behind_a_wall_is_unreachable(solved):
    calls = solved(WELL)
    rooms = [(0, 0), (4, 0), (4, 3), (4.4, 3), (4.4, 0), (9, 0)]
    shut = make_world([*rooms, (9, 7), (4.4, 7), (4.4, 3.3), (4, 3.3), (4, 7), (0, 7)])
    goal = Goal(state=(7.0, 3.0, 0.0, 0.0))
    body = Discs((0,), (0.0,), (0.2,), CART.length, CART.hitch_offset)
    plan = plan_by_casadi(CART, (2.0, 3.0, 0.0, 0.0), goal, obstacles=shut, discs=body)
    assert (plan.method, plan.status, plan.converged) == ("casadi", "unreachable", False)
    assert calls == []
    with pytest.raises(InvalidInput, match="start"):
        plan_by_casadi(CART, (0.1, 0.1, 0.0, 0.0), goal, obstacles=shut)


def test_a_cart_at_its_goal_has_no_way_to_go(solved):
    calls = solved(WELL)
    plan = plan_by_casadi(CART, (8.1, 4.6, 0.8, 0.2), GOAL)
    assert told_of(plan) == ["casadi", "optimal", True, 0.0, 0.0, 0, 0.0, {}]
    assert plan.path.states.tolist() == [[8.1, 4.6, 0.8, 0.2]]
    assert calls == []


def test_without_seeds_there_is_no_path():
    plan = plan_by_casadi(CART, START, GOAL, seeds=[])
    assert (plan.status, plan.time, plan.residual) == ("no path found", math.inf, math.inf)
    for wrong in ({"intervals": 1}, {"max_iterations": 0}):
        with pytest.raises(InvalidInput, match=next(iter(wrong))):
            plan_by_casadi(CART, START, GOAL, **wrong)
