"""Risk vectors weigh corners, risk functions weigh pairs, as (2.2) and (2.13) say."""

import numpy as np
import pytest

from sightfield.systems.numerics.tracking.risk import (
    RISK_FUNCTIONS,
    RISK_VECTORS,
    risk_weights,
    team_risk,
)


def sight(pairs, pursuer_corners, evader_corners):
    """The vector of sight in which everybody sees everybody."""
    return np.array([*[1] * pairs, *pursuer_corners, *evader_corners], dtype=float)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("uniform", [1 / 3, 1 / 3, 1 / 3]),
        ("majority", [0, 1, 0]),
        ("proportional", [2 / 7, 4 / 7, 1 / 7]),
    ],
)
def test_risk_vectors(name, expected):
    weights = risk_weights(RISK_VECTORS[name], np.array([2.0, 1.0, 4.0]))
    np.testing.assert_allclose(weights, expected)


@pytest.mark.parametrize("name", RISK_VECTORS)
def test_risk_vectors_without_corners_or_on_one(name):
    assert risk_weights(RISK_VECTORS[name], np.zeros(0)).size == 0
    weights = risk_weights(RISK_VECTORS[name], np.array([0.0, 1.0]))
    assert np.isfinite(weights).all()
    assert weights.sum() == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("name", "expected"),
    [("total", [1 + 1 / 2, 1 / 5]), ("nearest", [1, 1 / 5]), ("mean", [0.75, 1 / 5])],
)
def test_risk_functions_count_the_corners_that_both_see(name, expected):
    corners = np.array([[0.0, 1.0, 0, 1], [2.0, 0.0, 0, 1], [9.0, 9.0, 0, 1]])
    evaders = np.array([0.0, 0.0, 5.0, 4.0])
    pursuer_corners = [1, 1, 0, 0, 0, 1]
    evader_corners = [1, 1, 1, 0, 1, 1]
    kinds = np.full(2, RISK_FUNCTIONS[name])
    risk = team_risk(kinds, evaders, sight(4, pursuer_corners, evader_corners), corners)
    np.testing.assert_allclose(risk[0], expected)
    # The second pursuer sees the third corner only, and so does each evader with it.
    np.testing.assert_allclose(risk[1], [1 / np.hypot(9, 9), 1 / np.hypot(4, 5)])


def test_each_pursuer_has_its_own_risk_function():
    corners = np.array([[0.0, 1.0, 0, 1], [2.0, 0.0, 0, 1]])
    risk = team_risk(np.array([0, 1, 2]), np.zeros(2), sight(3, [1] * 6, [1] * 2), corners)
    np.testing.assert_allclose(risk[:, 0], [1.5, 1.0, 0.75])


def test_no_common_corner_is_no_risk():
    corners = np.array([[0.0, 1.0, 0, 1]])
    for kind in RISK_FUNCTIONS.values():
        risk = team_risk(np.array([kind]), np.zeros(2), sight(1, [1], [0]), corners)
        assert risk.tolist() == [[0.0]]
