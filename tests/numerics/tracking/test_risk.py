"""Risk vectors weigh corners, risk functions weigh pairs, as (2.2) and (2.13) say."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sightfield.systems.numerics.tracking.corner_game import (
    REGION_1,
    escape_time,
    margins,
    region,
    to_corner_frame,
)
from sightfield.systems.numerics.tracking.risk import (
    RISK_FUNCTIONS,
    RISK_VECTORS,
    remoteness,
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
        ("least_margin", [0, 1, 0]),
        ("urgency", [2 / 7, 4 / 7, 1 / 7]),
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


# A corner at (1, 2), its obstacle to the west and the south-west, and a speed ratio.
CORNER, RATIO = (1.0, 2.0, 0.0, 0.5 * math.pi), 0.4
# Where the pursuer of that corner sees not all: south of it, a little to the west at most.
below = st.tuples(st.floats(0.1, 3), st.floats(-1.4, -0.1))
# Not on the sight ray, beyond which nothing is left to run.
beyond = st.tuples(st.floats(0.05, 3), st.floats(0, 0.99))


def placed(pursuer, evader):
    """World positions from polar ones; the evader's angle is a share of the way to the ray."""
    (r_p, phi_p), (r_e, share) = pursuer, evader
    phi_e = phi_p + share * math.pi
    points = ((r_p, phi_p), (r_e, phi_e))
    return [each for r, phi in points for each in (1 + r * math.cos(phi), 2 + r * math.sin(phi))]


@given(pursuer=below, evader=beyond)
def test_the_risk_vectors_of_the_game_see_what_the_game_says(pursuer, evader):
    positions = placed(pursuer, evader)
    state = to_corner_frame(*positions, *CORNER)[:4]
    m1 = margins(*state, CORNER[3], RATIO)[0]
    assert remoteness(RISK_VECTORS["least_margin"], *positions, *CORNER, RATIO) == m1
    left = remoteness(RISK_VECTORS["urgency"], *positions, *CORNER, RATIO)
    if region(*state, CORNER[3], RATIO) == REGION_1:
        # The evader runs at its own speed, here RATIO, until T*.
        assert left == pytest.approx(RATIO * escape_time(*state, CORNER[3], RATIO, 1.0))
    else:
        assert left >= m1


@given(pursuer=below, evader=beyond)
def test_urgency_does_not_jump_where_the_winner_changes(pursuer, evader):
    urgency = RISK_VECTORS["urgency"]
    (r_p, phi_p), (_, share) = pursuer, evader
    phi_e = phi_p + share * math.pi
    # On the barrier the evader is a D_p from edge A.
    height = math.sin(phi_e) if phi_e > 0.5 * math.pi else 1.0
    barrier = -RATIO * r_p * math.sin(phi_p) / max(height, 0.05)
    inside, outside = (
        remoteness(urgency, *placed(pursuer, (barrier * side, share)), *CORNER, RATIO)
        for side in (1 - 1e-9, 1 + 1e-9)
    )
    assert inside == pytest.approx(outside, rel=1e-5, abs=1e-6)


@given(pursuer=below, evader=beyond, scale=st.floats(0.2, 5))
def test_what_is_left_to_run_scales_with_the_world(pursuer, evader, scale):
    for kind in RISK_VECTORS.values():
        x, y, heading, angle = CORNER
        positions = placed(pursuer, evader)
        small = remoteness(kind, *positions, *CORNER, RATIO)
        larger = [scale * each for each in (*positions, x, y)]
        assert remoteness(kind, *larger, heading, angle, RATIO) == pytest.approx(
            scale * small, rel=1e-6, abs=1e-9
        )


def test_a_corner_that_cannot_be_defended_outweighs_a_nearer_one_that_can():
    urgency = RISK_VECTORS["urgency"]
    # Just below the corner, the pursuer is round it before the evader; from afar it is not.
    defended = remoteness(urgency, 1.0, 1.9, 1.1, 2.5, *CORNER, RATIO)
    lost = remoteness(urgency, 1.0, -2.0, 1.1, 2.7, *CORNER, RATIO)
    assert risk_weights(urgency, np.array([defended, lost])).argmax() == 1
    assert risk_weights(RISK_VECTORS["majority"], np.hypot(0.1, [0.5, 0.7])).argmax() == 0
