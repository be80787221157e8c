"""Grids of places and the moves on them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sightfield.systems.numerics.tracking.visibility_game.lattice import SLACK, cover, moves_within


@pytest.mark.parametrize(("square", "count"), [(1, 5), (2, 9), (5, 21), (10, 37), (20, 69)])
def test_moves_are_all_offsets_in_a_disc(square, count):
    moves = moves_within(square)
    assert len(moves.offsets) == count
    assert (moves.offsets**2).sum(axis=1).max() <= square
    assert moves.offsets[0].tolist() == [0, 0]
    assert moves.longest == pytest.approx(np.sqrt(square))


@pytest.mark.parametrize("square", [2, 5, 10, 20])
def test_a_player_can_be_followed(square):
    # However it was within the slack, and wherever it goes within the pace.
    moves, rng = moves_within(square), np.random.default_rng(1)
    angle, turn = rng.uniform(0, 2 * np.pi, (2, 20000))
    start = SLACK * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    end = start + moves.pace * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    nearest = np.hypot(*(end[:, None] - moves.offsets[None]).transpose(2, 0, 1)).min(axis=1)
    assert nearest.max() <= SLACK
    # And with a longer step one could get away.
    away = (moves.pace + SLACK + 0.01) * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    nearest = np.hypot(*(away[:, None] - moves.offsets[None]).transpose(2, 0, 1)).min(axis=1)
    assert nearest.max() > SLACK


@given(
    st.floats(-50, 50), st.floats(-50, 50), st.floats(0.3, 9), st.floats(0.3, 9), st.floats(0.1, 1)
)
def test_the_grid_covers_its_rectangle_evenly(x, y, width, height, spacing):
    grid = cover(np.array([x, y, x + width, y + height]), spacing)
    low, high = grid.at(0, 0), grid.at(grid.rows - 1, grid.columns - 1)
    middle = np.array([x + width / 2, y + height / 2])
    np.testing.assert_allclose((low + high) / 2, middle, atol=1e-9)
    assert (low - spacing / 2 <= np.array([x, y]) + 1e-6).all()
    assert (high + spacing / 2 >= np.array([x + width, y + height]) - 1e-6).all()
