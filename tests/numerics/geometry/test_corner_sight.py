"""Corners are seen as any other points are, in small worlds and in large ones."""

import numpy as np
import pytest

from sightfield.systems.numerics.geometry.corner_sight import (
    SMALL_WORLD,
    build_corner_index,
    see_corners,
)
from sightfield.systems.numerics.geometry.edge_index import build_edge_index
from sightfield.systems.numerics.geometry.segment_sight import are_clear
from sightfield.systems.numerics.geometry.world import make_world


def seen_from(world, viewers):
    """Which corner each viewer sees, by the fast way and along each line."""
    index = build_edge_index(world)
    corners = build_corner_index(world, index)
    seen = np.empty((len(viewers), len(corners.points)))
    own = np.empty(corners.lines.shape[1])
    see_corners(index, corners, np.ascontiguousarray(viewers).ravel(), own, seen)
    starts = np.repeat(viewers, len(corners.points), axis=0)
    expected = are_clear(index, starts, np.tile(corners.points, (len(viewers), 1)))
    return seen, expected.reshape(seen.shape)


@pytest.mark.parametrize("obstacles", [1, 4, 8, 25])
def test_in_random_worlds(random_world, free_points, obstacles):
    world = random_world(obstacles, obstacles)
    ring = world.obstacles[0]
    # Viewers in the open, on vertices and within edges.
    middles = 0.5 * (ring + np.roll(ring, 1, axis=0))
    viewers = np.concatenate([free_points(world, 2, 300), ring, middles, world.boundary])
    seen, expected = seen_from(world, viewers)
    np.testing.assert_array_equal(seen, expected)
    assert 0.05 < seen.mean() < 0.95


def test_both_ways_are_tried_above(random_world):
    sizes = [random_world(k, k).vertex_count for k in (1, 4, 8, 25)]
    assert min(sizes) < SMALL_WORLD < max(sizes)


def test_on_a_lattice_where_everything_is_in_line():
    boxes = [[[x, y], [x + 1, y], [x + 1, y + 1], [x, y + 1]] for x in (1, 3) for y in (1, 3)]
    world = make_world([[0, 0], [5, 0], [5, 5], [0, 5]], boxes)
    points = np.array([[x / 2, y / 2] for x in range(11) for y in range(11)])
    free = are_clear(build_edge_index(world), points, points)
    seen, expected = seen_from(world, points[free])
    np.testing.assert_array_equal(seen, expected)


def test_a_room_without_corners():
    seen, _ = seen_from(make_world([[0, 0], [5, 0], [5, 5], [0, 5]]), np.array([[1.0, 1.0]]))
    assert seen.shape == (1, 0)
