"""The visibility polygon holds what can be seen, and nothing else."""

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.edge_index import build_edge_index
from sightfield.systems.numerics.geometry.segment_sight import are_clear
from sightfield.systems.numerics.geometry.visibility_polygon import visibility_polygon
from sightfield.systems.numerics.geometry.world import make_world

ARENA = [[0, 0], [4, 0], [4, 4], [0, 4]]
BOX = [[1, 1], [2, 1], [2, 2], [1, 2]]


def view(world, point):
    return shapely.Polygon(visibility_polygon(build_edge_index(world), point))


def test_a_convex_room_is_seen_whole():
    assert view(make_world(ARENA), (1.0, 3.0)).area == pytest.approx(16.0)


def test_a_box_hides_what_stands_behind_it():
    # From (0, 1.5) the rays past (1, 1) and (1, 2) reach the walls at (3, 0) and (3, 0).
    hidden = shapely.Polygon([[1, 1], [3, 0], [4, 0], [4, 3.5], [1, 2]])
    expected = shapely.Polygon(ARENA).difference(hidden)
    seen = view(make_world(ARENA, [BOX]), (0.0, 1.5))
    assert seen.symmetric_difference(expected).area < 1e-9


@pytest.mark.parametrize(
    ("point", "area", "where"),
    [
        ((1.5, 1.0), 4.0, "in the box's lower edge: the strip below it"),
        ((1.0, 1.0), 7.0, "at the box's corner: the strips below and beside it"),
        ((0.0, 0.0), 16.0 - 7.0, "in the room's corner: all but box and shadow"),
        ((4.0, 1.5), 16.0 - 3.0, "in the wall: all but box and shadow"),
    ],
)
def test_from_the_boundary_the_free_side_is_seen(point, area, where):
    assert view(make_world(ARENA, [BOX]), point).area == pytest.approx(area), where


@pytest.mark.parametrize("seed", range(6))
def test_contains_exactly_the_points_with_a_clear_line(random_world, free_points, seed):
    world = random_world(seed, 1 + 8 * seed)
    index = build_edge_index(world)
    targets = np.random.default_rng(seed).uniform(0, 10, (1000, 2))
    for point in free_points(world, seed, 20):
        seen = view(world, point)
        assert seen.is_valid
        clear = are_clear(index, np.broadcast_to(point, targets.shape), targets)
        # A point on the rim may fall on either side by rounding.
        inland = shapely.distance(seen.exterior, shapely.points(targets)) > 1e-7
        inside = shapely.contains_xy(seen, targets)
        np.testing.assert_array_equal(inside[inland], clear[inland])


@pytest.mark.parametrize("angle", [0.3, np.pi / 4, 2.0])
@pytest.mark.parametrize("mirror", [False, True])
def test_the_view_moves_with_the_scene(random_world, free_points, moved, angle, mirror):
    world = random_world(3, 30)
    other, carry = moved(world, angle, mirror, 0.2, (-3.0, 50.0))
    for point in [*free_points(world, 5, 10), *np.concatenate(world.rings)[:40]]:
        expected = shapely.Polygon(carry(np.array(view(world, point).exterior.coords)))
        got = view(other, carry(point))
        assert got.symmetric_difference(expected).area < 1e-7 * expected.area


def test_a_point_in_an_obstacle_is_refused():
    index = build_edge_index(make_world(ARENA, [BOX]))
    with pytest.raises(InvalidInput, match=r"free region; got \[1.5, 1.5\]"):
        visibility_polygon(index, (1.5, 1.5))
