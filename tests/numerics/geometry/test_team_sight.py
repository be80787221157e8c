"""Sight between teams is sight along each line."""

import numpy as np

from sightfield.systems.numerics.geometry.edge_index import build_edge_index
from sightfield.systems.numerics.geometry.segment_sight import are_clear
from sightfield.systems.numerics.geometry.team_sight import corner_sight, edges_at, sight_matrix


def pairs(a, b):
    """All pairs of rows, shape (n m, 2) each."""
    return np.repeat(a, len(b), axis=0), np.tile(b, (len(a), 1))


def test_the_matrix_holds_every_pair(random_world, free_points):
    world = random_world(1, 25)
    index = build_edge_index(world)
    viewers, targets = free_points(world, 2, 7), free_points(world, 3, 11)
    expected = are_clear(index, *pairs(viewers, targets))
    np.testing.assert_array_equal(sight_matrix(index, viewers.ravel(), targets.ravel()), expected)


def test_corners_are_seen_as_any_other_points_are(random_world, free_points):
    world = random_world(2, 25)
    index = build_edge_index(world)
    # Viewers in the open, on vertices and within edges.
    ring = world.obstacles[0]
    middles = 0.5 * (ring + np.roll(ring, 1, axis=0))
    viewers = np.concatenate([free_points(world, 2, 50), ring, middles, world.boundary])
    corners = world.corners.points
    numbers = edges_at(index, corners)
    np.testing.assert_array_equal(index.edges[numbers, 2:4], corners)
    expected = are_clear(index, *pairs(viewers, corners))
    got = corner_sight(index, viewers.ravel(), corners.ravel(), numbers)
    np.testing.assert_array_equal(got, expected)
    assert 0.05 < got.mean() < 0.95
