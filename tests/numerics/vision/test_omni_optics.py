"""Rays off a mirror ball, and back."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.vision.omni_optics import (
    OmniCamera,
    bearing_of,
    floor_range,
    pixel_rays,
    project_omni,
)

CAMERA = OmniCamera()
CAMERAS = st.builds(
    OmniCamera,
    mirror_radius=st.floats(0.01, 0.2),
    mirror_distance=st.floats(0.02, 0.5),
    pinhole_height=st.floats(0.05, 1.0),
    focal_length=st.floats(100, 2000),
    centre=st.tuples(st.floats(250, 390), st.floats(180, 300)),
)


def pixels_on(camera: OmniCamera, radii: np.ndarray, bearings: np.ndarray) -> np.ndarray:
    return camera.axis_pixel + np.stack(
        [radii * np.sin(bearings), -radii * np.cos(bearings)], axis=1
    )


def test_on_the_axis_the_camera_sees_itself():
    points, directions = pixel_rays(CAMERA, CAMERA.axis_pixel[None])
    np.testing.assert_allclose(points, [[0, 0, 0.37]], atol=1e-15)
    np.testing.assert_allclose(directions, [[0, 0, -1]], atol=1e-15)


@given(CAMERAS, st.floats(0, 0.999), st.floats(-math.pi, math.pi))
def test_rays_leave_the_ball_as_the_law_of_reflection_says(camera, share, bearing):
    radius = share * camera.rim_radius
    (point,), (direction,) = pixel_rays(
        camera, pixels_on(camera, np.array([radius]), np.array([bearing]))
    )
    centre = np.array([0, 0, camera.mirror_height])
    normal = (point - centre) / camera.mirror_radius
    incoming = point - [0, 0, camera.pinhole_height]
    incoming /= np.linalg.norm(incoming)
    assert np.linalg.norm(normal) == pytest.approx(1, abs=1e-12)
    assert np.linalg.norm(direction) == pytest.approx(1, abs=1e-12)
    # Equal angles to the normal, on its two sides, in one plane.
    assert direction @ normal == pytest.approx(-incoming @ normal, abs=1e-12)
    assert direction @ np.cross(incoming, normal) == pytest.approx(0, abs=1e-12)
    # The pinhole's picture of the point is where it should be.
    assert math.hypot(*point[:2]) / (point[2] - camera.pinhole_height) == pytest.approx(
        radius / camera.focal_length, abs=1e-12
    )


@given(
    CAMERAS,
    st.lists(
        st.tuples(st.floats(0.001, 0.999), st.floats(-math.pi, math.pi), st.floats(1e-3, 1e3)),
        min_size=1,
        max_size=20,
    ),
)
def test_a_point_on_a_pixels_ray_appears_at_that_pixel(camera, samples):
    share, bearing, length = np.array(samples).T
    pixels = pixels_on(camera, share * camera.rim_radius, bearing)
    points, directions = pixel_rays(camera, pixels)
    found, visible = project_omni(camera, points + length[:, None] * directions)
    np.testing.assert_allclose(found, pixels, atol=1e-9)
    inside = ((pixels >= -0.5) & (pixels < np.array([camera.width, camera.height]) - 0.5)).all(
        axis=1
    )
    np.testing.assert_array_equal(visible, inside)


def test_the_mirror_keeps_bearings_with_the_front_at_the_top_and_the_left_at_the_right():
    bearings = np.linspace(-3, 3, 13)
    points = np.stack([0.8 * np.cos(bearings), 0.8 * np.sin(bearings), 0 * bearings], axis=1)
    pixels, visible = project_omni(CAMERA, points)
    assert visible.all()
    np.testing.assert_allclose(bearing_of(CAMERA, pixels), bearings, atol=1e-12)
    front, left = project_omni(CAMERA, np.array([[1.0, 0, 0], [0, 1.0, 0]]))[0] - CAMERA.axis_pixel
    np.testing.assert_allclose(front, [0, -math.hypot(*front)], atol=1e-9)
    np.testing.assert_allclose(left, [math.hypot(*front), 0], atol=1e-9)


def test_near_the_axis_the_mirror_images_as_its_focus_does():
    # Paraxial: the ball's mirror point is at the angle u = p L / (f R), and the ray leaves at
    # 2 u + p / f from straight down.
    p, floor = 0.01, CAMERA.pinhole_height + CAMERA.mirror_distance
    ray = p / CAMERA.focal_length
    aperture = ray * CAMERA.mirror_distance
    expected = aperture + floor * (2 * aperture / CAMERA.mirror_radius + ray)
    assert float(floor_range(CAMERA, p)) == pytest.approx(expected, rel=1e-7)


def test_a_far_pinhole_sees_a_floor_point_by_the_ball_alone():
    # Parallel light: p / f H = R sin(beta) and the ray leaves at 2 beta.
    camera = OmniCamera(mirror_distance=1e5, focal_length=2e9, pinhole_height=1.0)
    beta = 0.6
    radius = camera.focal_length * camera.mirror_radius * math.sin(beta) / camera.mirror_distance
    height = camera.mirror_height - camera.mirror_radius * math.cos(beta)
    plane = height - 0.3
    expected = camera.mirror_radius * math.sin(beta) + 0.3 * math.tan(2 * beta)
    assert float(floor_range(camera, radius, plane)) == pytest.approx(expected, rel=1e-5)


@given(CAMERAS, st.floats(0.0, 0.04), st.floats(0.01, 20.0))
def test_floor_range_undoes_projection(camera, height, distance):
    pixels, _ = project_omni(camera, np.array([[distance, 0.0, height]]))
    radius = np.hypot(*(pixels[0] - camera.axis_pixel))
    # A pixel's range grows without bound at the horizon: judge it there in pixels.
    near, far = floor_range(camera, np.array([radius - 1e-8, radius + 1e-8]), height)
    assert near <= distance <= far or float(floor_range(camera, radius, height)) == pytest.approx(
        distance, rel=1e-9
    )


def test_ranges_grow_outwards_to_infinity_at_the_horizon_and_end_at_the_rim():
    radii = np.linspace(0, CAMERA.rim_radius + 2, 400)
    ranges = floor_range(CAMERA, radii)
    finite = np.isfinite(ranges)
    assert ranges[0] == 0
    assert (np.diff(ranges[finite]) > 0).all()
    horizon = np.flatnonzero(np.isinf(ranges))[0]
    assert finite[:horizon].all()
    np.testing.assert_array_equal(np.isnan(ranges), radii > CAMERA.rim_radius)


def test_the_mirror_hides_what_is_in_it_or_in_its_shadow():
    centre = np.array([0, 0, CAMERA.mirror_height])
    offsets = np.array([[0, 0, 0], [0, 0, 1], [0.05, 0, 1]])
    pixels, visible = project_omni(CAMERA, centre + offsets)
    assert not visible.any()
    assert np.isnan(pixels).all()
    beyond = CAMERA.axis_pixel + np.array([[CAMERA.rim_radius + 1, 0]])
    points, directions = pixel_rays(CAMERA, beyond)
    assert np.isnan(points).all()
    assert np.isnan(directions).all()


def test_what_the_ball_shows_outside_the_picture_is_not_visible():
    cropped = OmniCamera(width=200, height=200)
    pixels, visible = project_omni(cropped, np.array([[0.3, 0, 0], [3.0, 0, 0]]))
    np.testing.assert_array_equal(visible, [True, False])
    assert np.isfinite(pixels).all()


def test_the_focus_is_a_quarter_of_the_diameter_above_the_mirrors_lowest_point():
    lowest = CAMERA.pinhole_height + CAMERA.mirror_distance
    assert CAMERA.focus_height - lowest == pytest.approx(2 * CAMERA.mirror_radius / 4)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"mirror_radius": 0.0}, "`mirror_radius` must be positive; got 0.0"),
        ({"focal_length": math.nan}, "`focal_length` must be a finite number; got nan"),
        ({"width": 3.5}, "`width` must be a positive whole number; got 3.5"),
        ({"centre": (1.0, math.inf)}, "`centre` must be a finite number; got inf"),
    ],
)
def test_impossible_cameras_are_refused(change, message):
    with pytest.raises(InvalidInput, match=message):
        OmniCamera(**change)
