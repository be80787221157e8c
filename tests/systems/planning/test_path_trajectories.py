"""Trajectories say what the paths say, between the samples too."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.planning.plan import TrailerPath, driven_path
from sightfield.systems.numerics.planning.trailer import Trailer
from sightfield.systems.planning import control_trajectory, state_trajectory

CART = Trailer(speed=1.5, turn_rate=0.8, length=2.0, hitch_offset=0.3, reverse=True)
PIECES = [(1.5, 0.8, 2.0), (-1.2, -0.5, 1.0), (1.5, 0.0, 2.0)]
PATH = driven_path(CART, (1.0, 2.0, 3.0, 0.4), PIECES, step=0.1)


def test_controls_are_held_from_sample_to_sample():
    trajectory = control_trajectory(PATH)
    assert (trajectory.start_time(), trajectory.end_time()) == (0, PATH.times[-1])
    for time, piece in [(0.0, 0), (1.99, 0), (2.01, 1), (2.99, 1), (3.01, 2), (5.0, 2)]:
        np.testing.assert_array_equal(trajectory.value(time).ravel(), PIECES[piece][:2])


def test_states_go_through_the_samples():
    trajectory = state_trajectory(PATH, CART)
    assert (trajectory.start_time(), trajectory.end_time()) == (0, PATH.times[-1])
    np.testing.assert_allclose(trajectory.vector_values(PATH.times), PATH.states.T, atol=1e-12)


def test_rates_jump_where_the_controls_do():
    states = state_trajectory(PATH, CART)
    speeds = states.derivative(1)
    for time, v in [(2 - 1e-9, 1.5), (2 + 1e-9, -1.2), (3 + 1e-9, 1.5)]:
        theta = states.value(time)[2, 0]
        rates = speeds.value(time).ravel()
        assert rates[0] * math.cos(theta) + rates[1] * math.sin(theta) == pytest.approx(v)


def test_between_samples_the_error_falls_with_the_fourth_power():
    fine = driven_path(CART, PATH.states[0], PIECES, step=0.0025)
    errors = []
    for step in (0.1, 0.05):
        path = driven_path(CART, PATH.states[0], PIECES, step)
        trajectory = state_trajectory(path, CART)
        errors.append(np.abs(trajectory.vector_values(fine.times) - fine.states.T).max())
    assert errors[0] < 1e-5
    assert errors[0] / errors[1] == pytest.approx(16, rel=0.3)


def test_what_is_no_path_is_refused():
    path = TrailerPath(np.array([0.0]), np.zeros((1, 4)), np.zeros((0, 2)))
    with pytest.raises(InvalidInput, match="path"):
        control_trajectory(path)
    with pytest.raises(InvalidInput, match="path"):
        state_trajectory(path, CART)
