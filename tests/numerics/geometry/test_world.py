"""A world is one free region with holes, whatever order its rings come in."""

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.rings import clean_ring, ring_area
from sightfield.systems.numerics.geometry.world import make_world, world_from_polygon

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
