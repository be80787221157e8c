"""Where the evader may be, and what cameras would show of that."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.social.routes.outlook import (
    belief,
    expected_view,
    make_outlook,
    view,
)

WORLD = make_world([[0, 0], [4, 0], [4, 2], [0, 2]], [[[2, 0.5], [2.2, 0.5], [2.2, 1.5], [2, 1.5]]])
OUTLOOK = make_outlook(WORLD, cell=0.1, view_angle=math.radians(60), reach=3.0)


def cell_at(x, y):
    return int(np.argmin(np.hypot(*(OUTLOOK.cells - [x, y]).T)))


def test_cells_fill_the_free_region():
    assert len(OUTLOOK.cells) * 0.1**2 == pytest.approx(WORLD.free_area, rel=0.05)


def test_a_camera_shows_what_is_ahead_and_not_behind_it_or_a_wall():
    seen = view(OUTLOOK, np.array([1.0, 1.0, 0.0]))
    assert seen[cell_at(1.9, 1.0)] == 1
    assert seen[cell_at(0.3, 1.0)] == 0
    assert seen[cell_at(3.0, 1.0)] == 0
    assert seen[cell_at(1.1, 1.8)] == 0
    assert view(OUTLOOK, np.array([0.1, 0.2, 0.0]))[cell_at(3.8, 0.2)] == 0  # beyond the reach


def test_old_knowledge_of_a_camera_fades_to_none():
    pose = np.array([1.0, 1.0, 0.0])
    np.testing.assert_array_equal(expected_view(OUTLOOK, pose, 0.0, 5.0), view(OUTLOOK, pose))
    np.testing.assert_allclose(expected_view(OUTLOOK, pose, 100.0, 5.0), OUTLOOK.typical)
    np.testing.assert_array_equal(expected_view(OUTLOOK, pose, math.inf, 5.0), OUTLOOK.typical)
    assert 0 < OUTLOOK.typical.min() < OUTLOOK.typical.max() < 0.5


def test_belief_is_a_gaussian_on_the_cells_or_knows_nothing():
    nothing = belief(OUTLOOK, np.zeros(2), np.diag([math.inf, math.inf]))
    np.testing.assert_allclose(nothing, 1 / len(OUTLOOK.cells))
    sharp = belief(OUTLOOK, np.array([1.05, 1.05]), 0.01 * np.eye(2))
    assert sharp.sum() == pytest.approx(1)
    assert int(np.argmax(sharp)) == cell_at(1.05, 1.05)
    # Sideways by 0.2 m, of a deviation of 0.1 m widened by half a cell.
    ratio = sharp[cell_at(1.25, 1.05)] / sharp[cell_at(1.05, 1.05)]
    assert ratio == pytest.approx(math.exp(-0.5 * 0.04 / 0.0125))


def test_cells_have_a_size():
    with pytest.raises(InvalidInput, match="`cell` must be positive"):
        make_outlook(WORLD, cell=0.0, view_angle=1.0, reach=1.0)
