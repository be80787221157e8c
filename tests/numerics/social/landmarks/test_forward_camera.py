"""A level pinhole camera."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.social.landmarks.forward_camera import (
    ForwardCamera,
    project_forward,
)

CAMERA = ForwardCamera()


def test_what_is_straight_ahead_at_lens_height_appears_in_the_middle():
    point = np.array([[2.0, 3.0, CAMERA.lens_height]])
    seen = project_forward(CAMERA, np.array([2.0, 1.0, math.pi / 2]), point)
    assert seen == pytest.approx(CAMERA.centre[None])


def test_left_is_left_and_up_is_up():
    point = np.array([[1.0, 0.2, 0.5]])
    column, row = project_forward(CAMERA, np.zeros(3), point)[0]
    assert column < CAMERA.centre[0]
    assert row < CAMERA.centre[1]


def test_the_edge_of_the_field_of_view_is_the_edge_of_the_picture():
    half = 0.5 * CAMERA.field_of_view
    point = np.array([[math.cos(half), math.sin(half), CAMERA.lens_height]])
    assert project_forward(CAMERA, np.zeros(3), point)[0, 0] == pytest.approx(-0.5)


def test_what_is_behind_the_lens_does_not_appear():
    assert np.isnan(project_forward(CAMERA, np.zeros(3), np.array([[-1.0, 0.0, 0.1]]))).all()


def test_focal_length_and_pixel_density_are_those_of_the_thesis():
    # k_ppm f is the focal length in pixels.
    assert CAMERA.focal_length * CAMERA.pixel_density == pytest.approx(CAMERA.focal_pixels)


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ({"width": 8}, "`width` must be at least 16 pixels; got 8"),
        ({"field_of_view": 4.0}, "`field_of_view` must lie between 0 and pi rad; got 4.0"),
        ({"lens_height": 0.0}, "`lens_height` must be positive; got 0.0"),
    ],
)
def test_a_camera_that_cannot_be_is_refused(setting, message):
    with pytest.raises(InvalidInput, match=message):
        ForwardCamera(**setting)
