"""The best extremal: a way to the goal, its costates, and how long it takes."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.planning.car_paths import dubins_paths
from sightfield.systems.numerics.planning.extremals.arcs import Arc, arc_samples
from sightfield.systems.numerics.planning.extremals.planner import extremal_of, plan_by_extremals
from sightfield.systems.numerics.planning.extremals.primitives import plan_by_primitives
from sightfield.systems.numerics.planning.goal import Goal
from sightfield.systems.numerics.planning.minimum_time.planner import plan_by_casadi
from sightfield.systems.numerics.planning.trailer import Trailer

START = np.array([0.0, 0.0, 0.0, 0.0])
# From (1, 1, 0, 0) to (4, 4, 0, 0) with beta = 0 exactly, solved to 1e-9.
OPTIMAL = [
    Arc(1.0, 1.87719826),
    Arc(-0.14442723, 1.13981701, True),
    Arc(-1.0, 2.28956143),
    Arc(1.0, 0.68479731),
]


def driven_states(start, arcs):
    """States along arcs, at the times of an extremal."""
    states, at = [], start
    for arc in arcs:
        states.append(arc_samples(at, arc)[1])
        at = states[-1][-1]
    return np.concatenate(states)


def test_the_costate_solves_its_own_equations():
    """Its rates are minus the derivatives of H (3.22), with the states integrated apart from it."""
    found = extremal_of(START, OPTIMAL, False)
    states = driven_states(START, OPTIMAL)
    _, _, theta, beta = states.T
    rates = np.column_stack(
        [
            np.zeros_like(theta),
            np.zeros_like(theta),
            found.costates[:, 0] * np.sin(theta) - found.costates[:, 1] * np.cos(theta),
            found.costates[:, 3] * np.cos(beta),
        ]
    )
    steps = np.diff(found.times)[:, None]
    means = (rates[1:] + rates[:-1]) / 2
    # The trapezium rule errs by the cube of a step.
    np.testing.assert_allclose(np.diff(found.costates, axis=0), steps * means, atol=2e-5)
    east, north, turn, along_beta = found.costates.T
    omega = np.concatenate([arc_samples(at, arc)[2] for at, arc in begun(OPTIMAL)])
    hamiltonian = east * np.cos(theta) + north * np.sin(theta) - along_beta * np.sin(beta)
    hamiltonian += omega * (turn + along_beta)
    assert found.hamiltonian == pytest.approx(hamiltonian, abs=1e-9)
    assert np.ptp(found.hamiltonian) < 1e-6


def begun(arcs):
    """Each arc with the state in which it begins."""
    at, found = START, []
    for arc in arcs:
        found.append((at, arc))
        at = arc_samples(at, arc)[1][-1]
    return found


@pytest.mark.parametrize("at", [0.0, 1.2, 2.5])
def test_costates_are_how_the_time_to_go_falls(at):
    """Minus the gradient of the least time, by central differences of plans from beside."""
    found, states = extremal_of(START, OPTIMAL, False), driven_states(START, OPTIMAL)
    k = int(np.argmin(np.abs(found.times - at)))
    x, y, theta, beta = states[-1].tolist()
    goal, nudge = Goal(state=(x, y, theta, beta)), 1e-4

    def least_time(state):
        return plan_by_extremals(Trailer(), state, goal).time

    assert least_time(states[k]) == pytest.approx(found.times[-1] - found.times[k], abs=1e-6)
    slopes = [
        (least_time(states[k] + side) - least_time(states[k] - side)) / (2 * nudge)
        for side in nudge * np.eye(4)
    ]
    np.testing.assert_allclose(found.costates[k], -np.array(slopes), atol=2e-3)


def test_the_switching_function_vanishes_along_the_singular_arc_and_at_the_switch():
    found = extremal_of(START, OPTIMAL, False)
    ends = np.cumsum([arc.duration for arc in OPTIMAL])
    on_singular = (found.times >= ends[0]) & (found.times <= ends[1])
    assert found.switching[on_singular] == pytest.approx(0, abs=1e-9)
    at_switch = np.abs(found.times - ends[2]) < 1e-9
    assert found.switching[at_switch] == pytest.approx(0, abs=1e-6)
    assert np.all(found.switching[found.times < ends[0] - 0.1] > 0)
    assert found.hamiltonian == pytest.approx(1, abs=1e-6)
    assert found.holds


def test_a_switch_out_of_place_is_noticed():
    early = [*OPTIMAL[:2], Arc(-1.0, 2.0), OPTIMAL[3]]
    assert not extremal_of(START, early, False).holds


def test_a_singular_arc_with_another_turn_rate_is_not_extremal():
    crooked = [OPTIMAL[0], Arc(-0.3, 1.0, True), *OPTIMAL[2:]]
    assert not extremal_of(START, crooked, False).holds


def test_car_paths_are_extremal_where_beta_is_free():
    straight = [Arc(1.0, 1.0), Arc(0.0, 2.0, True), Arc(-1.0, 1.5)]
    assert extremal_of(START, straight, True).holds
    three_turns = [Arc(1.0, 0.7), Arc(-1.0, 4.0), Arc(1.0, 0.9)]
    assert extremal_of(START, three_turns, True).holds
    # Of three turns the middle one is longer than half a circle.
    assert not extremal_of(START, [Arc(1.0, 1.5), Arc(-1.0, 2.0), Arc(1.0, 1.5)], True).holds


def test_mirrored_paths_have_mirrored_costates():
    mirrored = [arc._replace(omega=-arc.omega) for arc in OPTIMAL]
    left, right = extremal_of(START, OPTIMAL, False), extremal_of(START, mirrored, False)
    assert right.switching == pytest.approx(-left.switching, abs=1e-9)
    assert math.isclose(left.costates[0, 0], right.costates[0, 0], abs_tol=1e-9)


STARTS = st.tuples(st.floats(-4, 4), st.floats(-4, 4), st.floats(-3.1, 3.1), st.floats(-1.2, 1.2))
ORIGIN = (0.0, 0.0, 0.0, 0.0)
CIRCLE = (-1.961, -0.439, 0.029, 0.128)
MIDDLE = (-1.157, 0.153, 1.667, 0.982)


def planned(start, goal=(4.0, 4.0, 0.0, 0.0), tolerance=0.0, trailer=None):
    question = Goal(state=goal, tolerance=(0, 0, 0, tolerance))
    return plan_by_extremals(trailer or Trailer(), start, question)


@pytest.mark.parametrize(
    ("tolerance", "known"),
    [
        (math.inf, 4.46243),
        (0.5, 4.592),
        (0.251, 5.100),
        (0.1255, 5.492),
        (0.05, 5.780),
        (0.01, 5.948),
        (0.0, 5.9914),
    ],
)
def test_the_thesis_case_takes_the_known_times(tolerance, known):
    plan = planned((1, 1, 0, 0), tolerance=tolerance)
    assert plan.converged
    assert plan.time == pytest.approx(known, abs=6e-4)
    assert plan.notes["pontryagin_holds"]
    assert max(plan.goal.miss(plan.path.states[-1])) < 1e-9


def test_the_thesis_case_turns_left_along_a_singular_arc_right_and_left():
    letters = [arc[0] for arc in planned((1, 1, 0, 0)).notes["arcs"].split(", ")]
    assert letters == ["L", "M", "R", "L"]


@pytest.mark.parametrize(
    "start", [(1, 1, 0, 0), (2, 4, 0, 0), (0, 0, 0, 0), (-8, 0, 0, 0), (3, 1, 2.5, 0.8)]
)
def test_the_controls_drive_what_the_path_says(start, assert_plan_obeys):
    # Turn rates along the singular arc are held from sample to sample.
    assert_plan_obeys(Trailer(), start, planned(start), tolerance=3e-6)


# Figure 3.10: goals four up, and so many times four along.
@pytest.mark.parametrize("ratio", [0.5, 1.0, 1.5, 2.0, 2.5, 3.0])
def test_casadi_finds_the_same_time(ratio):
    goal = Goal(state=(4 * ratio, 4.0, 0.0, 0.0))
    ours = plan_by_extremals(Trailer(), ORIGIN, goal)
    theirs = plan_by_casadi(Trailer(), ORIGIN, goal)
    assert ours.converged
    assert theirs.converged
    assert ours.time == pytest.approx(theirs.time, abs=1e-4)


@settings(max_examples=50)
@given(start=STARTS, tolerance=st.sampled_from([0.0, 0.1, 0.4, math.inf]))
def test_every_plan_ends_at_its_goal_and_beats_no_lower_bound(start, tolerance):
    plan = planned(start, ORIGIN, tolerance)
    assert plan.converged
    assert plan.residual < 1e-9
    assert max(plan.goal.miss(plan.path.states[-1])) < 1e-8
    assert plan.time >= dubins_paths(start[:3], ORIGIN[:3], 1.0)[0].length - 1e-9


@settings(max_examples=50)
@given(start=STARTS)
def test_primitives_are_never_quicker(start):
    goal = Goal(state=ORIGIN, tolerance=(0, 0, 0, 0.251))
    extremal = plan_by_extremals(Trailer(), start, goal)
    primitive = plan_by_primitives(Trailer(), start, goal)
    assert extremal.time <= primitive.time + 1e-9


@settings(max_examples=50)
@given(start=STARTS)
def test_the_mirrored_question_takes_the_same_time(start):
    x, y, theta, beta = start
    left = planned(start, ORIGIN)
    right = planned((x, -y, -theta, -beta), ORIGIN)
    assert left.time == pytest.approx(right.time, abs=1e-6)


@settings(max_examples=20)
@given(x=st.floats(-9, 9), y=st.floats(-9, 9), turn=st.floats(-3, 3))
def test_the_question_may_be_moved_turned_and_scaled(x, y, turn):
    trailer = Trailer(speed=3.0, turn_rate=1.5, length=2.0)
    east, north = math.cos(turn), math.sin(turn)
    goal = (x + 6 * (east - north), y + 6 * (north + east), turn, 0.0)
    plan = planned((x, y, turn, 0), goal, trailer=trailer)
    assert plan.time * 1.5 == pytest.approx(planned((1, 1, 0, 0)).time, abs=1e-7)
    assert plan.path.states[-1] == pytest.approx(goal, abs=1e-7)
    assert plan.path.states[0] == pytest.approx((x, y, turn, 0))


@pytest.mark.parametrize(
    ("start", "arcs", "longest"),
    [
        # A whole circle, and more, turns the trailer about.
        pytest.param(CIRCLE, 3, math.tau, id="circle"),
        pytest.param(MIDDLE, 5, math.pi, id="singular arc between four turns"),
    ],
)
def test_words_that_few_starts_have_are_found(start, arcs, longest):
    goal = Goal(state=ORIGIN)
    plan = plan_by_extremals(Trailer(), start, goal)
    durations = [float(arc[1:]) for arc in plan.notes["arcs"].split(", ")]
    assert len(durations) >= arcs
    assert max(durations) > longest
    assert plan.time <= plan_by_casadi(Trailer(), start, goal).time + 1e-4


def test_time_grows_as_the_tolerance_shrinks():
    times = [planned((0, 2, 1.0, 0.3), tolerance=width).time for width in (1.0, 0.3, 0.1, 0.0)]
    assert np.all(np.diff(times) >= 0)
    assert times[-1] > times[0]


def test_a_start_at_the_goal_is_a_plan_of_no_time():
    plan = planned(ORIGIN, ORIGIN)
    assert plan.converged
    assert plan.time == 0


@pytest.mark.parametrize("trailer", [Trailer(length=2.0), Trailer(hitch_offset=0.3)])
def test_other_trailers_are_declined(trailer):
    plan = planned((1, 1, 0, 0), trailer=trailer)
    assert plan.status.startswith("not applicable")
    assert not plan.converged


def test_the_jackknife_limit_is_kept_or_the_plan_declined():
    limited = planned((1, 1, 0, 0), trailer=Trailer(jackknife=0.2))
    assert not limited.converged
    assert limited.time == math.inf


def test_a_trailer_that_may_reverse_is_told_that_it_does_not():
    plan = planned((1, 1, 0, 0), trailer=Trailer(reverse=True))
    assert "forwards only" in plan.status
    assert plan.time == pytest.approx(5.99137, abs=1e-5)


def test_a_start_without_four_numbers_is_refused():
    with pytest.raises(InvalidInput, match="start"):
        planned((1, 1, 0))


def test_a_first_turn_against_the_shortest_car_path_is_found():
    goal = Goal(state=ORIGIN, tolerance=(0, 0, 0, 0.251))
    plan = plan_by_extremals(Trailer(), (-2.081, 0.981, -0.897, 0.563), goal)
    assert plan.notes["arcs"].startswith("R")
    assert dubins_paths((-2.081, 0.981, -0.897), ORIGIN[:3], 1.0)[0].word == "LSL"
    assert plan.time == pytest.approx(2.5988, abs=3e-3)
