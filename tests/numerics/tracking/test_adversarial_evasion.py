"""Evaders make for the corner that hides them soonest."""

import numpy as np
import pytest

from sightfield.systems.numerics.geometry.edge_index import build_edge_index
from sightfield.systems.numerics.geometry.segment_sight import build_corner_index
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.tracking.adversarial_evasion import (
    adversarial_velocities,
    corner_stance,
)
from sightfield.systems.numerics.tracking.corner_game import corner_table
from sightfield.systems.numerics.tracking.sight_state import observe

ARENA = [[0, 0], [4, 0], [4, 4], [0, 4]]
BOX = [[1.5, 1.5], [2.5, 1.5], [2.5, 2.5], [1.5, 2.5]]


def flee(pursuers, evaders, obstacles=(BOX,), ratio=0.5, standoff=0.0):
    world = make_world(ARENA, obstacles)
    index, corners = build_edge_index(world), corner_table(world)
    p, e = np.ravel(pursuers).astype(float), np.ravel(evaders).astype(float)
    sight = observe(index, build_corner_index(world, index), p, e)
    velocity = adversarial_velocities(p, e, sight, corners, ratio, 0.2, standoff)
    return velocity.reshape(-1, 2)


def test_an_evader_beside_the_sight_ray_steps_across_it():
    # The pursuer looks along the box's lower side; just above the ray past (2.5, 1.5) is shadow.
    velocity = flee([(0.3, 0.3)], [(3.5, 1.8)])[0]
    assert np.hypot(*velocity) == pytest.approx(0.2)
    ray = np.array([2.5, 1.5]) - (0.3, 0.3)
    assert ray[0] * velocity[1] - ray[1] * velocity[0] > 0


def test_every_evader_runs_at_full_speed_while_it_is_seen():
    velocity = flee([(0.3, 0.3), (3.7, 3.7)], [(3.5, 1.0), (0.4, 2.0), (2.0, 0.5)])
    np.testing.assert_allclose(np.hypot(*velocity.T), 0.2)


def test_an_evader_that_nobody_sees_waits():
    assert not flee([(2.0, 0.5)], [(2.0, 3.5)]).any()


@pytest.mark.parametrize("shift", range(3))
def test_without_corners_it_runs_from_the_nearest_pursuer_whatever_its_number(shift):
    pursuers = np.roll([(1.0, 1.0), (3.0, 1.0), (2.5, 3.5)], shift, axis=0)
    velocity = flee(pursuers, [(1.0, 2.0)], obstacles=())
    np.testing.assert_allclose(velocity, [[0.0, 0.2]])


def test_of_two_corners_the_one_that_can_be_won_is_chosen():
    # The pursuer stands level with the box's upper corner and far below its lower one, which is
    # nearer to the evader: round that one it escapes, straight to the corner.
    evader = np.array([2.8, 1.4])
    velocity = flee([(3.9, 2.4)], [evader], ratio=0.9)[0]
    towards = np.array([2.5, 1.5]) - evader
    assert velocity @ towards > 0.9 * 0.2 * np.hypot(*towards)


def test_a_corner_that_a_pursuer_sees_round_does_not_count():
    # The pursuer looks along both sides of the box that meet in the nearest corner (2.5, 1.5), so
    # that nothing is hidden there: the evader makes straight for the next one.
    evader = np.array([3.1, 1.0])
    towards = np.array([1.5, 1.5]) - evader
    velocity = flee([(3.1, 1.3)], [evader])[0]
    np.testing.assert_allclose(velocity, 0.2 * towards / np.hypot(*towards))


@pytest.mark.parametrize("seed", range(20))
def test_an_evader_knows_no_left_and_right(seed):
    # Mirrored about x = 2, on which the box is symmetric.
    rng = np.random.default_rng(seed)
    points = rng.uniform(0.1, 3.9, (40, 2))
    outside = (np.abs(points - 2.0) > 0.55).any(axis=1)
    pursuers, evaders = points[outside][:2], points[outside][2:4]
    mirror = np.array([-1.0, 1.0])
    shift = np.array([4.0, 0.0])
    seen = flee(pursuers, evaders)
    mirrored = flee(pursuers * mirror + shift, evaders * mirror + shift)
    np.testing.assert_allclose(mirrored, seen * mirror, atol=1e-9)


def test_the_stance_is_the_corner_of_the_grown_obstacle():
    world = make_world(ARENA, [BOX])
    for x, y, heading, angle in corner_table(world)[:, :4]:
        dx, dy = corner_stance(x, y, heading, angle, 0.1)
        grown = np.array([x, y]) + 0.1 * np.sign(np.array([x, y]) - 2.0)
        np.testing.assert_allclose([x + dx, y + dy], grown)


@pytest.mark.parametrize("mirror", [False, True])
@pytest.mark.parametrize("angle", [0.7, 2.5])
def test_velocities_turn_with_the_scene(mirror, angle):
    c, s = np.cos(angle), np.sin(angle)
    matrix = np.array([[c, -s], [s, c]]) @ np.diag([1.0, -1.0 if mirror else 1.0])
    rng = np.random.default_rng(2)
    world, boxes = np.array(ARENA), np.array(BOX)
    points = rng.uniform(0.1, 1.4, (4, 2)) + np.array([[0, 0], [2.5, 0], [0, 2.5], [2.5, 2.5]])

    def velocities(turn):
        arena = make_world(world @ turn.T, [boxes @ turn.T])
        index, corners = build_edge_index(arena), corner_table(arena)
        at = points @ turn.T
        p, e = at[:2].ravel(), at[2:].ravel()
        sight = observe(index, build_corner_index(arena, index), p, e)
        return adversarial_velocities(p, e, sight, corners, 0.5, 0.2, 0.05).reshape(-1, 2)

    np.testing.assert_allclose(velocities(matrix), velocities(np.eye(2)) @ matrix.T, atol=1e-12)
