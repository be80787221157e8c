"""A segment is clear exactly when the closed free region covers it; corners are seen as points."""

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.edge_index import build_edge_index
from sightfield.systems.numerics.geometry.segment_sight import (
    SMALL_WORLD,
    are_clear,
    build_corner_index,
    see_corners,
)
from sightfield.systems.numerics.geometry.world import make_world

ARENA = [[0, 0], [4, 0], [4, 4], [0, 4]]
BOX = [[1, 1], [2, 1], [2, 2], [1, 2]]


def clear(world, a, b):
    """Whether one segment is clear, which must not depend on its direction."""
    index = build_edge_index(world)
    there, back = are_clear(index, [a, b], [b, a])
    assert there == back
    return bool(there)


@pytest.mark.parametrize("obstacles", [0, 1, 5, 40])
def test_agrees_with_shapely_on_random_pairs(random_world, obstacles):
    world = random_world(obstacles, obstacles)
    rng = np.random.default_rng(1)
    a = rng.uniform(-0.5, 10.5, (4000, 2))
    b = np.concatenate([rng.uniform(0, 10, (2000, 2)), a[2000:] + rng.normal(0, 0.2, (2000, 2))])
    shapely.prepare(world.polygon)
    expected = shapely.covers(world.polygon, shapely.linestrings(np.stack([a, b], axis=1)))
    np.testing.assert_array_equal(are_clear(build_edge_index(world), a, b), expected)


@pytest.mark.parametrize(
    ("a", "b", "expected", "why"),
    [
        ((0.5, 2.5), (2.5, 0.5), False, "crosses the box"),
        ((0.5, 1.5), (1.5, 0.5), True, "grazes the vertex (1, 1) from outside"),
        ((0.5, 0.5), (3, 3), False, "enters at a vertex, leaves at the opposite one"),
        ((0.5, 0.5), (1, 1), True, "ends at a vertex"),
        ((1, 1), (2, 2), False, "the box's own diagonal"),
        ((0.5, 1), (3, 1), True, "runs along an edge"),
        ((1.2, 1), (1.8, 1), True, "lies in an edge"),
        ((1.5, 1), (3, 1), True, "starts in an edge and runs along it"),
        ((1.5, 1), (1.5, 0.5), True, "leaves an edge on the free side"),
        ((1.5, 1), (1.5, 1.5), False, "leaves an edge into the box"),
        ((1.5, 1), (2, 1.5), False, "cuts a corner of the box"),
        ((1.5, 1.5), (1.6, 1.6), False, "inside the box"),
        ((1.5, 1.5), (3, 3), False, "starts inside the box"),
        ((0, 0), (0, 4), True, "runs along the boundary"),
        ((0, 0), (4, 4), False, "corner to corner through the box"),
        ((0, 2), (2, 4), True, "boundary to boundary"),
        ((3, 3), (5, 3), False, "leaves the boundary"),
        ((3, 3), (3, 3), True, "zero length, free"),
        ((1, 1), (1, 1), True, "zero length, on a vertex"),
        ((1.5, 1.5), (1.5, 1.5), False, "zero length, inside the box"),
        ((9, 9), (9, 9), False, "zero length, outside the world"),
    ],
)
@pytest.mark.parametrize("angle", [0.0, 0.3, np.pi / 4, 2.0])
@pytest.mark.parametrize("mirror", [False, True])
def test_contacts_have_one_answer_in_every_pose(moved, a, b, expected, why, angle, mirror):
    world, carry = moved(make_world(ARENA, [BOX]), angle, mirror, 1.7, (30.0, -70.0))
    assert clear(world, carry(np.array(a)), carry(np.array(b))) == expected, why


def test_sight_passes_between_two_boxes_that_touch_the_line_from_either_side():
    boxes = [[[1, 2], [1.5, 2], [1.5, 3], [1, 3]], [[2, 1], [3, 1], [3, 2], [2, 2]]]
    world = make_world(ARENA, boxes)
    assert clear(world, (0.5, 2), (3.5, 2))
    assert not clear(world, (0.5, 2.001), (3.5, 2.001))
    assert not clear(world, (0.5, 1.999), (3.5, 1.999))


def test_collinear_vertices_do_not_matter():
    dense = [[1, 1], [1.5, 1], [2, 1], [2, 1.2], [2, 2], [1, 2], [1, 1.01]]
    assert clear(make_world(ARENA, [dense]), (0.5, 1), (3, 1))
    assert not clear(make_world(ARENA, [dense]), (0.5, 1.01), (3, 1.01))


@given(
    angle=st.floats(-3.1, 3.1),
    mirror=st.booleans(),
    scale=st.floats(0.01, 100.0),
    shift=st.tuples(st.floats(-100, 100), st.floats(-100, 100)),
    seed=st.integers(0, 1000),
)
def test_the_answers_move_with_the_scene(angle, mirror, scale, shift, seed):
    rng = np.random.default_rng(seed)
    # Points on a coarse lattice, so that vertices are grazed and edges followed all the time.
    boxes = [BOX, [[2.5, 2], [3.5, 2], [3.5, 3], [2.5, 3]], [[0.5, 2.5], [1, 3.5], [0.5, 3.5]]]
    world = make_world(ARENA, boxes)
    a, b = rng.integers(0, 9, (2, 50, 2)) / 2.0
    c, s = np.cos(angle), np.sin(angle)
    matrix = scale * np.array([[c, -s], [s, c]]) @ np.diag([1.0, -1.0 if mirror else 1.0])
    carry = [np.asarray(p, dtype=float) @ matrix.T + shift for p in (ARENA, *boxes, a, b)]
    other = make_world(carry[0], carry[1:4][::-1])
    expected = are_clear(build_edge_index(world), a, b)
    got = are_clear(build_edge_index(other), carry[4], carry[5])
    np.testing.assert_array_equal(got, expected)


def test_bad_points_are_refused():
    index = build_edge_index(make_world(ARENA))
    with pytest.raises(InvalidInput, match="finite"):
        are_clear(index, [[np.nan, 0]], [[1, 1]])
    with pytest.raises(InvalidInput, match=r"\(n, 2\)"):
        are_clear(index, [[1, 0]], [[1, 1], [2, 2]])


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
