"""What planners do with paths, tables and passages is as recorded; their solver is a stub."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.planning.arc_words.quickest import ArcWord
from sightfield.systems.numerics.planning.footprint import covering_discs
from sightfield.systems.numerics.planning.goal import Goal
from sightfield.systems.numerics.planning.minimum_time.problem import Attempt, Problem
from sightfield.systems.numerics.planning.plan import TrailerPath, driven_path
from sightfield.systems.numerics.planning.planners import chance, polished, thesis_scheme
from sightfield.systems.numerics.planning.planners.from_table import (
    grid_within,
    plan_by_value_function,
    saved_by_narrow_passages,
    slimmed,
)
from sightfield.systems.numerics.planning.trailer import Trailer
from sightfield.systems.numerics.planning.value_function.grid import StateGrid
from sightfield.systems.numerics.planning.value_function.sweeps import FAR, LIMIT

FORWARD = Trailer(speed=1.7, turn_rate=0.9, length=1.3, hitch_offset=0.25)
REVERSE = Trailer(
    speed=1.2, turn_rate=1.1, length=1.5, hitch_offset=-0.2, reverse=True, jackknife=1.3
)
START = (0.4, -0.9, 0.3, 0.2)
GOAL = Goal(state=(3.0, 2.0, 0.9, 0.1), tolerance=(0.3, 0.4, 0.3, 0.4))
GRID = StateGrid(
    x_min=-2.0, y_min=-3.0, step=0.7, x_count=11, y_count=12, theta_count=12, beta_count=10
)


class Asked:
    """A solver that takes a path as it is; how often it is one depends on its number."""

    def __init__(self, every):
        self.every, self.paths = every, []

    def __call__(self, path):
        self.paths.append(path)
        violation = 0.0 if len(self.paths) % self.every == 0 else 1.0
        return Attempt(path, violation, "optimal", 1)


@pytest.mark.parametrize("cart", [FORWARD, REVERSE], ids=["forward", "reverse"])
@pytest.mark.parametrize(("every", "away"), [(1, 1.0), (3, 1.0), (3, 9.0)])
def test_paths_drawn_by_chance_are_as_recorded(every, cart, away, as_recorded):
    goal = Goal(state=(away * 3.0, away * 2.0, 0.9, 0.1), tolerance=GOAL.tolerance)
    problem, solve = Problem(cart, np.array(START), goal, 9), Asked(every)
    known = [
        Attempt(driven_path(cart, START, pieces), violation, "optimal", 1)
        for violation, pieces in (
            (0.0, [(cart.speed, 0.3, 2.0 * away), (cart.speed, -0.2, 1.1 * away)]),
            (1.0, [(cart.speed, 0.0, 0.5)]),
            (0.0, [(-cart.speed, 0.3, 3.0 * away)]),
        )
    ]
    found = chance.paths_by_chance(problem, solve, known)
    assert len(found) == len(solve.paths)
    as_recorded([len(found), np.array([each.time for each in found])])
    last = [[path.times[-1], path.states[-1], path.controls[0]] for path in solve.paths[-9:]]
    as_recorded(last, "last")


@pytest.mark.parametrize(("away", "lots"), [(23.9, 1), (24.0, 2)])
def test_lots_are_drawn_until_the_quickest_path_is_met_often(away, lots):
    """Near a goal both gears are asked together, and far from it each for itself."""
    cart = Trailer(speed=2.0, reverse=True)
    problem = Problem(cart, np.zeros(4), Goal(state=(away, 0, 0, 0)), 9)
    paths = {gear: driven_path(cart, START, [(gear, 0.1, 4.0)]) for gear in (1, -1)}
    asked = []

    def solve(path):
        asked.append(path)
        return Attempt(paths[1 if len(asked) % 2 else -1], 0.0, "optimal", 1)

    chance.paths_by_chance(problem, solve, [])
    assert len(asked) // chance.LOT == lots


@pytest.mark.parametrize("gears", [(1,), (1, -1)])
def test_each_gear_is_asked_for_its_quickest_path(gears):
    def driven(time, gear):
        return Attempt(driven_path(REVERSE, START, [(gear, 0.1, time)]), 0.0, "optimal", 1)

    def often(drawn, known=()):
        return chance._met_often(
            [driven(*each) for each in drawn], [driven(*each) for each in known], gears
        )

    both = len(gears) == 2
    thrice = [(4.0, 1.0), (4.003, 1.0), (4.0039, 1.0)]
    assert not often([])
    assert not often(thrice[:2])
    assert often(thrice) is not both
    assert not often([*thrice[:2], (4.005, 1.0)])
    assert not often(thrice, [(3.9, 1.0)])
    # A gear that takes a quarter longer is left, and one that is not known is not.
    assert often(thrice, [(5.01, -1.0)])
    assert often(thrice, [(4.99, -1.0)]) is not both
    assert often([*thrice, (4.5, -1.0), (4.501, -1.0), (4.502, -1.0)])


def test_halves_of_paths_are_as_recorded(as_recorded):
    goal = Goal(state=(30.0, 20.0, 0.9, 0.1))
    problem = Problem(REVERSE, np.array(START), goal, 9)
    paths = [
        driven_path(REVERSE, START, pieces, 0.9)
        for pieces in (
            [(1.2, 0.05, 9.0), (1.2, -0.03, 13.0), (-1.2, 0.2, 3.0)],
            [(1.2, 0.05, 11.0), (1.2, -0.02, 11.0)],
            [(-1.2, 0.1, 3.0), (1.2, 0.02, 26.0), (1.2, -0.3, 2.0)],
            [(1.2, 0.03, 12.0), (-1.2, 0.0, 2.0), (1.2, 0.01, 17.0)],
            [(1.2, 0.5, 1.0)],
            [(1.2, 0.3, 3.0), (-1.2, 0.05, 28.0)],
            [(-1.2, -0.4, 2.0), (-1.2, 0.03, 29.0), (1.2, -0.3, 1.0)],
        )
    ]
    for gear in (1, -1):
        halves = [chance._halves(problem, path, gear) for path in paths]
        as_recorded(
            [None if each is None else [each.middle, each.before, each.after] for each in halves],
            f"in gear {gear}",
        )
        attempts = [Attempt(path, 0.0, "optimal", 1) for path in paths]
        joined = list(chance._put_together(problem, attempts, gear))
        as_recorded([[each.times[-1], each.states[-1]] for each in joined], f"joined {gear}")


def test_no_two_that_are_chosen_take_nearly_as_long():
    path = driven_path(REVERSE, START, [(1.0, 0.0, 1.0)])
    halves = [chance._Halves(path, 1, time, 0.0) for time in (3.0, 2.0, 2.1, 2.6, 4.0, 2.5)]
    chosen = chance._quickest(halves, lambda half: half.before, 0.2)
    assert [each.before for each in chosen] == [2.0, 2.5, 3.0]


@pytest.mark.parametrize("length", [1.0, 3.2])
def test_averages_are_as_recorded(length, as_recorded):
    cart = Trailer(speed=1.7, turn_rate=0.9, length=length, hitch_offset=0.25)
    goal = Goal(state=(1.5, 0.5, 0.4, 0.2), tolerance=(0.8, 0.7, 0.6, 0.7))
    passes = []
    value = thesis_scheme.solve_by_averaging(
        cart, goal, GRID, step=0.07, progress=lambda *told: passes.append(told)
    )
    as_recorded(value.table.astype(float), relative=1e-5)
    as_recorded([value.sweeps, value.converged, value.warnings, value.scheme], "passes")
    assert [number for number, _ in passes] == list(range(1, value.sweeps + 1))
    assert passes[-1][1] == value.residual
    told = [
        [thesis_scheme._nearest(value, state), thesis_scheme._turn(value, state)]
        for state in np.random.default_rng(71).uniform([-3, -4, -4, -2], [6, 6, 4, 2], (40, 4))
    ]
    as_recorded(told, "at states", relative=1e-5)
    plans = [
        thesis_scheme.plan_by_averaging(cart, start, goal, value=value)
        for start in ((-0.5, -0.5, 0.3, 0.1), (-0.9, 1.5, -0.2, 0.4), (1.5, 0.5, 0.4, 0.2))
    ]
    as_recorded(
        [
            [plan.status, plan.converged, plan.time, plan.notes]
            + ([] if plan.path is None else [plan.path.states[-1], plan.path.controls])
            for plan in plans
        ],
        "plans",
    )


@pytest.mark.parametrize("upwards", [True, False])
@pytest.mark.parametrize("along", [True, False])
def test_one_pass_of_averages_is_as_recorded(upwards, along, as_recorded):
    rng = np.random.default_rng(72)
    table = (3 * rng.random((8, 8, 8, 9))).astype(np.float32)
    table[rng.random(table.shape) < 0.3] = FAR
    table[3:5, 2:4, 3:5, 4:6] = 0.0
    grid = StateGrid(
        x_min=0.0, y_min=0.0, step=0.7, x_count=9, y_count=8, theta_count=8, beta_count=8
    )
    signs = thesis_scheme._signs(grid, Trailer(length=0.8, hitch_offset=0.1))
    first = thesis_scheme._pass(table, *signs, np.float32(0.06), upwards, along)
    assert first > LIMIT
    as_recorded([*signs, np.where(table < LIMIT, table, np.inf).astype(float)], relative=1e-5)
    change = thesis_scheme._pass(table, *signs, np.float32(0.06), upwards, along)
    as_recorded(float(change), "change", relative=1e-5)


ROOMS = [
    *[(0, 0), (4, 0), (4, 3), (4.4, 3), (4.4, 0), (9, 0)],
    *[(9, 7), (4.4, 7), (4.4, 3.85), (4, 3.85), (4, 7), (0, 7)],
]
PILLARS = [
    [(2.0, 1.0), (3.0, 1.0), (3.0, 6.4), (2.0, 6.4)],
    [(6.0, 1.1), (6.5, 1.1), (6.5, 5.0), (6.0, 5.0)],
]


def test_what_narrow_passages_save_is_as_recorded(as_recorded):
    world, discs = make_world(ROOMS, PILLARS), covering_discs(FORWARD, 0.6)
    ends = [((1.0, 3.0), (8.0, 3.3)), ((1.0, 6.0), (3.6, 6.0)), ((0.1, 0.1), (1.0, 6.9))]
    told = [
        [saved_by_narrow_passages(world, discs, step, *each) for each in ends]
        for step in (0.1, 0.24, 0.4, 0.9)
    ]
    as_recorded(told)
    as_recorded([slimmed(discs, step).radii[0] for step in (0.2, 0.5, 0.7, 2.0)], "slimmed")
    for step in (0.2, 0.31):
        as_recorded(grid_within(world, FORWARD, GOAL, step), f"grid of {step}")


@pytest.mark.parametrize("tolerance", [(1.0, 1.1, 0.7, 0.7), (0.3, 1.0, 0.7, 0.7)])
def test_plans_from_a_table_are_as_recorded(tolerance, as_recorded):
    goal = Goal(state=GOAL.state, tolerance=tolerance)
    plan = plan_by_value_function(FORWARD, START, goal, step=0.5, polish=1)
    notes = {key: each for key, each in plan.notes.items() if key != "value_function"}
    as_recorded([plan.status, plan.converged, plan.time, plan.iterations, notes], relative=1e-4)
    value = plan.notes["value_function"]
    away = plan_by_value_function(
        FORWARD, (90.0, 0.0, 0.0, 0.0), Goal(state=(0, 0, 0, 0.1), tolerance=tolerance), value=value
    )
    as_recorded([away.status, away.converged, away.time, away.path is None], "off the grid")


@pytest.mark.parametrize("cart", [FORWARD, REVERSE], ids=["forward", "reverse"])
@pytest.mark.parametrize("width", [0.0, 0.3])
def test_seeds_of_polished_plans_are_as_recorded(cart, width, as_recorded, monkeypatch):
    """Every attempt of the programme is the path that it was asked to begin with."""
    monkeypatch.setattr(polished, "open_field_table", lambda *question: None)
    asked = []

    def solve(self, guess):
        steps = np.repeat(guess.durations * len(guess.durations) / len(guess.controls), 1)
        each = np.repeat(steps, len(guess.controls) // len(guess.durations))
        times = np.append(0.0, np.cumsum(each))
        asked.append([times[-1], len(each), self.max_iterations, *guess.states[-1]])
        violation = 0.0 if len(asked) % 2 else 1.0
        return Attempt(TrailerPath(times, guess.states, guess.controls), violation, "optimal", 2)

    monkeypatch.setattr(Problem, "solve", solve)
    goal = Goal(state=GOAL.state, tolerance=(width, width, width, width))
    plan = polished.plan_polished(cart, START, goal)
    as_recorded([plan.status, plan.time, plan.iterations, plan.notes], "plan", relative=1e-3)
    as_recorded([len(asked), np.array([each[1:3] for each in asked])], "asked")
    as_recorded([each[0] for each in asked[:3]], "first", relative=1e-3)


@pytest.mark.parametrize(
    ("trailer", "start", "ways", "many"),
    [
        (Trailer(length=1.5), (0, 0, 0, 1.5), [None], False),
        (Trailer(length=1.51), (0, 0, 0, 0), [None], True),
        (Trailer(length=2.9, speed=2.0), (0, 0, 0, 0), [None], False),
        (Trailer(length=2.9, speed=2.0, turn_rate=1.1), (0, 0, 0, 0), [None], True),
        (Trailer(), (0, 0, 0, 1.58), [None], True),
        (Trailer(), (0, 0, 0, -1.58 + math.tau), [None], True),
        (Trailer(reverse=True), (0, 0, 0, 0), [None], True),
        (Trailer(), (0, 0, 0, 0), [], True),
    ],
)
def test_which_questions_have_many_optima(trailer, start, ways, many):
    problem = Problem(trailer, np.array(start, dtype=float), GOAL, 9)
    assert polished._has_many_optima(problem, ways) is many


def test_words_that_take_as_long_are_one():
    times = [2.0, 2.0 * (1 + polished._ALIKE), 2.0001, 3.0, 3.0]
    words = [ArcWord(np.ones((1, 2)), np.array([time])) for time in times]
    assert [word.time for word in polished._unlike(words)] == [2.0, 2.0001, 3.0]


@pytest.mark.parametrize("cart", [FORWARD, REVERSE], ids=["forward", "reverse"])
def test_paths_of_a_car_are_taken_up_to_a_length_as_recorded(cart, as_recorded):
    problem = Problem(cart, np.array(START), GOAL, 9)
    told = [
        [[path.times[-1], path.states[-1]] for path in polished._car_paths(problem, longest, most)]
        for longest, most in ((math.inf, 3), (9.0, 20), (0.1, 3))
    ]
    as_recorded(told, relative=1e-5)
    assert told[2] == []
