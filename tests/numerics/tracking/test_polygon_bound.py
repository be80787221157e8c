"""The least time of escape among polygons is that of the corner which is lost soonest."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.geometry.edge_index import build_edge_index
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.tracking.corner_game import (
    corner_table,
    escape_time,
    least_escape_time,
    to_corner_frame,
)

RATIO, SPEED = 0.5, 0.3
# One corner at the origin, its obstacle to the south-west.
ONE = make_world([[0, 0], [0, -4], [4, -4], [4, 4], [-4, 4], [-4, 0]])
BOX = make_world([[-4, -4], [4, -4], [4, 4], [-4, 4]], [[[-1, -1], [1, -1], [1, 1], [-1, 1]]])


def least(world, pursuer, evader):
    return least_escape_time(
        build_edge_index(world),
        corner_table(world),
        np.array(pursuer),
        np.array(evader),
        RATIO,
        SPEED,
    )


def alone(world, number, pursuer, evader):
    x, y, heading, angle = corner_table(world)[number, :4]
    state = to_corner_frame(*pursuer, *evader, x, y, heading, angle)[:4]
    return escape_time(*state, angle, RATIO, SPEED)


@pytest.mark.parametrize(
    ("pursuer", "evader"), [((2.0, -3.0), (-0.1, 1.1)), ((0.5, -1.0), (0.2, 0.4)), ((1, 1), (2, 2))]
)
def test_with_one_corner_it_is_that_corners(pursuer, evader):
    assert least(ONE, pursuer, evader) == alone(ONE, 0, pursuer, evader)


def test_of_two_corners_in_sight_the_sooner_counts():
    pursuer, evader = (0.3, -3.0), (-1.2, -0.9)
    each = [alone(BOX, k, pursuer, evader) for k in range(4)]
    # The evader sees the corners on the left, and both see the one below it.
    seen = [k for k, (x, y, *_) in enumerate(corner_table(BOX)) if x < 0 and y < 0]
    assert least(BOX, pursuer, evader) == each[seen[0]]
    assert math.isfinite(each[seen[0]])


def test_corners_that_only_one_of_them_sees_do_not_count():
    # Each in line with its own side of the box: they see each other and nothing in common.
    assert least(BOX, (3.0, 3.0), (3.5, 3.5)) == math.inf
