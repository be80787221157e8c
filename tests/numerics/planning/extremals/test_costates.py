"""Pontryagin's conditions along paths of arcs."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.planning.extremals.arc_path import Arc
from sightfield.systems.numerics.planning.extremals.costates import extremal_of

START = np.array([0.0, 0.0, 0.0, 0.0])
# From (1, 1, 0, 0) to (4, 4, 0, 0) with beta = 0 exactly, solved to 1e-9.
OPTIMAL = [
    Arc(1.0, 1.87719826),
    Arc(-0.14442723, 1.13981701, True),
    Arc(-1.0, 2.28956143),
    Arc(1.0, 0.68479731),
]


def test_the_costate_solves_its_own_equations():
    arcs = OPTIMAL
    found = extremal_of(START, arcs, False)
    east, north, turn, along_beta = found.costates.T
    times = found.times
    assert np.ptp(east) == np.ptp(north) == 0
    # Rates by differences inside the arcs, where samples are apart.
    inside = np.diff(times) > 1e-9
    hamiltonian_rates = np.diff(found.hamiltonian)[inside]
    assert hamiltonian_rates == pytest.approx(0, abs=1e-6)
    assert turn + along_beta == pytest.approx(found.switching, abs=1e-12)


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
