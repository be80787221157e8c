"""Every model's rays go back to their pixels, and each agrees with a second source of its own."""

import math
from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.vision.camera_models.camera_model import (
    angle_between,
    first_root,
    in_picture,
    invert_rising,
)
from sightfield.systems.numerics.vision.camera_models.central_cameras import (
    KannalaBrandtCamera,
    MeiCamera,
    ScaramuzzaCamera,
)

SIZE = {"width": 640, "height": 480}


def grid(camera, count=15):
    """Pixels all over the picture, its corners among them."""
    columns = np.linspace(-0.5, camera.width - 0.5, count)
    rows = np.linspace(-0.5, camera.height - 0.5, count)
    return np.stack(np.meshgrid(columns, rows), axis=-1).reshape(-1, 2)


def come_back(camera):
    """Rays of all pixels that have one lead back to them, from any distance."""
    pixels = grid(camera)
    rays = camera.rays(pixels)
    seen = np.isfinite(rays).all(axis=1)
    assert np.linalg.norm(rays[seen], axis=1) == pytest.approx(1.0, abs=1e-12)
    away = rays[seen] * np.linspace(0.1, 30, seen.sum())[:, None]
    assert camera.project(away) == pytest.approx(pixels[seen], abs=1e-9 * 640)
    return seen.mean()


def between(low, high):
    return st.floats(low, high)


centres = {"centre_x": between(250, 390), "centre_y": between(180, 300)}


@settings(max_examples=20)
@given(
    st.builds(
        MeiCamera,
        xi=between(0, 2.5),
        focal_x=between(150, 900),
        focal_y=between(150, 900),
        skew=between(-3, 3),
        k1=between(-0.2, 0.2),
        k2=between(-0.02, 0.05),
        k3=between(-0.002, 0.002),
        p1=between(-0.004, 0.004),
        p2=between(-0.004, 0.004),
        width=st.just(640),
        height=st.just(480),
        **centres,
    )
)
def test_rays_of_any_mei_camera_lead_back(camera):
    come_back(camera)


@settings(max_examples=20)
@given(
    st.builds(
        KannalaBrandtCamera,
        focal_x=between(120, 900),
        focal_y=between(120, 900),
        skew=between(-3, 3),
        k1=between(-0.1, 0.1),
        k2=between(-0.02, 0.02),
        k3=between(-0.004, 0.004),
        k4=between(-0.0005, 0.0005),
        width=st.just(640),
        height=st.just(480),
        **centres,
    )
)
def test_rays_of_any_fisheye_lead_back(camera):
    come_back(camera)


@settings(max_examples=20)
@given(
    st.tuples(
        between(-700, -80),
        st.just(0.0),
        between(-1e-3, 3e-3),
        between(-3e-6, 3e-6),
        between(0, 2e-8),
    ),
    st.tuples(between(0.95, 1.05), between(-0.05, 0.05), between(-0.05, 0.05)),
    between(250, 390),
    between(180, 300),
)
def test_rays_of_any_scaramuzza_camera_lead_back(polynomial, stretch, x, y):
    c, d, e = stretch
    come_back(
        ScaramuzzaCamera(polynomial=polynomial, centre_x=x, centre_y=y, c=c, d=d, e=e, **SIZE)
    )


def test_these_cameras_see_from_all_of_their_picture(camera):
    assert come_back(camera) > 0.9


def test_the_axis_is_the_centre(camera):
    centre = [[camera.centre_x, camera.centre_y]]
    assert camera.rays(np.array(centre)) == pytest.approx(np.array([[0, 0, 1]]), abs=1e-12)
    assert camera.project(np.array([[0.0, 0, 2]])) == pytest.approx(np.array(centre), abs=1e-9)


def test_right_is_x_and_down_is_y(camera):
    right, down = camera.project(np.array([[0.1, 0, 1], [0, 0.1, 1]])) - [331.5, 228.25]
    assert right[0] > 10 * abs(right[1])
    assert down[1] > 10 * abs(down[0])


def test_what_a_model_does_not_show_is_nan(camera):
    seen = np.isfinite(camera.project(np.array([[0, 0, 0.0], [0, 0, -1.0], [0, 0, 1.0]])))
    assert seen.all(axis=1).tolist() == [False, False, True]
    assert camera.project(np.empty((0, 3))).shape == (0, 2)


def test_parameters_go_to_a_vector_and_back(camera):
    assert len(camera.names) == len(camera.vector)
    moved = camera.with_vector(camera.vector * 1.01)
    assert moved.vector == pytest.approx(camera.vector * 1.01)
    assert camera.with_vector(camera.vector) == camera


def test_pictures_end_where_they_end(camera):
    places = [[-0.5, 0], [-0.6, 0], [639.4, 479.4], [639.5, 100], [math.nan, 3]]
    assert in_picture(camera, np.array(places)).tolist() == [True, False, True, False, False]


def test_a_fisheye_is_that_of_opencv(cameras):
    camera = cameras["kannala_brandt"]
    rays = camera.rays(grid(camera))
    points = rays[rays[:, 2] > 0.2]
    flat = replace(camera, skew=0.0)
    turn, move = np.array([0.1, -0.2, 0.3]), np.array([0.2, 0.1, 0.4])
    theirs, _ = cv2.fisheye.projectPoints(
        points.reshape(-1, 1, 3),
        turn,
        move,
        flat.matrix,
        np.array([flat.k1, flat.k2, flat.k3, flat.k4]),
    )
    ours = flat.project(points @ cv2.Rodrigues(turn)[0].T + move)
    assert ours == pytest.approx(theirs.reshape(-1, 2), abs=1e-9)


def test_without_xi_mei_is_the_pinhole_of_opencv(cameras):
    camera = replace(cameras["mei"], xi=0.0, skew=0.0)
    rng = np.random.default_rng(0)
    points = np.column_stack([rng.uniform(-0.5, 0.5, (40, 2)), rng.uniform(1, 2, 40)])
    theirs, _ = cv2.projectPoints(
        points,
        np.zeros(3),
        np.zeros(3),
        camera.matrix,
        np.array([camera.k1, camera.k2, camera.p1, camera.p2, camera.k3]),
    )
    assert camera.project(points) == pytest.approx(theirs.reshape(-1, 2), abs=1e-9)


def test_mei_with_xi_1_is_a_parabola_and_so_a_scaramuzza_of_degree_2():
    focal = 230.0
    mei = MeiCamera(xi=1.0, focal_x=focal, focal_y=focal, centre_x=300, centre_y=250, **SIZE)
    # (x, y, 1 / 2 - r^2 / 2) with r in units of the focal length.
    polynomial = (-focal / 2, 0.0, 0.5 / focal)
    other = ScaramuzzaCamera(polynomial=polynomial, centre_x=300, centre_y=250, **SIZE)
    pixels = grid(mei)
    assert angle_between(mei.rays(pixels), other.rays(pixels)).max() < 1e-12


def test_a_hyperbolic_mirror_reflects_as_the_model_says():
    foci, latus, focal = 0.09, 0.05, 700.0
    camera = MeiCamera.of_hyperbolic_mirror(
        foci=foci, latus_rectum=latus, focal_length=focal, centre=(320, 240), **SIZE
    )
    # The hyperbola about the middle of the foci, z towards the pinhole: z^2 / a^2 - r^2 / b^2 = 1
    # with c = foci / 2, latus rectum 2 b^2 / a. The mirror is its sheet round the far focus.
    c = foci / 2
    a = (math.hypot(latus, 2 * foci) - latus) / 4
    b = math.sqrt(c**2 - a**2)
    assert 2 * b**2 / a == pytest.approx(latus)
    r = np.linspace(0.001, 0.05, 30)
    depth = -a * np.sqrt(1 + r**2 / b**2)
    # The pinhole at +c sees the mirror's point; the normal is the gradient of the equation.
    towards = np.column_stack([r, depth - c])
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    normal = np.column_stack([-r / b**2, depth / a**2])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    leaving = towards - 2 * np.sum(towards * normal, axis=1, keepdims=True) * normal
    # All rays come from the far focus, at -c.
    from_focus = np.column_stack([r, depth + c])
    from_focus /= np.linalg.norm(from_focus, axis=1, keepdims=True)
    assert leaving == pytest.approx(from_focus, abs=1e-9)
    pixels = np.column_stack([320 + focal * r / (c - depth), np.full(30, 240.0)])
    expected = np.column_stack([leaving[:, 0], np.zeros(30), leaving[:, 1]])
    assert camera.rays(pixels) == pytest.approx(expected, abs=1e-9)


def test_scaramuzza_is_what_ocamcalib_computes(cameras):
    camera = cameras["scaramuzza"]
    # As cam2world does it, in its own frame: x down, y right, z towards the viewer.
    row, column = 101.0, 477.0
    inverse = np.linalg.inv([[camera.c, camera.d], [camera.e, 1.0]])
    x, y = inverse @ [row - camera.centre_y, column - camera.centre_x]
    rho = math.hypot(x, y)
    z = sum(a * rho**n for n, a in enumerate(camera.polynomial))
    theirs = np.array([x, y, z]) / math.sqrt(x * x + y * y + z * z)
    ours = camera.rays(np.array([[column, row]]))[0]
    assert [ours[1], ours[0], -ours[2]] == pytest.approx(theirs, abs=1e-12)


def test_beyond_the_fold_there_are_no_rays():
    fisheye = KannalaBrandtCamera(
        focal_x=300, focal_y=300, centre_x=320, centre_y=240, k1=-0.3, **SIZE
    )
    assert fisheye.largest_angle == pytest.approx(math.sqrt(1 / 0.9))
    edge = 300 * fisheye.largest_angle * (1 - 0.3 / 0.9)
    rays = fisheye.rays(np.array([[320 + edge - 0.01, 240], [320 + edge + 0.01, 240]]))
    assert np.isnan(rays).any(axis=1).tolist() == [False, True]
    behind = np.array([[math.sin(1.1), 0, math.cos(1.1)]])
    assert np.isnan(fisheye.project(behind)).all()


def test_behind_the_widest_ray_of_a_lens_with_xi_above_1_nothing_is_seen():
    camera = MeiCamera(xi=2.0, focal_x=400, focal_y=400, centre_x=320, centre_y=240, **SIZE)
    widest = math.acos(-1 / 2)
    for angle, seen in ((widest - 1e-6, True), (widest + 1e-6, False)):
        pixel = camera.project(np.array([[math.sin(angle), 0, math.cos(angle)]]))
        assert np.isfinite(pixel).all() == seen


def test_curves_are_inverted_to_the_last_bits():
    def cubic(x):
        return x + x**3, 1 + 3 * x**2

    values = np.array([0.0, 1e-9, 0.5, 1.0, 2.0, 2.1])
    found = invert_rising(cubic, values, 1.0)
    assert found[:5] + found[:5] ** 3 == pytest.approx(values[:5], rel=1e-14)
    assert np.isnan(found[5])
    assert first_root([-6.0, 11.0, -6.0, 1.0]) == pytest.approx(1.0)
    assert first_root([1.0, 0.0, 1.0]) == math.inf
    assert first_root([1.0, 0.0, 0.0]) == math.inf


@pytest.mark.parametrize(
    ("model", "change", "message"),
    [
        ("mei", {"xi": -0.1}, "`xi` must be zero or positive; got -0.1"),
        ("mei", {"focal_x": 0.0}, "`focal_x` must be positive; got 0.0"),
        ("kannala_brandt", {"k3": math.nan}, "`k3` must be a finite number; got nan"),
        ("kannala_brandt", {"width": 0}, "`width` must be a positive whole number; got 0"),
        ("scaramuzza", {"polynomial": (1.0, 0.0, 0.1)}, "`polynomial` must begin with a_0 < 0"),
        ("scaramuzza", {"polynomial": (-1.0,)}, "`polynomial` must have a_0, a_1, a_2"),
        ("scaramuzza", {"c": 0.0, "d": 0.0}, "`c, d, e` must stretch a picture"),
    ],
)
def test_what_is_no_camera_is_refused(cameras, model, change, message):
    with pytest.raises(InvalidInput) as refused:
        replace(cameras[model], **change)
    assert str(refused.value).startswith(message)
