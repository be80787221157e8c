"""Equations (2.14) and (2.15), and Figure 2.28."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.social.landmarks.forward_camera import (
    ForwardCamera,
    project_forward,
)
from sightfield.systems.numerics.social.landmarks.maze import upright_square
from sightfield.systems.numerics.social.localisation.perspective import (
    edge_bearing,
    edge_distance,
    middle_by_size,
    square_by_edges,
)

CAMERA = ForwardCamera()
ORIGIN = np.zeros(3)

# Ahead and left [m], and how far the front is turned off the camera [rad].
poses = st.tuples(st.floats(0.4, 2.5), st.floats(-0.5, 0.5), st.floats(-1.1, 1.1))


def seen(pose, side=0.26, height=0.18):
    ahead, share, turn = pose
    left = share * ahead
    facing = math.atan2(-left, -ahead) + turn
    square = upright_square(np.array([ahead, left, height]), side, facing)
    return np.array([ahead, left, facing]), project_forward(CAMERA, ORIGIN, square)


def test_an_edge_twice_as_far_looks_half_as_long():
    assert edge_distance(CAMERA, 0.26, 50.0) == pytest.approx(
        2 * edge_distance(CAMERA, 0.26, 100.0)
    )


def test_the_printed_distance_is_a_depth():
    bearing = math.radians(30)
    exact = edge_distance(CAMERA, 0.26, 80.0, bearing)
    assert edge_distance(CAMERA, 0.26, 80.0, bearing, printed=True) == pytest.approx(
        exact * math.cos(bearing)
    )


@pytest.mark.parametrize("bearing", [-0.5, 0.0, 0.3])
def test_a_bearing_is_read_off_the_column(bearing):
    point = np.array([[math.cos(bearing), math.sin(bearing), 0.1]])
    assert edge_bearing(CAMERA, project_forward(CAMERA, ORIGIN, point)[0, 0]) == pytest.approx(
        bearing
    )


@given(poses)
def test_two_edges_tell_where_the_camera_is(pose):
    truth, corners = seen(pose)
    found = square_by_edges(CAMERA, corners, 0.26)
    assert found is not None
    assert found[:2] == pytest.approx(truth[:2], abs=1e-6)
    assert math.cos(found[2] - truth[2]) == pytest.approx(1.0)


def test_as_printed_they_tell_it_only_for_what_is_ahead():
    for share, worst in ((0.0, 0.03), (0.4, 0.6)):
        truth, corners = seen((1.2, share, 0.3))
        found = square_by_edges(CAMERA, corners, 0.26, printed=True)
        assert found is None or math.dist(found[:2], truth[:2]) < worst
    assert found is None or math.dist(found[:2], truth[:2]) > 0.05


@given(poses)
def test_apparent_size_tells_how_far_the_middle_is(pose):
    truth, corners = seen(pose, side=0.14)
    found = middle_by_size(CAMERA, corners, 0.14)
    # The middle of the corners is not quite where the square's middle appears.
    assert found == pytest.approx(truth[:2], rel=0.02, abs=0.01)


def test_edges_that_no_square_has_tell_nothing():
    corners = np.array([[100.0, 100], [300, 190], [300, 210], [100, 300]])
    assert square_by_edges(CAMERA, corners, 0.26) is None
    assert square_by_edges(CAMERA, corners[[3, 2, 1, 0]], 0.26) is None


def test_an_edge_without_length_is_refused():
    with pytest.raises(InvalidInput, match=r"`pixels` must be positive; got 0\.0"):
        edge_distance(CAMERA, 0.26, 0.0)
