"""The modified pursuit (2.7)."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sightfield.systems.numerics.tracking.team_pursuit import modified_velocities

SPEED, STAND_OFF, FADE = 0.3, 0.4, 0.2
FIELD = np.array([0.0, 0.3, -0.1, 0.2])


def modified(weight, pursuers, evaders, assignment, field=FIELD):
    return modified_velocities(
        weight,
        SPEED,
        STAND_OFF,
        FADE,
        np.ravel(pursuers).astype(float),
        np.ravel(evaders).astype(float),
        np.array(assignment, dtype=float),
        np.asarray(field, dtype=float),
    ).reshape(-1, 2)


@given(st.floats(0, 1))
def test_far_from_the_evader_it_is_the_sum_of_the_thesis(weight):
    pursuers, evaders = [[0, 0], [1, 1]], [[5, 1], [0, -3], [-3, 4]]
    velocities = modified(weight, pursuers, evaders, [2, 0])
    towards = np.array([[-3, 4], [4, 0]]) / [[5], [4]]
    np.testing.assert_allclose(
        velocities, weight * FIELD.reshape(2, 2) + (1 - weight) * SPEED * towards, atol=1e-12
    )


def test_a_pursuer_without_an_evader_stays():
    velocities = modified(0.5, [[0, 0], [1, 1]], [[5, 1]], [-1, 0])
    np.testing.assert_array_equal(velocities[0], 0)
    assert np.hypot(*velocities[1]) > 0


@pytest.mark.parametrize(
    ("distance", "share"),
    [(0.7, 1), (0.6, 1), (0.5, 0.5), (0.4, 0), (0.3, -0.5), (0.2, -1), (0.1, -1)],
)
def test_near_the_evader_closing_in_is_limited_and_turns_into_backing_off(distance, share):
    velocities = modified(0.0, [[2, 1]], [[2, 1 - distance]], [0], field=[0.3, 0])
    np.testing.assert_allclose(velocities, [[0, -share * SPEED]], atol=1e-12)


def test_a_field_away_from_the_evader_is_not_limited():
    velocities = modified(1.0, [[0, 0]], [[0.4, 0]], [0], field=[-0.2, 0.1])
    np.testing.assert_allclose(velocities, [[-0.2, 0.1]], atol=1e-12)


def test_on_the_evaders_spot_the_pursuer_waits():
    np.testing.assert_array_equal(modified(0.5, [[2, 1]], [[2, 1]], [0], field=[0.2, 0]), [[0, 0]])


@given(st.floats(0, 1), st.floats(-3, 3), st.floats(-3, 3), st.floats(0, 6.3))
def test_a_velocity_is_never_faster_than_the_top_speed(weight, x, y, heading):
    field = SPEED * np.array([np.cos(heading), np.sin(heading)])
    velocities = modified(weight, [[0, 0]], [[x, y]], [0], field=field)
    assert np.hypot(*velocities[0]) <= SPEED + 1e-12
