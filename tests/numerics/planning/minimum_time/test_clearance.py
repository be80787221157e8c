"""Free room around a cart for the programme, against distances of the polygons."""

import math

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.planning.footprint import covering_discs, signed_distance
from sightfield.systems.numerics.planning.minimum_time.clearance import (
    FACED,
    FacedWalls,
    distance_spline,
    faced_walls,
)
from sightfield.systems.numerics.planning.trailer import Trailer

RADIUS = 2.0
CART = Trailer(speed=RADIUS, hitch_offset=0.1)
DISCS = covering_discs(CART)
TRIANGLE = [(4.0, 2.0), (5.5, 2.5), (4.2, 4.0)]


@pytest.fixture(scope="module")
def world():
    """A room of 9 by 6 with a triangle in it."""
    return make_world([(0, 0), (9, 0), (9, 6), (0, 6)], [TRIANGLE])


def poses(world, count, seed):
    """States with all discs' centres in free space, shape (count, 4)."""
    rng, found = np.random.default_rng(seed), []
    while len(found) < count:
        state = rng.uniform((0, 0, -math.pi, -1.2), (9, 6, math.pi, 1.2))
        centres = np.array([DISCS.centre(k, state) for k in range(len(DISCS))])
        if shapely.covers(world.polygon, shapely.points(centres)).all():
            found.append(state)
    return np.array(found)


def free_distances(world, states):
    """Of every disc at every pose, by the polygons, shape (n, k) [m]."""
    each = [
        signed_distance(world, np.stack(DISCS.centre(k, states.T), axis=1)) - DISCS.radii[k]
        for k in range(len(DISCS))
    ]
    return np.stack(each, axis=1)


def in_radii(states):
    return states / [RADIUS, RADIUS, 1.0, 1.0]


def test_the_least_distance_from_faced_walls_is_the_worlds(world):
    states = poses(world, 200, seed=1)
    walls = faced_walls(world, DISCS, states)
    free = FacedWalls(DISCS, RADIUS, looks=2).function()
    found = np.array(
        [
            np.array(free(state, ends.T / RADIUS)).ravel()
            for state, ends in zip(in_radii(states), walls, strict=True)
        ]
    )
    least = found.reshape(len(states), len(DISCS), FACED).min(axis=2)
    np.testing.assert_allclose(least, free_distances(world, states), atol=1e-5)


def test_in_a_corridors_end_a_disc_faces_three_walls():
    corridor = make_world([(0, 0), (9, 0), (9, 0.8), (0, 0.8)])
    state = np.array([[8.5 - 0.5 * CART.length, 0.4, 0.0, 0.0]])
    front = int(np.argmax(DISCS.offsets[: DISCS.bodies.index(1)]))
    walls = faced_walls(corridor, DISCS, state)[0].reshape(len(DISCS), FACED, 2, 2)[front]
    middles = {tuple(np.round(wall.mean(axis=0), 6).tolist()) for wall in walls}
    assert middles == {(4.5, 0.0), (4.5, 0.8), (9.0, 0.4)}


def test_the_spline_is_as_good_as_its_grid_and_knows_the_frame(world):
    goal = np.array([3.0, 1.0, 0.7])
    c, s = math.cos(goal[2]), math.sin(goal[2])
    states = poses(world, 50, seed=2)
    local = states.copy()
    dx, dy = states[:, 0] - goal[0], states[:, 1] - goal[1]
    local[:, 0], local[:, 1] = c * dx + s * dy, c * dy - s * dx
    local[:, 2] -= goal[2]
    free = distance_spline(world, DISCS, RADIUS).function()
    found = np.array([np.array(free(state, goal)).ravel() for state in in_radii(local)])
    # A third of a cell of 9 / 120.
    np.testing.assert_allclose(found, free_distances(world, states), atol=0.025)


def test_between_two_walls_the_spline_is_too_low_and_faced_walls_are_exact(gap_world):
    state = np.array([[4.0, 3.275, 0.0, 0.0]])
    cart = Trailer()
    discs = covering_discs(cart)
    exact = FacedWalls(discs, 1.0, looks=2).function()
    ends = faced_walls(gap_world, discs, state)[0]
    assert float(np.min(exact(state[0], ends.T))) == pytest.approx(0.025, abs=1e-6)
    spline = distance_spline(gap_world, discs, 1.0).function()
    assert float(np.min(spline(state[0], np.zeros(3)))) < 0.005
