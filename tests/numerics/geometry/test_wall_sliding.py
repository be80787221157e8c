"""No step leaves the free region, and a blocked step slides."""

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.edge_index import build_edge_index, clearances
from sightfield.systems.numerics.geometry.wall_sliding import slide, stop_team
from sightfield.systems.numerics.geometry.world import make_world, shrink_world

ARENA = [[0, 0], [4, 0], [4, 4], [0, 4]]
BOX = [[1, 1], [2, 1], [2, 2], [1, 2]]
INDEX = build_edge_index(make_world(ARENA, [BOX]))


def test_an_open_step_is_taken_whole():
    assert slide(INDEX, 0.5, 0.5, 0.1, 0.2) == pytest.approx((0.1, 0.2), abs=1e-15)


def test_a_step_against_a_wall_keeps_its_part_along_the_wall():
    dx, dy = slide(INDEX, 1.5, 0.9, 0.3, 0.3)
    assert dx == pytest.approx(0.3, abs=1e-4)
    assert dy == pytest.approx(0.1, abs=1e-4)


def test_a_step_into_a_concave_corner_ends_in_it():
    dx, dy = slide(INDEX, 0.3, 0.2, -5.0, -7.0)
    assert (0.3 + dx, 0.2 + dy) == pytest.approx((0.0, 0.0), abs=1e-4)
    assert (0.3 + dx) > 0.0 < (0.2 + dy)


def test_a_chord_never_cuts_the_corner_that_the_slide_went_round():
    # Sliding along the box's left edge and past its upper corner, then right: the chord is cut.
    dx, dy = slide(INDEX, 0.9, 1.95, 0.5, 0.3)
    assert not shapely.Polygon(BOX).intersects(
        shapely.LineString([(0.9, 1.95), (0.9 + dx, 1.95 + dy)])
    )


@given(
    seed=st.integers(0, 10_000),
    speed=st.floats(0.001, 30.0),
    radius=st.sampled_from([0.0, 0.05, 0.16]),
)
def test_random_walks_never_enter_a_grown_obstacle(seed, speed, radius):
    rng = np.random.default_rng(seed)
    boxes = [BOX, [[2.5, 2.2], [3.5, 2.2], [3.0, 3.2]], [[2.2, 0.3], [3.6, 0.5], [2.9, 0.9]]]
    world = make_world(ARENA, boxes)
    parts = shrink_world(world, radius)
    index, true_index = build_edge_index(*parts), build_edge_index(world)
    free = shapely.union_all([part.polygon for part in parts])
    at = np.array([0.5, 0.5])
    for _ in range(60):
        step = slide(index, *at, *(speed * rng.normal(size=2)))
        path = shapely.LineString([at, at + step])
        assert free.contains(path) or step == (0.0, 0.0)
        at = at + step
        assert clearances(true_index, at[None])[0] >= radius


def test_a_point_in_an_obstacle_is_led_out_by_the_shortest_way():
    dx, dy = slide(INDEX, 1.9, 1.5, 0.0, 5.0)
    assert (dx, dy) == pytest.approx((0.1, 0.0), abs=1e-4)
    assert dx > 0.1
    dx, dy = slide(INDEX, 1.9, 1.5, 0.0, 0.01)
    assert (dx, dy) == pytest.approx((0.01, 0.0), abs=1e-12)


@pytest.mark.parametrize("angle", [0.4, 2.0])
@pytest.mark.parametrize("mirror", [False, True])
def test_steps_turn_with_the_scene(random_world, free_points, moved, angle, mirror):
    world = random_world(7, 40)
    other, carry = moved(world, angle, mirror, 3.0, (10.0, 20.0))
    index, other_index = build_edge_index(world), build_edge_index(other)
    rng = np.random.default_rng(0)
    for point in free_points(world, 1, 200):
        step = 0.5 * rng.normal(size=2)
        end = point + slide(index, *point, *step)
        start, aim = carry(point), carry(point + step)
        np.testing.assert_allclose(
            start + slide(other_index, *start, *(aim - start)), carry(end), atol=1e-9
        )


def test_a_stopped_step_ends_at_the_wall():
    parts = stop_team(INDEX, np.array([0.5, 0.5, 0, 1.5, 0.9, 0]), np.array([0.1, 0, 0, 0, 0.4, 0]))
    np.testing.assert_allclose(parts, [1.0, 0.25], atol=1e-4)


def test_a_robot_too_large_for_the_world_is_refused():
    with pytest.raises(InvalidInput, match=r"`radius` must leave free space.*got 2.5"):
        shrink_world(make_world(ARENA), 2.5)
    with pytest.raises(InvalidInput, match="`radius` must be zero or positive"):
        shrink_world(make_world(ARENA), -0.1)


def test_a_narrow_passage_splits_the_shrunk_world():
    hall = make_world([[0, 0], [5, 0], [5, 2], [3, 2], [3, 0.3], [2, 0.3], [2, 2], [0, 2]])
    assert len(shrink_world(hall, 0.1)) == 1
    assert [part.free_area for part in shrink_world(hall, 0.2)] == pytest.approx([2.56, 2.56])
