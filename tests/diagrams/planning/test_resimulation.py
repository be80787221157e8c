"""Driving a path through the Drake plant says where its controls lead."""

import math

import numpy as np
import pytest

from sightfield.diagrams.planning.verdict import resimulate
from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.planning.goal import Goal
from sightfield.systems.numerics.planning.plan import TrailerPath, driven_path
from sightfield.systems.numerics.planning.trailer import Trailer

CART = Trailer()
START = (1.0, 2.0, 0.3, 0.8)
FREE = (math.inf,) * 4


def exact_straight(length):
    """State after a straight from START, in closed form."""
    beta = 2 * math.atan(math.tan(0.4) * math.exp(-length))
    return 1 + length * math.cos(0.3), 2 + length * math.sin(0.3), 0.3, beta


def test_a_straight_ends_where_the_closed_form_says():
    path = TrailerPath(
        np.array([0.0, 3.0]), np.array([START, exact_straight(3.0)]), np.array([[1.0, 0.0]])
    )
    result = resimulate(CART, path, Goal(state=exact_straight(3.0)))
    np.testing.assert_allclose(result.final_state, exact_straight(3.0), atol=1e-10)
    assert result.violation < 1e-10
    assert result.drift < 1e-10


def test_a_circle_comes_back():
    path = driven_path(CART, (0, 0, 0, 0), [(1, 1, math.tau)], step=1.0)
    result = resimulate(CART, path, Goal(state=(0, 0, 0, 0), tolerance=(0, 0, 0, math.inf)))
    assert result.violation < 1e-9
    assert result.final_state[2] == pytest.approx(math.tau)


def test_many_switches_agree_with_a_fine_integration():
    random = np.random.default_rng(4)
    pieces = [(v, w, t) for v, w, t in random.uniform([0, -1, 0.01], [1, 1, 0.5], size=(40, 3))]
    path = driven_path(CART, START, pieces, step=0.005)
    result = resimulate(CART, path, Goal(state=tuple(path.states[-1])))
    assert result.drift < 1e-9
    assert result.violation < 1e-9
    np.testing.assert_array_equal(result.path.states[-1], result.final_state)


def test_a_missed_goal_is_measured_from_the_box():
    path = driven_path(CART, START, [(1, 0, 1)])
    x, y, theta, beta = exact_straight(1.0)
    # Half a metre behind, along the goal's own heading.
    goal = Goal(
        state=(x + 0.5 * math.cos(theta), y + 0.5 * math.sin(theta), theta + math.tau, beta),
        tolerance=(0.2, 0, 0, 0),
    )
    result = resimulate(CART, path, goal)
    np.testing.assert_allclose(result.goal_miss, (0.3, 0, 0, 0), atol=1e-9)
    assert result.violation == pytest.approx(0.3)


def test_wrong_states_show_as_drift():
    path = driven_path(CART, START, [(1, 0, 1)])
    wrong = TrailerPath(path.times, path.states.copy(), path.controls)
    wrong.states[-1, 0] += 0.1
    result = resimulate(CART, wrong, Goal(state=START, tolerance=FREE))
    assert result.drift == pytest.approx(0.1)
    assert result.violation == 0


@pytest.mark.parametrize(
    ("trailer", "control", "excess"),
    [
        (Trailer(), (1.0, 1.3), 0.3),
        (Trailer(), (-0.2, 0.0), 0.2),
        (Trailer(reverse=True), (-1.1, 0.0), 0.1),
        (Trailer(reverse=True), (-1.0, -1.0), 0.0),
    ],
)
def test_controls_beyond_the_bounds_are_reported_and_not_driven(trailer, control, excess):
    path = driven_path(trailer, (0, 0, 0, 0), [(*control, 1.0)])
    result = resimulate(trailer, path, Goal(state=(0, 0, 0, 0), tolerance=FREE))
    assert result.control_excess == pytest.approx(excess)
    assert result.violation == pytest.approx(excess)
    assert (result.drift < 1e-4) == (excess == 0)


def test_a_jackknife_is_reported():
    trailer = Trailer(reverse=True, jackknife=1.0)
    path = driven_path(trailer, (0, 0, 0, 0.9), [(-1, 0, 1)])
    result = resimulate(trailer, path, Goal(state=(0, 0, 0, 0), tolerance=FREE))
    bent = 2 * math.atan(math.tan(0.45) * math.exp(1))
    assert result.jackknife_excess == pytest.approx(bent - 1)


def test_what_is_no_path_is_refused():
    path = TrailerPath(np.array([0.0]), np.zeros((1, 4)), np.zeros((0, 2)))
    with pytest.raises(InvalidInput, match="path"):
        resimulate(CART, path, Goal(state=START))
