"""Seeds, guesses, single runs of the programme and what is done with them are as recorded."""

import math
from dataclasses import dataclass, field

import casadi as ca
import numpy as np
import pytest

from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.planning.car_paths import CarPath
from sightfield.systems.numerics.planning.footprint import covering_discs
from sightfield.systems.numerics.planning.goal import Goal
from sightfield.systems.numerics.planning.minimum_time import programme, seeds
from sightfield.systems.numerics.planning.minimum_time.clearance import (
    FacedWalls,
    distance_spline,
    faced_walls,
)
from sightfield.systems.numerics.planning.minimum_time.kept_clear import (
    Kept,
    best_kept_clear,
    kept_clear,
    overlaps_by_interval,
)
from sightfield.systems.numerics.planning.minimum_time.planner import _commonest, plan_by_casadi
from sightfield.systems.numerics.planning.minimum_time.problem import (
    Attempt,
    Problem,
    near_best,
    nearest_goal_state,
    resampled,
    split_into_arcs,
    with_placed_switches,
)
from sightfield.systems.numerics.planning.plan import TrailerPath, driven_path
from sightfield.systems.numerics.planning.trailer import Trailer, held_states

CART = Trailer(speed=1.3, turn_rate=0.8, length=1.1, hitch_offset=0.25)
BACK = Trailer(speed=1.3, turn_rate=1.6, length=0.9, hitch_offset=-0.2, reverse=True, jackknife=1.2)
CARTS = pytest.mark.parametrize("cart", [CART, BACK], ids=["forward", "reverse"])
START = (1.0, 1.2, 0.3, 0.2)
GOAL = Goal(state=(8.0, 4.6, 0.8, 0.1), tolerance=(0.3, 0.2, 0.2, 0.3))
FIELD = make_world(
    [(-1.0, -0.8), (11.0, -1.0), (10.8, 7.5), (-0.9, 7.3)],
    [[(3.5, 1.0), (4.4, 1.1), (4.2, 4.8)], [(5.8, 3.1), (6.3, 3.0), (6.4, 7.0), (5.9, 7.1)]],
)
PIECES = [(1.3, 0.8, 1.1), (1.3, 0.1, 2.7), (1.3, -0.8, 0.9)]


def path_told(path):
    return [path.times, path.states, path.controls]


def test_an_interval_ends_where_the_closed_form_says():
    state, control, step = ca.SX.sym("state", 4), ca.SX.sym("control", 2), ca.SX.sym("step")
    rng = np.random.default_rng(61)
    for length, hitch in ((1.1, 0.25), (0.02, 0.0), (2.5, -0.9)):
        cart = Trailer(length=length, hitch_offset=hitch)
        advance = ca.Function(
            "a", [state, control, step], [programme._advanced(state, control, step, cart)]
        )
        for _ in range(20):
            at, held = rng.uniform(-1.5, 1.5, 4), float(rng.uniform(0.05, 1.5))
            v, omega = rng.uniform(-1, 1, 2) * rng.choice([1.0, 1e-3], 2)
            v = abs(v) if length < 1 else v
            expected = held_states(cart, at, (v, omega), held, 40)[-1]
            found = np.array(advance(at, [v, omega], held)).ravel()
            np.testing.assert_allclose(found, expected, atol=1e-9)
        # Where a series stands for the function, on either side of its end.
        for v, omega, held in (
            *((1.0, 0.0, length * share) for share in (0.0189, 0.021)),
            *((0.0, 1.0, share) for share in (0.0185, 0.0199, 0.021)),
            *((1.0, 1.0, share) for share in (1.9e-4, 2.1e-4)),
            (1.0, 0.009, 0.02),
        ):
            expected = held_states(cart, at, (v, omega), held, 1)[-1]
            found = np.array(advance(at, [v, omega], held)).ravel()
            np.testing.assert_allclose(found, expected, atol=1e-13)
        for v, omega in ((1.0, 0.0), (0.0, 1.0), (0.0, 0.0)):
            expected = held_states(cart, at, (v, omega), 0.4, 40)[-1]
            found = np.array(advance(at, [v, omega], 0.4)).ravel()
            np.testing.assert_allclose(found, expected, atol=1e-9)


@pytest.mark.parametrize("near", [None, 0.7, 9.0])
def test_resampled_paths_are_as_recorded(near, as_recorded):
    path = driven_path(CART, START, PIECES, 0.4)
    as_recorded(resampled(path, 7, near))


def test_arcs_of_a_solution_are_as_recorded(as_recorded):
    # A switch within an interval, one that is no switch, and a singular arc.
    turns = [0.8] * 5 + [0.3] + [-0.8] * 4 + [0.2] + [-0.8] * 3 + [0.1, 0.11, 0.12] + [0.7993] * 2
    times = np.append(0.0, np.cumsum(np.linspace(0.11, 0.19, len(turns))))
    states = np.random.default_rng(62).normal(size=(len(times), 4)).cumsum(axis=0)
    path = TrailerPath(times, states, np.column_stack([np.full(len(turns), 1.3), turns]))
    guess = split_into_arcs(path, CART, 3)
    as_recorded(guess)
    assert guess.durations.sum() == pytest.approx(times[-1])
    two = split_into_arcs(TrailerPath(times[:3], states[:3], path.controls[4:6]), CART, 2)
    as_recorded(two, "two")


def test_angles_of_a_goal_are_those_nearest_a_state():
    goal = Goal(state=(1.0, 2.0, 0.5, -0.3))
    found = nearest_goal_state(goal, np.array([0.0, 0.0, 7.0, -6.0]))
    np.testing.assert_allclose(found, [1.0, 2.0, 0.5 + math.tau, -0.3 - math.tau])


def attempt(time, status="optimal", violation=0.0, states=None):
    states = np.zeros((2, 4)) if states is None else states
    path = TrailerPath(np.linspace(0.0, time, len(states)), states, np.ones((len(states) - 1, 2)))
    return Attempt(path, violation, status, 3)


def test_the_best_attempts_are_those_within_a_hundredth():
    times = [3.0, 3.02, 3.031, 3.00001, 3.0301, 3.029]
    found = near_best([attempt(time) for time in times])
    assert [each.time for each in found] == [3.0, 3.02, 3.029]
    assert attempt(3.0, violation=1e-6).is_path
    assert not attempt(3.0, violation=1.1e-6).is_path
    assert attempt(9.0).rank < attempt(3.0, "iteration limit").rank


def test_the_commonest_failure_is_told():
    assert _commonest(["optimal", "a", "b", "b"]) == "b"
    assert _commonest(["optimal"]) == "no path found"


@CARTS
@pytest.mark.parametrize("world", [None, FIELD], ids=["open", "walled"])
def test_seeds_are_as_recorded(cart, world, as_recorded):
    discs = None if world is None else covering_discs(cart, 0.6)
    goal = GOAL if cart is CART else Goal(state=GOAL.state)
    problem = Problem(cart, np.array(START), goal, 9, world, discs)
    groups = seeds.default_seeds(problem)
    as_recorded([[path_told(each) for each in group] for group in groups], relative=1e-5)
    if world is not None:
        for extra in (1.1, 1.6):
            as_recorded(seeds.detours(world, 0.3, START[:2], (8.0, 4.6), extra), f"by {extra}")
        snug = seeds.detours(world, 0.3, (3.4, 1.1), (10.6, 7.2))
        as_recorded(snug, "from beside a wall")


def test_a_seed_with_cusps_is_as_recorded(as_recorded):
    pieces = [
        CarPath((1.0, 2.0, 0.5), (1, 0, -1), (1.0, -2.0, 0.5), 2.0),
        CarPath((0.5, 1.0, 0.6), (-1, 1), (0.01, 0.02), 2.0),
    ]
    as_recorded(path_told(seeds.seed_along(pieces, BACK, (0.4, -0.3))))


@CARTS
@pytest.mark.parametrize("near", [None, 1.5])
def test_first_steps_of_the_programme_are_as_recorded(cart, near, as_recorded):
    """In the open: bounds, scales and the weight of time act on the first iterates."""
    problem = Problem(cart, np.array(START), GOAL, 3)
    seed = seeds.default_seeds(problem)[0][0]
    found = problem.solve(resampled(seed, 9, near))
    as_recorded([path_told(found.path), found.status, found.iterations], relative=1e-4)
    if math.isfinite(found.violation):
        as_recorded(found.violation, "violation", relative=1e-3)
    as_recorded(found.accepted, "accepted")


def test_held_controls_and_free_ones_are_as_recorded(as_recorded):
    problem = Problem(BACK, np.array(START), GOAL, 200)
    seed = driven_path(BACK, START, [(1.3, 0.6, 1.1), (1.3, 1.6, 0.5), (-1.3, -1.6, 0.8)], 0.3)
    guess = split_into_arcs(seed, BACK, 3)
    as_recorded([*problem._control_bounds(guess), *problem._state_bounds(guess)])


def test_first_steps_among_walls_are_as_recorded(as_recorded):
    problem = Problem(CART, np.array(START), GOAL, 3, FIELD, covering_discs(CART, 0.6))
    seed = seeds.default_seeds(problem)[0][-1]
    guess = resampled(seed, 10)
    found = problem.solve(guess)
    as_recorded([path_told(found.path), found.status], "by the spline", relative=1e-4)
    margins = np.linspace(0.0, 0.04, 10)
    found = problem.solve_beside_walls(guess, margins, 0.2)
    as_recorded([path_told(found.path), found.status], "beside walls", relative=1e-4)
    as_recorded(found.violation > 1e-3, "violation")
    as_recorded(overlaps_by_interval(problem, seed), "overlaps")


def test_free_room_is_as_recorded(as_recorded):
    rng = np.random.default_rng(63)
    discs = covering_discs(CART, 0.6)
    states = rng.uniform((0, 0, -3, -1), (10, 6.5, 3, 1), (25, 4))
    walls = faced_walls(FIELD, discs, states)
    as_recorded(walls, "walls")
    exact = FacedWalls(discs, 1.625, looks=2).function()
    spline = distance_spline(FIELD, discs, 1.625).function()
    scale = [1.625, 1.625, 1.0, 1.0]
    rooms = [
        np.array(exact(state, ends.T / 1.625)).ravel()
        for state, ends in zip(states / scale, walls, strict=True)
    ]
    as_recorded(rooms, "beside walls")
    pose = (1.0, 2.0, 0.4)
    as_recorded(
        [np.array(spline(state, pose)).ravel() for state in states / scale / 2], "by the spline"
    )


@pytest.mark.parametrize("width", [0.0, 0.3])
@CARTS
def test_plans_are_as_recorded(cart, width, as_recorded):
    goal = Goal(state=GOAL.state, tolerance=(width, width, 0.2 if width else 0.0, width))
    plan = plan_by_casadi(cart, START, goal, intervals=18)
    as_recorded([plan.status, plan.converged, plan.time, plan.residual < 1e-6], relative=1e-5)


@dataclass(frozen=True, eq=False)
class Scripted(Problem):
    """A problem whose solver beside walls answers as it was told to."""

    script: list[tuple] = field(default_factory=list)
    asked: list[tuple[float, float, float, int]] = field(default_factory=list)

    def solve_beside_walls(self, guess, margins, reach):
        self.asked.append((reach, float(margins.sum()), float(margins.max()), len(margins)))
        answer = self.script[min(len(self.asked), len(self.script)) - 1]
        return along_wall(*answer, intervals=len(margins))


WALL = make_world([(-5.0, -0.5), (30.0, -0.5), (30.0, 9.0), (-5.0, 9.0)])
DISCS = covering_discs(Trailer(length=1.0), 0.8)


def along_wall(time, room, status="optimal", violation=0.0, intervals=6):
    """An attempt that is driven straight beside a wall and leaves it a room [m]."""
    piece = (1.0, 0.0, time)
    path = driven_path(Trailer(), (0.0, -0.1 + room, 0.0, 0.0), [piece], time / intervals)
    return Attempt(path, violation, status, 7)


@pytest.mark.parametrize(
    "script",
    [
        [(6.0, 0.01), (5.8, 0.0), (5.79, -1e-4), (5.789, 0.0), (5.789, 0.0)],
        [(6.0, -0.3), (6.0, -0.1), (5.9, -0.02), (5.9, -0.01), (5.9, -0.004), (5.9, 0.0)],
        [(6.0, -0.01, "iteration limit"), (6.0, 0.0, "optimal", 1.0), (5.99, 0.02)],
        [(6.0, 0.1, "optimal", 1.0)],
        [(6.0, -0.01)],
        [(6.0, -1e-5), (5.9, -1e-5), (5.9, -1e-5)],
        [(6.0, 0.0, "iteration limit")],
        [(6.0, 0.0, "optimal", 0.9**k) for k in range(1, 4)],
        [(6.0 * 0.98**k, 1e-3) for k in range(9)],
        [(6.0, -0.19), (6.0, -0.21), (6.0, 4e-6 - 2e-5), (5.95, 0.0), (5.93, 0.0), (5.93, 0.0)],
    ],
)
def test_runs_beside_walls_are_as_recorded(script, as_recorded):
    """How far a path may move, and how far it is to keep off, from one run to the next."""
    given = along_wall(6.1, 0.01)
    ends = Goal(state=(6.0, 0.0, 0.0, 0.0))
    problem = Scripted(Trailer(length=1.25), given.path.states[0], ends, 9, WALL, DISCS, script)
    found = kept_clear(problem, given.path, 6, 14, 1e-3)
    as_recorded(problem.asked, "asked")
    as_recorded([[each.attempt.time, each.overlap] for each in found], "found", absolute=1e-7)


@pytest.mark.parametrize("known", [math.inf, 6.05, 5.5])
def test_the_best_path_kept_clear_is_as_recorded(known, as_recorded):
    attempts = [
        along_wall(6.0, 0.02),
        along_wall(5.999999, 0.02),
        along_wall(5.9, -0.15),
        along_wall(5.8, -0.25),
        along_wall(6.2, 0.5),
        along_wall(6.3, 0.01, violation=0.1),
        along_wall(5.7, 0.01, "iteration limit"),
    ]
    answers = [(5.98, 0.0), (5.97, -5e-4), (5.97, 1e-3)]
    ends = Goal(state=(6.0, 0.0, 0.0, 0.0))
    problem = Scripted(Trailer(length=1.25), np.zeros(4), ends, 9, WALL, DISCS, answers)
    best, iterations = best_kept_clear(problem, attempts, known)
    told = None if best is None else [best.attempt.time, best.attempt.status, best.overlap]
    as_recorded([told, iterations, problem.asked], absolute=1e-7)


def test_a_path_is_clear_that_overlaps_by_a_thousandth_of_the_trailer():
    problem = Problem(Trailer(length=2.0), np.zeros(4), GOAL, 9)
    ranks = []
    for overlap, clear, touches in (
        (-1.0, True, False),
        (2e-5, True, False),
        (2.1e-5, True, True),
        (2e-3, True, True),
        (2.1e-3, False, True),
    ):
        kept = Kept(attempt(3.0), overlap)
        assert kept.is_clear(problem) is clear
        assert kept.rank(problem) == (not clear, touches, False, 3.0)
        ranks.append(kept.rank(problem))
    assert ranks == sorted(ranks)


def test_overlaps_of_a_path_that_is_none_are_infinite():
    problem = Problem(Trailer(), np.zeros(4), GOAL, 9, WALL, DISCS)
    still = TrailerPath(np.zeros(3), np.zeros((3, 4)), np.ones((2, 2)))
    assert overlaps_by_interval(problem, still).tolist() == [math.inf, math.inf]
    lost = TrailerPath(np.arange(3.0), np.full((3, 4), math.nan), np.ones((2, 2)))
    assert overlaps_by_interval(problem, lost).tolist() == [math.inf, math.inf]


def test_switches_are_placed_where_few_arcs_leave_a_choice(monkeypatch):
    asked = []
    monkeypatch.setattr(
        Problem, "solve", lambda self, guess: asked.append(len(guess.durations)) or attempt(1.0)
    )
    for count, tolerance, placed in (
        (10, (0.2, 0.2, 0.2, 0.2), True),
        (11, (0.2, 0.2, 0.2, 0.2), False),
        (4, (0.0, 0.0, 0.0, 0.0), True),
        (3, (0.0, 0.0, 0.0, 0.0), False),
        (3, (0.0, 0.0, 0.0, 0.1), True),
    ):
        pieces = [(1.3, 0.8 if k % 2 else -0.8, 0.4) for k in range(count)]
        path = driven_path(CART, START, pieces, 0.1)
        problem = Problem(CART, np.array(START), Goal(state=GOAL.state, tolerance=tolerance), 9)
        asked.clear()
        found = with_placed_switches(problem, [Attempt(path, 0.0, "optimal", 1)])
        assert (asked == [count]) is placed
        assert len(found) == placed
