"""A world is one free region with holes, however its rings come in, overlap and touch."""

import math
from collections.abc import Sequence

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from scipy import ndimage

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.edge_index import build_edge_index
from sightfield.systems.numerics.geometry.segment_sight import are_clear
from sightfield.systems.numerics.geometry.world import (
    World,
    clean_ring,
    make_world,
    ring_area,
    world_from_polygon,
)

ARENA = [[0, 0], [4, 0], [4, 4], [0, 4]]
BOX = [[1, 1], [2, 1], [2, 2], [1, 2]]

# Bars round a yard.
NORTH, SOUTH = [[1, 3], [3, 3], [3, 2.5], [1, 2.5]], [[1, 1], [3, 1], [3, 1.5], [1, 1.5]]
EAST, WEST = [[2.5, 1], [3, 1], [3, 3], [2.5, 3]], [[1, 1], [1.5, 1], [1.5, 3], [1, 3]]


@pytest.mark.parametrize("turn", [1, -1])
@pytest.mark.parametrize("shift", [0, 2])
def test_free_space_is_on_the_left_of_every_edge(turn, shift):
    world = make_world(ARENA[::turn], [BOX[shift:] + BOX[:shift]])
    assert ring_area(world.boundary) == pytest.approx(16)
    assert ring_area(world.obstacles[0]) == pytest.approx(-1)
    assert world.free_area == pytest.approx(15)
    assert world.vertex_count == 8


def test_a_ring_may_be_closed_and_have_vertices_that_say_nothing():
    ring = [[0, 0], [1, 0], [2, 0], [4, 0], [4, 4], [4, 4], [0, 4], [0, 2], [0, 1], [0, 0]]
    assert sorted(clean_ring("ring", ring).tolist()) == sorted(ARENA)


def test_corners_are_the_reflex_vertices_in_the_frame_of_the_corner_game():
    world = make_world([[0, 0], [0, -4], [4, -4], [4, 4], [-4, 4], [-4, 0]])
    corners = world.corners
    np.testing.assert_allclose(corners.points, [[0, 0]])
    np.testing.assert_allclose(corners.angles, [np.pi / 2])
    # Edge A along the frame's negative x axis, edge B at angle - pi: along negative y.
    np.testing.assert_allclose(corners.headings, [0.0], atol=1e-12)


def test_an_acute_obstacle_has_acute_corners():
    world = make_world(ARENA, [[[1, 1], [3, 1], [1, 2]]])
    assert len(world.corners) == 3
    assert world.corners.angles.sum() == pytest.approx(np.pi)


def test_a_convex_room_has_no_corners():
    assert len(make_world(ARENA).corners) == 0


def test_obstacles_that_touch_grow_together():
    world = make_world(ARENA, [BOX, [[2, 1], [3, 1], [3, 2], [2, 2]]])
    assert len(world.obstacles) == 1
    assert world.free_area == pytest.approx(14)
    beside_the_wall = make_world(ARENA, [[[0, 1], [1, 1], [1, 2], [0, 2]]])
    assert len(beside_the_wall.obstacles) == 0
    assert len(beside_the_wall.corners) == 2


@pytest.mark.parametrize(
    ("boundary", "obstacles", "message"),
    [
        ([], [], "`boundary` must be a list of .*no points"),
        ([[0, 0], [1, 1]], [], "`boundary` must enclose an area"),
        ([[0, 0], [1, 1], [2, 2]], [], "`boundary` must enclose an area"),
        ([[0, 0], [1, 1], [1, 0], [0, 1]], [], "`boundary` must not cross itself"),
        ([[0, 0], [1, np.nan], [1, 1]], [], "`boundary` must have finite coordinates"),
        ([[0, 0], [1e308, 0], [1e308, 1e308]], [], "`boundary` must have coordinates within"),
        (ARENA, [[[3, 3], [3, 1e308], [2, 3]]], r"`obstacles\[0\]` must have coordinates within"),
        (7, [], "`boundary` must be a list of .*got 7"),
        ([[0, 0, 0], [1, 0, 0], [1, 1, 0]], [], r"shape \(3, 3\)"),
        (ARENA, [[[3, 3], [5, 3], [5, 5]]], r"`obstacles\[0\]` must lie inside the boundary"),
        (ARENA, [[[1, 0], [2, 0], [2, 4], [1, 4]]], "must be one connected polygon"),
        (ARENA, [ARENA], "must be one connected polygon"),
        # Bars that overlap part the arena in two, or close off a yard.
        (ARENA, [[[1, 0], [2, 0], [2, 3], [1, 3]], [[1, 2], [2, 2], [2, 4], [1, 4]]], "connected"),
        (ARENA, [NORTH, EAST, SOUTH, WEST], "must be one connected polygon"),
    ],
)
def test_what_bounds_no_free_region_is_refused(boundary, obstacles, message):
    with pytest.raises(InvalidInput, match=message):
        make_world(boundary, obstacles)


def test_polygons_of_shapely_are_worlds_if_they_are_valid():
    assert world_from_polygon(shapely.box(0, 0, 2, 3)).free_area == pytest.approx(6)
    bow_tie = shapely.Polygon([[0, 0], [1, 1], [1, 0], [0, 1]])
    for bad in (bow_tie, shapely.Polygon(), shapely.Point(0, 0), None):
        with pytest.raises(InvalidInput, match="`free region` must be"):
            world_from_polygon(bad)


def test_size_and_tolerance_do_not_depend_on_the_pose():
    turned = np.array(ARENA) @ np.array([[0.6, 0.8], [-0.8, 0.6]])
    assert make_world(turned).tolerance == pytest.approx(make_world(ARENA).tolerance)
    assert make_world(np.array(ARENA) * 10.0).tolerance == pytest.approx(4e-8)


SIDE = 8


def box(x_low: float, y_low: float, x_high: float, y_high: float) -> np.ndarray:
    """A rectangle, shape (4, 2) [m]."""
    return np.array([[x_low, y_low], [x_high, y_low], [x_high, y_high], [x_low, y_high]], float)


SQUARE = box(0, 0, SIDE, SIDE)
A, B = box(1, 1, 4, 4), box(3, 3, 5, 5)
# A and B by hand.
UNION = [[1, 1], [4, 1], [4, 3], [5, 3], [5, 5], [3, 5], [3, 4], [1, 4]]

poses = st.tuples(
    st.floats(-math.pi, math.pi),
    st.floats(-100, 100),
    st.floats(-100, 100),
    st.sampled_from([0.01, 1 / 3, 1.0, 7.3]),
)


def place(ring: np.ndarray, pose: tuple[float, float, float, float]) -> np.ndarray:
    """A ring turned, shifted and scaled by (angle [rad], x [m], y [m], scale)."""
    angle, x, y, scale = pose
    c, s = math.cos(angle), math.sin(angle)
    return scale * (ring @ np.array([[c, s], [-s, c]]) + [x, y])


def placed_world(obstacles: Sequence[np.ndarray], pose) -> World:
    """The arena with obstacles, in a pose."""
    return make_world(place(SQUARE, pose), [place(ring, pose) for ring in obstacles])


def assert_whole(world: World) -> None:
    """Check what holds for every world: orientation, validity and area."""
    assert ring_area(world.boundary) > 0
    assert all(ring_area(ring) < 0 for ring in world.obstacles)
    assert world.polygon.is_valid
    assert world.polygon.area == pytest.approx(world.free_area)


def test_two_squares_that_overlap_are_their_union():
    united, drawn = make_world(SQUARE, [A, B]), make_world(SQUARE, [UNION])
    assert_whole(united)
    assert united.free_area == SIDE**2 - 9 - 4 + 1
    assert shapely.equals(united.polygon, drawn.polygon)
    for mine, other in zip(sorted_corners(united), sorted_corners(drawn), strict=True):
        np.testing.assert_allclose(mine, other)
    # Two of eight vertices are notches, behind which nothing hides.
    assert (united.vertex_count, len(united.corners)) == (12, 6)


def sorted_corners(world: World) -> list[tuple[float, ...]]:
    """Place, angle and heading of every corner, in an order of their own."""
    corners = world.corners
    columns = np.column_stack([corners.points, corners.angles, corners.headings])
    return sorted(map(tuple, columns.tolist()))


@pytest.mark.parametrize("obstacles", [(A, A), (A, box(2, 2, 3, 3)), (box(1, 1, 2, 4), A)])
def test_an_obstacle_within_another_adds_nothing(obstacles):
    for order in (obstacles, obstacles[::-1]):
        world = make_world(SQUARE, order)
        assert shapely.equals(world.polygon, make_world(SQUARE, [A]).polygon)
        assert world.vertex_count == 8


# What touches what, then obstacles, vertices and corners of the world, and the area covered.
CONTACTS = [
    ("an edge, all of it", [box(1, 1, 2, 2), box(2, 1, 3, 2)], (1, 8, 4, 2.0)),
    ("the middle of an edge", [box(1, 1, 2, 4), box(2, 2, 3, 3)], (1, 12, 6, 4.0)),
    ("an edge, past its ends", [box(1, 2, 2, 3), box(2, 1, 3, 4)], (1, 12, 6, 4.0)),
    ("three in a U", [box(1, 1, 4, 2), box(1, 2, 2, 4), box(3, 2, 4, 4)], (1, 12, 6, 7.0)),
    ("a row of four", [box(k, 1, k + 1, 2) for k in range(1, 5)], (1, 8, 4, 4.0)),
    ("a cross", [box(1, 2, 4, 3), box(2, 1, 3, 4)], (1, 16, 8, 5.0)),
    ("a wall", [box(0, 1, 2, 2)], (0, 8, 2, 2.0)),
    ("a corner of the arena", [box(0, 0, 2, 2)], (0, 6, 1, 4.0)),
    ("a wall, both of two that overlap", [box(0, 1, 2, 3), box(0, 2, 3, 4)], (0, 10, 3, 8.0)),
    # A point is no way through, and no common edge.
    ("a corner, corner to corner", [box(1, 1, 2, 2), box(2, 2, 3, 3)], (2, 12, 8, 2.0)),
    ("a corner, on an edge", [A, np.array([[4, 2], [6, 1], [6, 3.0]])], (2, 11, 7, 11.0)),
    ("a corner, on a wall", [np.array([[0, 2], [2, 1], [2, 3.0]])], (1, 7, 3, 2.0)),
]


@pytest.mark.parametrize(
    ("obstacles", "expected"), [c[1:] for c in CONTACTS], ids=[c[0] for c in CONTACTS]
)
@given(pose=poses)
def test_what_touches_touches_in_every_pose(obstacles, expected, pose):
    world = placed_world(obstacles, pose)
    assert_whole(world)
    covered = SIDE**2 - world.free_area / pose[3] ** 2
    found = len(world.obstacles), world.vertex_count, len(world.corners), covered
    assert found == (*expected[:3], pytest.approx(expected[3]))


@given(pose=poses)
def test_nothing_is_seen_along_a_common_edge(pose):
    world = placed_world([box(1, 2, 2, 3), box(2, 1, 3, 4)], pose)
    ends = place(np.array([[2, 1.5], [2, 3.5], [0.5, 2.5], [0.5, 1.5]]), pose)
    blocked, open_ = are_clear(build_edge_index(world), ends[[0, 2]], ends[[1, 3]])
    assert (blocked, open_) == (False, True)


numbers = st.integers(0, SIDE - 1)
sides = st.integers(1, 3)


@st.composite
def rectangles(draw) -> list[tuple[int, int, int, int]]:
    """Rectangles of whole cells in the arena, which touch and overlap as they like."""
    corners = draw(st.lists(st.tuples(numbers, numbers, sides, sides), min_size=1, max_size=8))
    return [(x, y, min(x + w, SIDE), min(y + h, SIDE)) for x, y, w, h in corners]


@given(cells=rectangles(), pose=poses)
def test_cells_that_are_counted_say_the_same(cells, pose):
    covered = np.zeros((SIDE, SIDE), bool)
    for x_low, y_low, x_high, y_high in cells:
        covered[x_low:x_high, y_low:y_high] = True
    # Cells are neighbours across an edge: nobody passes a point.
    labels = np.zeros(covered.shape, np.int32)
    parts = int(np.asarray(ndimage.label(~covered, output=labels)))
    obstacles = [box(*each) for each in cells]
    if parts != 1:
        with pytest.raises(InvalidInput, match="`free region` must be one connected polygon"):
            placed_world(obstacles, pose)
        return
    world = placed_world(obstacles, pose)
    assert_whole(world)
    assert world.free_area / pose[3] ** 2 == pytest.approx(np.sum(~covered))
    straight = make_world(SQUARE, obstacles[::-1])
    assert (len(world.obstacles), world.vertex_count, len(world.corners)) == (
        len(straight.obstacles),
        straight.vertex_count,
        len(straight.corners),
    )


@given(
    first=st.tuples(st.floats(0.5, 4), st.floats(0.5, 4), st.floats(0.5, 3), st.floats(0.5, 3)),
    second=st.tuples(st.floats(0.5, 4), st.floats(0.5, 4), st.floats(0.5, 3), st.floats(0.5, 3)),
    seed=st.integers(0, 2**32 - 1),
)
def test_a_segment_is_clear_of_the_union_if_it_is_clear_of_each(first, second, seed):
    rings = [box(x, y, x + w, y + h) for x, y, w, h in (first, second)]
    a, b = np.random.default_rng(seed).uniform(0, SIDE, (2, 200, 2))
    both = are_clear(build_edge_index(make_world(SQUARE, rings)), a, b)
    each = [are_clear(build_edge_index(make_world(SQUARE, [ring])), a, b) for ring in rings]
    np.testing.assert_array_equal(both, each[0] & each[1])


@pytest.mark.parametrize("gap", [-1e-10, 0.0, 1e-10])
def test_what_is_closer_than_the_tolerance_touches(gap):
    world = make_world(SQUARE, [box(1, 1, 2, 2), box(2 + gap, 1, 3, 2)])
    assert len(world.obstacles) == 1
    assert world.vertex_count == 8


def test_what_is_farther_apart_than_the_tolerance_does_not():
    gap = 3 * make_world(SQUARE).tolerance
    world = make_world(SQUARE, [box(1, 1, 2, 2), box(2 + gap, 1, 3, 2)])
    assert len(world.obstacles) == 2


def test_obstacles_that_stand_apart_are_taken_as_they_are():
    rings = [box(1, 1, 2, 2) / 3, box(2.1, 1, 3, 2) / 3]
    world = make_world(SQUARE, rings)
    assert sorted(map(tuple, np.concatenate(world.obstacles).tolist())) == sorted(
        map(tuple, np.concatenate(rings).tolist())
    )
