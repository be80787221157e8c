"""Sight between teams is sight along each line."""

import numpy as np

from sightfield.systems.numerics.geometry.edge_index import build_edge_index
from sightfield.systems.numerics.geometry.segment_sight import are_clear
from sightfield.systems.numerics.geometry.team_sight import sight_matrix


def pairs(a, b):
    """All pairs of rows, shape (n m, 2) each."""
    return np.repeat(a, len(b), axis=0), np.tile(b, (len(a), 1))


def test_the_matrix_holds_every_pair(random_world, free_points):
    world = random_world(1, 25)
    index = build_edge_index(world)
    viewers, targets = free_points(world, 2, 7), free_points(world, 3, 11)
    expected = are_clear(index, *pairs(viewers, targets))
    np.testing.assert_array_equal(sight_matrix(index, viewers.ravel(), targets.ravel()), expected)
