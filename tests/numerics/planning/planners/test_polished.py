"""Paths of least time with a table as a guide."""

import math
from dataclasses import replace

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.planning.arc_words.quickest import ArcWord, word_path
from sightfield.systems.numerics.planning.arc_words.shortened import end_of
from sightfield.systems.numerics.planning.extremals.planner import plan_by_extremals
from sightfield.systems.numerics.planning.goal import THESIS_TOLERANCE, Goal
from sightfield.systems.numerics.planning.lower_bound import lower_bound
from sightfield.systems.numerics.planning.minimum_time.planner import plan_by_casadi
from sightfield.systems.numerics.planning.minimum_time.problem import Attempt, Problem
from sightfield.systems.numerics.planning.plan import TrailerPath, driven_path
from sightfield.systems.numerics.planning.planners import chance, polished
from sightfield.systems.numerics.planning.planners.polished import plan_polished
from sightfield.systems.numerics.planning.trailer import Trailer
from sightfield.systems.numerics.planning.value_function.grid import StateGrid
from sightfield.systems.numerics.planning.value_function.solve import (
    open_field_table,
    solve_value_function,
)

PLACE = (4.0, 4.0, 0.0, 0.0)
BOX, POINT = Goal(state=PLACE, tolerance=THESIS_TOLERANCE), Goal(state=PLACE)
START = (1.0, 1.0, 0.0, 0.0)


@pytest.fixture(scope="module")
def value():
    """A coarse table, which is enough of a guide here; one that holds every start below."""
    goal = Goal(state=(0.0, 0.0, 0.0, 0.0), tolerance=(0.3, 0.3, 0.36, 0.36))
    return solve_value_function(Trailer(), goal, StateGrid.of_step(0.3))


@pytest.fixture
def few_drawn(monkeypatch):
    """One lot of words drawn at random, where other seeds lead to the best path too."""
    monkeypatch.setattr(chance, "SCATTERED", chance.LOT)
    monkeypatch.setattr(chance, "IN_GEAR", chance.LOT)


def random_starts(count, seed):
    rng = np.random.default_rng(seed)
    return rng.uniform([0, 0, -np.pi, -np.pi / 2], [6, 6, np.pi, np.pi / 2], (count, 4))


def miss_when_driven(plan, start, goal):
    held = zip(plan.path.controls, np.diff(plan.path.times), strict=True)
    pieces = [(v, omega, time) for (v, omega), time in held if time > 1e-12]
    return max(goal.miss(driven_path(Trailer(), start, pieces, 0.01).states[-1]))


def test_a_far_goal_is_met_as_soon_as_a_car_could():
    # Thirty-five turning radii, farther than any table; the trailer's angle is within the box on
    # every turn.
    cart = Trailer(speed=3.0, turn_rate=1.5, length=0.3, hitch_offset=-0.06)
    goal = Goal(state=(3.0, -2.0, 2.5, 0.0), tolerance=(0.4, 0.4, 0.251, 0.251))
    start = (50.0, -55.0, 2.1, 0.4)
    plan = plan_polished(cart, start, goal)
    assert plan.converged
    bound = lower_bound(cart, start, goal)
    assert bound <= plan.time <= (1 + 1e-3) * bound
    end = end_of(cart, start, ArcWord(plan.path.controls, np.diff(plan.path.times)))
    assert max(goal.miss(end)) < 1e-6


@pytest.mark.parametrize(("goal", "time"), [(BOX, 4.3476), (POINT, 5.9914)])
def test_the_thesis_case(value, goal, time):
    plan = plan_polished(Trailer(), START, goal, value=value)
    assert plan.converged
    assert plan.time == pytest.approx(time, abs=1e-4)
    assert plan.notes["fell_back"] == []
    assert plan.notes["table"] == value.grid.shape


@pytest.mark.parametrize("goal", [BOX, POINT])
def test_random_starts_are_as_quick_as_from_every_seed_and_end_at_the_goal(value, goal):
    for start in random_starts(5, 11):
        plan = plan_polished(Trailer(), start, goal, value=value)
        assert plan.time <= plan_by_casadi(Trailer(), start, goal).time * (1 + 1e-3)
        assert miss_when_driven(plan, start, goal) < 1e-6


def test_start_and_goal_may_be_moved_together(value):
    x, y, turn = 30.0, -7.0, 2.2
    c, s = math.cos(turn), math.sin(turn)

    def moved(state):
        return (
            x + c * state[0] - s * state[1],
            y + s * state[0] + c * state[1],
            state[2] + turn,
            state[3],
        )

    start = (2.0, 4.0, 1.0, -0.5)
    here = plan_polished(Trailer(), start, POINT, value=value)
    there = plan_polished(Trailer(), moved(start), Goal(state=moved(PLACE)), value=value)
    assert there.time == pytest.approx(here.time, rel=1e-6)


@pytest.mark.usefixtures("few_drawn")
def test_backwards_too():
    """A shift to the side by one turning radius; among many cusps, the best one is not promised."""
    trailer, goal = Trailer(reverse=True), Goal(state=(0.0, 1.0, 0.0, 0.0))
    start = (0.0, 0.0, 0.0, 0.0)
    plan = plan_polished(trailer, start, goal, step=0.5)
    assert plan.converged
    assert plan.time <= plan_by_casadi(trailer, start, goal).time * (1 + 5e-3)
    assert plan.time < plan_polished(Trailer(), start, goal, step=0.5).time


# A trailer that all but folds over and swings back; and one that is best backed up for forty
# metres, between turns that no other good way has. Where from, where to, the box's half width [m],
# and the best of the minimum-time programme from 60 or 100 seeds drawn at random [s].
HARD = [
    (
        Trailer(speed=0.432, turn_rate=0.199, length=1.6, hitch_offset=0.419),
        ((3.11, 7.48, -1.27, -2.83), (-3.88, 8.56, -0.968, 0.0), 0.435),
        43.8899,
    ),
    (
        Trailer(speed=1.3004, turn_rate=0.97912, length=10.387, hitch_offset=1.5896, reverse=True),
        ((39.484, 20.187, 2.4626, 0.64289), (2.2576, -6.2349, 2.2219, 0.0), 0.26562),
        46.793,
    ),
]


def assert_as_quick(cart, start, goal, best):
    plan = plan_polished(cart, start, goal)
    assert plan.converged
    assert plan.time <= best * (1 + 1e-4)
    end = end_of(cart, start, ArcWord(plan.path.controls, np.diff(plan.path.times)))
    assert max(goal.miss(end)) < 1e-6


@pytest.mark.parametrize(("cart", "question", "best"), HARD)
def test_no_seed_drawn_at_random_leads_to_a_quicker_path(cart, question, best):
    start, place, width = question
    goal = Goal(state=place, tolerance=(width, width, 0.251, 0.251))
    assert_as_quick(cart, start, goal, best)


def test_a_cusp_that_few_intervals_leave_out_is_put_in(monkeypatch):
    """The best of the minimum-time programme from seeds drawn at random takes 70.7599 s."""
    cart = Trailer(
        speed=0.4452, turn_rate=0.29213, length=8.4338, hitch_offset=-1.6729, reverse=True
    )
    start = (6.2471, 4.4437, -0.64702, -1.2804)
    goal = Goal(state=(7.3388, 5.1989, -2.0315, 0.0), tolerance=(0.30479, 0.30479, 0.251, 0.251))
    # Of the words that would be drawn, the only one that leads to this way.
    word = chance.scattered_words(cart, start, goal, chance.SCATTERED)[64]
    path = word_path(cart, start, word)
    monkeypatch.setattr(polished, "paths_by_chance", lambda _, solve, known: [solve(path)])
    # A table would take longer than all the rest.
    monkeypatch.setattr(polished, "open_field_table", lambda *question: None)
    assert_as_quick(cart, start, goal, 70.7599)


def test_an_optimum_is_not_given_up_for_a_path_at_which_the_search_did_not_end(monkeypatch):
    problem = Problem(Trailer(), np.array(START), BOX, 100)
    states = np.zeros((2, 4))
    found, quicker = (
        Attempt(TrailerPath(np.array([0.0, time]), states, np.zeros((1, 2))), 0.0, status, 1)
        for time, status in ((5.0, "optimal"), (4.9, "iteration limit"))
    )
    monkeypatch.setattr(polished, "_solved", lambda *question: quicker)
    monkeypatch.setattr(polished, "with_placed_switches", lambda *question: [])
    assert polished._with_more_switches(problem, found) is found


def test_without_a_table_car_paths_lead_on():
    """Free in x there is no table, as its grid is a square around the goal."""
    goal = Goal(state=PLACE, tolerance=(math.inf, 0.0, 0.1, 0.1))
    plan = plan_polished(Trailer(), START, goal)
    assert plan.converged
    assert plan.notes["table"] is None
    assert plan.notes["way"] in {"quickest word", "car path", "drawn word"}
    assert "other seeds only" in plan.notes["fell_back"][0]
    assert plan.time <= plan_by_casadi(Trailer(), START, goal).time * (1 + 1e-3)


def test_a_table_that_promises_nothing_is_done_without(value):
    blank = replace(value, table=np.full_like(value.table, np.inf))
    plan = plan_polished(Trailer(), START, BOX, value=blank)
    assert plan.time == pytest.approx(4.3476, abs=1e-4)
    assert plan.notes["fell_back"] == ["the table promises no way: other seeds only"]


def test_a_start_at_the_goal_takes_no_time(value):
    plan = plan_polished(Trailer(), (4.1, 4.0, 0.0, 0.0), BOX, value=value)
    assert (plan.method, plan.time, plan.converged) == ("polished", 0.0, True)


def test_the_jackknife_limit_is_kept(value):
    trailer = Trailer(jackknife=0.9)
    table = replace(value, trailer=trailer)
    plan = plan_polished(trailer, START, BOX, value=table)
    assert plan.converged
    assert np.abs(plan.path.states[:, 3]).max() <= 0.9 + 1e-9


def test_a_table_for_something_else_is_refused(value):
    with pytest.raises(InvalidInput, match="`value` must be for the same trailer"):
        plan_polished(Trailer(reverse=True), START, BOX, value=value)
    bent = Goal(state=(4.0, 4.0, 0.0, 0.3))
    with pytest.raises(InvalidInput, match="`value` must be for the same beta"):
        plan_polished(Trailer(), START, bent, value=value)
    with pytest.raises(InvalidInput, match="`start` must"):
        plan_polished(Trailer(), (math.nan, 0.0, 0.0, 0.0), BOX, value=value)


def test_one_table_serves_neighbouring_starts_and_every_goal():
    first = open_field_table(Trailer(), START, BOX, 0.5)
    turned = replace(BOX, state=(-9.0, 2.0, 1.0, 0.0))
    second = open_field_table(Trailer(), (-8.0, 3.0, 2.0, 0.4), turned, 0.5)
    assert second.table is first.table
    assert second.time_to_go(turned.state) == 0
    wider = open_field_table(Trailer(), (-9.0, 1.0, 0.0, 0.0), BOX, 0.5)
    assert wider.grid.holds(-13.0, 0.0)
    assert math.isfinite(wider.time_to_go((-9.0, 1.0, 0.0, 0.0)))
    assert open_field_table(Trailer(), (-90.0, 0.0, 0.0, 0.0), BOX, 0.5) is None


@pytest.mark.parametrize("off", [1e-3, 1e-6, 3e-7, 1e-8])
def test_just_beside_a_point_it_is_no_path_to_stay(off):
    """Ahead of the goal by a hair the cart has to come round; all planners say so alike."""
    goal = Goal(state=(2.0, 1.0, 0.4, 0.0))
    start = goal.from_frame([off, 0.0, 0.0, 0.0])
    asked = (Trailer(), start, goal)
    plans = [plan(*asked) for plan in (plan_polished, plan_by_casadi, plan_by_extremals)]
    assert [plan.time for plan in plans] == pytest.approx([9.4152] * 3, abs=2e-3)


def test_within_a_rounding_it_is_there():
    goal = Goal(state=(2.0, 1.0, 0.4, 0.0))
    start = goal.from_frame([5e-10, 0.0, 0.0, 0.0])
    asked = (Trailer(), start, goal)
    plans = [plan(*asked) for plan in (plan_polished, plan_by_casadi, plan_by_extremals)]
    assert [plan.time for plan in plans] == [0, 0, 0]


@pytest.mark.usefixtures("few_drawn")
def test_a_long_trailer_comes_from_afar_as_it_cannot_by_a_few_held_controls():
    """The best of 20 random seeds of the minimum-time programme takes 35.972 s."""
    cart = Trailer(speed=3.17, turn_rate=4.34, length=4.76, hitch_offset=-0.85, reverse=True)
    start = (-92.1, 25.1, 0.52, 1.1)
    goal = Goal(state=(0.5, 3.4, 2.83, 0.0), tolerance=(0.15, 0.15, 0.251, 0.251))
    plan = plan_polished(cart, start, goal)
    assert plan.converged
    assert plan.time < 35.972


@pytest.mark.usefixtures("few_drawn")
def test_within_a_jackknife_limit_a_trailer_does_not_wind(monkeypatch):
    """Words that turn the trailer right round seed the programme, but not past the limit."""
    # Words are what matters here, and a table would take as long as all of them.
    monkeypatch.setattr(polished, "open_field_table", lambda *question: None)
    cart = Trailer(reverse=True, jackknife=3.14)
    goal = Goal(state=(2.0, 2.0, 4.0, -0.5), tolerance=THESIS_TOLERANCE)
    plan = plan_polished(cart, (2.0, 2.0, 1.0, 0.5), goal)
    assert plan.converged
    # As quick as the minimum-time programme from its own seeds.
    assert plan.time < 5.2626
    assert np.abs(plan.path.states[:, 3]).max() <= 3.14 + 1e-6
    assert goal.reached(plan.path.states[-1])
