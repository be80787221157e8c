"""Pontryagin's conditions along paths of arcs."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.planning.extremals.arc_path import Arc, arc_samples
from sightfield.systems.numerics.planning.extremals.costates import extremal_of
from sightfield.systems.numerics.planning.extremals.planner import plan_by_extremals
from sightfield.systems.numerics.planning.goal import Goal
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
