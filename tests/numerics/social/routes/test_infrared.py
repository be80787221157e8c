"""Infrared ranges: what is nearest in each cone."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.edge_index import build_edge_index
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.social.landmarks.thesis_maze import thesis_maze
from sightfield.systems.numerics.social.routes.infrared import InfraredRing, infrared_ranges

RING = InfraredRing()
RADIUS = 0.1
ROOM = build_edge_index(make_world([[0, 0], [4, 0], [4, 4], [0, 4]])).edges


def ranges_at(*poses, edges=ROOM, ring=RING):
    return infrared_ranges(edges, np.array(poses, dtype=float), RADIUS, ring)


def test_in_the_open_all_say_their_reach():
    np.testing.assert_array_equal(ranges_at([2, 2, 0.3]), np.full((1, 4), RING.reach))


def test_a_wall_ahead_is_told_by_the_two_in_front_at_its_distance():
    # At 0.35 m from the middle; the outer cones begin at 50 degrees.
    (found,) = ranges_at([3.65, 2, 0])
    outer = min(0.35 / math.cos(math.radians(50)) - RADIUS, RING.reach)
    np.testing.assert_allclose(found, [outer, 0.25, 0.25, outer])


def test_a_wall_on_the_left_is_told_by_the_left():
    (found,) = ranges_at([2, 3.8, 0])
    inner = 0.2 / math.sin(math.radians(50)) - RADIUS
    np.testing.assert_allclose(found, [0.1, inner, RING.reach, RING.reach])


def test_what_is_behind_is_not_felt():
    np.testing.assert_array_equal(ranges_at([0.2, 2, 0]), np.full((1, 4), RING.reach))


def test_robots_feel_each_other_from_rim_to_rim():
    found = ranges_at([2, 2, 0], [2.35, 2, math.pi])
    np.testing.assert_allclose(found[:, 1:3], 0.15)
    # Each reaches beyond 50 degrees only at less than 0.13 m between the middles.
    np.testing.assert_array_equal(found[:, [0, 3]], RING.reach)


def test_a_robot_that_follows_is_felt_by_the_follower_alone():
    follower, leader = ranges_at([2, 2, 0], [2.35, 2, 0])
    assert follower.min() == pytest.approx(0.15)
    assert leader.min() == RING.reach


def test_turning_and_moving_everything_changes_nothing():
    square = np.array([[0, 0], [4, 0], [4, 4], [0, 4]])
    turn, shift = 0.7, np.array([3.0, -5.0])
    turned = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
    poses = np.array([[3.7, 1.9, 0.4], [3.4, 2.1, -1.0], [0.3, 0.3, 3.8]])
    moved = np.column_stack([poses[:, :2] @ turned.T + shift, poses[:, 2] + turn])
    edges = build_edge_index(make_world(square @ turned.T + shift)).edges
    np.testing.assert_allclose(ranges_at(*moved, edges=edges), ranges_at(*poses), atol=1e-12)


def test_walls_are_as_near_as_many_rays_find_them():
    edges = build_edge_index(thesis_maze().world).edges
    generator = np.random.default_rng(0)
    ring = InfraredRing(reach=1.0)
    for x, y, heading in generator.uniform([0.15, 0.15, -3], [0.35, 2.3, 3], (30, 3)):
        (found,) = ranges_at([x, y, heading], edges=edges, ring=ring)
        for bearing, told in zip(ring.bearings, found, strict=True):
            rays = heading + bearing + np.linspace(-0.5, 0.5, 2001) * ring.cone
            nearest = min(nearest_along(edges, x, y, rays).min() - RADIUS, ring.reach)
            assert told == pytest.approx(nearest, abs=2e-4)


def nearest_along(edges, x, y, angles):
    """Distance to the first wall along each ray, shape (n,)."""
    ux, uy = np.cos(angles)[:, None], np.sin(angles)[:, None]
    cx, cy = edges[:, 2] - x, edges[:, 3] - y
    ex, ey = edges[:, 4] - edges[:, 2], edges[:, 5] - edges[:, 3]
    with np.errstate(divide="ignore", invalid="ignore"):
        across = ux * ey - uy * ex
        along = (cx * ey - cy * ex) / across
        part = (cx * uy - cy * ux) / across
        hit = (along > 0) & (part >= 0) & (part <= 1)
        return np.where(hit, along, np.inf).min(axis=1)


def test_four_cones_cover_the_front_and_a_little_more():
    assert math.degrees(RING.coverage) == pytest.approx(100)
    gap = InfraredRing(bearings=(1.0, -1.0), cone=0.5)
    assert gap.coverage == 0.0
    assert InfraredRing(bearings=(0.0,), cone=1.0).coverage == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"bearings": ()}, "`bearings` must hold a sensor"),
        ({"bearings": (-1.0, 1.0)}, "`bearings` must go from left to right"),
        ({"cone": 4.0}, "`cone` must lie between"),
        ({"reach": 0.0}, "`reach` must be positive"),
    ],
)
def test_bad_rings_are_named(change, message):
    with pytest.raises(InvalidInput, match=message):
        InfraredRing(**change)
