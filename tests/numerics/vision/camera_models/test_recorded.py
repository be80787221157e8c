"""What central cameras show, where they end, and what is written of them is as recorded."""

import math
from dataclasses import replace

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.vision.camera_models.camera_files import (
    forms_of,
    inverse_polynomial,
    load_camera_model,
    save_camera_model,
)
from sightfield.systems.numerics.vision.camera_models.camera_model import first_root, invert_rising
from sightfield.systems.numerics.vision.camera_models.central_cameras import (
    KannalaBrandtCamera,
    MeiCamera,
    ScaramuzzaCamera,
)

SIZE = {"width": 640, "height": 480}
FOLDED = {
    "fisheye": KannalaBrandtCamera(
        focal_x=300, focal_y=290, centre_x=320, centre_y=240, k1=-0.12, k3=-0.02, **SIZE
    ),
    "lens": MeiCamera(
        xi=1.6, focal_x=400, focal_y=410, centre_x=310, centre_y=245, k1=-0.3, k2=0.01, **SIZE
    ),
    "tangential": MeiCamera(
        xi=0.8,
        focal_x=240,
        focal_y=240,
        centre_x=310,
        centre_y=245,
        k1=-0.25,
        p1=0.01,
        p2=-0.02,
        **SIZE,
    ),
    "mirror": ScaramuzzaCamera(
        polynomial=(-150.0, 0.1, 2e-3, 3e-6), centre_x=318, centre_y=236, c=1.01, d=0.02, **SIZE
    ),
}


def rays_and_back(camera):
    """Rays of pixels to far outside the picture, and pixels of points in all directions."""
    rng = np.random.default_rng(0)
    pixels = rng.uniform([-300, -300], [940, 780], (90, 2))
    points = rng.normal(size=(90, 3))
    return camera.rays(pixels), camera.project(points)


def test_rays_and_pixels_are_as_recorded(camera, as_recorded):
    as_recorded(rays_and_back(camera), relative=1e-7)
    as_recorded([camera.names, camera.vector], "parameters")


@pytest.mark.parametrize("name", FOLDED)
def test_where_a_model_turns_back_is_as_recorded(name, as_recorded):
    rays, pixels = rays_and_back(FOLDED[name])
    assert np.isnan(pixels).any()
    as_recorded([rays, pixels], relative=1e-7)
    ends = {key: getattr(FOLDED[name], key, None) for key in ("largest_angle", "least_z", "rim")}
    as_recorded(ends, "ends")


def test_the_derivative_of_a_lens_is_that_of_small_steps(cameras):
    camera = cameras["mei"]
    plane = np.random.default_rng(1).uniform(-0.9, 0.9, (20, 2))
    _, slopes = camera._distorted(plane)
    for k in range(2):
        step = np.zeros(2)
        step[k] = 1e-6
        ahead, behind = (camera._distorted(plane + s)[0] for s in (step, -step))
        np.testing.assert_allclose(slopes[:, :, k], (ahead - behind) / 2e-6, atol=1e-8)


def test_a_hyperbolic_mirror_is_as_recorded(as_recorded):
    sizes = {"foci": 0.11, "latus_rectum": 0.07, "focal_length": 640.0}
    made = MeiCamera.of_hyperbolic_mirror(**sizes, centre=(301.0, 255.0), **SIZE)
    as_recorded(made)
    for name in sizes:
        with pytest.raises(InvalidInput, match=f"`{name}` must be positive; got 0"):
            MeiCamera.of_hyperbolic_mirror(**{**sizes, name: 0.0}, centre=(301, 255), **SIZE)


def test_a_picture_s_farthest_corner_has_a_ray(cameras):
    camera = cameras["scaramuzza"]
    corners = np.array([[-0.5, -0.5], [639.5, -0.5], [639.5, 479.5], [-0.5, 479.5]])
    stretch = np.linalg.inv([[camera.c, camera.d], [camera.e, 1.0]])
    away = (corners - [camera.centre_x, camera.centre_y])[:, ::-1] @ stretch.T
    farthest = np.hypot(*away.T).max()
    assert camera.rim == pytest.approx(farthest, rel=1e-8)
    assert np.isfinite(camera.rays(corners)).all()
    assert math.cos(camera.largest_angle) == pytest.approx(camera.rays(corners)[:, 2].min())


@pytest.mark.parametrize("form", ["sightfield", "ocamcalib", "opencv", "kalibr"])
def test_what_is_written_of_cameras_is_as_recorded(form, cameras, tmp_path, as_recorded):
    for name, camera in cameras.items():
        plain = replace(camera, skew=0.0) if name != "scaramuzza" else camera
        plain = replace(plain, k3=0.0) if name == "mei" else plain
        if form not in forms_of(plain):
            continue
        save_camera_model(tmp_path / name, plain, form)
        assert load_camera_model(tmp_path / name) == plain
        text = (tmp_path / name).read_text()
        if form == "ocamcalib":
            # Its second polynomial is fitted, and no more certain than its last digits.
            lines = text.splitlines()
            text = "\n".join(line for k, line in enumerate(lines) if k != 6)
            as_recorded(inverse_polynomial(plain), "inverse", relative=1e-4)
        as_recorded(text, name)


def test_the_second_polynomial_has_as_few_terms_as_will_do():
    # A parabola and a straight line need few.
    mild = ScaramuzzaCamera(polynomial=(-300.0, 0.0, 1e-4), centre_x=320, centre_y=240, **SIZE)
    steep = ScaramuzzaCamera(
        polynomial=(-60.0, 0.0, 5e-3, 0.0, 4e-9), centre_x=320, centre_y=240, **SIZE
    )
    few, many = inverse_polynomial(mild), inverse_polynomial(steep)
    assert 7 <= len(few) < len(many) <= 21
    for camera, inverse in ((mild, few), (steep, many)):
        radius = np.linspace(0, camera.rim, 1001)
        depth = -np.polynomial.polynomial.polyval(radius, camera.polynomial)
        shown = np.polynomial.polynomial.polyval(np.arctan2(-depth, radius), inverse)
        assert np.abs(shown - radius).max() < (0.011 if len(inverse) < 21 else 1.0)


def test_numbers_of_files_are_counted(cameras, tmp_path):
    save_camera_model(tmp_path / "omni", replace(cameras["mei"], skew=0.0, k3=0.0), "kalibr")
    text = (tmp_path / "omni").read_text()
    for old, new in (
        ("distortion_model: radtan", "distortion_model: fov"),
        ("  - 0.93\n", ""),
        ("  - 640\n", "  - 640.5\n"),
        ("  - 640\n", "  - wide\n"),
        ("cam0", "cam1"),
    ):
        assert old in text
        (tmp_path / "wrong").write_text(text.replace(old, new, 1))
        with pytest.raises(InvalidInput):
            load_camera_model(tmp_path / "wrong")
    # Without distortion its numbers do not matter.
    (tmp_path / "none").write_text(text.replace("radtan", "none"))
    bare = load_camera_model(tmp_path / "none")
    assert (bare.k1, bare.k2, bare.p1, bare.p2) == (0, 0, 0, 0)
    assert bare.xi == 0.93


def test_a_skewed_lens_has_no_place_in_kalibr_s_file(cameras):
    assert forms_of(replace(cameras["kannala_brandt"], skew=0.0)) == (
        "sightfield",
        "opencv",
        "kalibr",
    )
    assert forms_of(cameras["kannala_brandt"]) == ("sightfield", "opencv")
    assert forms_of(cameras["mei"]) == ("sightfield",)
    assert forms_of(cameras["scaramuzza"]) == ("sightfield", "ocamcalib")


def test_a_polynomial_of_three_terms_is_enough_and_one_that_does_not_stretch_is_not():
    grid = {"centre_x": 1e6, "centre_y": -1e6, **SIZE}
    ScaramuzzaCamera(polynomial=(-1.0, 0.0, 0.0), **grid)
    for wrong in (
        {"polynomial": (-1.0, 0.0)},
        {"polynomial": (0.0, 0.0, 1.0)},
        {"polynomial": (-1.0, 0.0, math.inf)},
        {"c": 0.5, "d": 0.5, "e": 1.0},
        {"centre_x": 1.1e6},
        {"height": 0},
    ):
        with pytest.raises(InvalidInput):
            ScaramuzzaCamera(**{"polynomial": (-1.0, 0.0, 0.0), **grid, **wrong})


def test_curves_with_a_flat_place_are_inverted_and_none_is_left_out():
    def flat(x):
        return 1.0 - (1.0 - x) ** 3, 3 * (1.0 - x) ** 2

    values = np.array([0.0, 1e-12, 0.3, 0.99, 1.0 - 1e-12, 1.0, -1e-9, 1.0 + 1e-9])
    found = invert_rising(flat, values, 1.0)
    assert np.isnan(found).tolist() == [False] * 6 + [True] * 2
    assert flat(found[:6])[0] == pytest.approx(values[:6], abs=1e-13)
    assert invert_rising(flat, np.array([]), 1.0).shape == (0,)


@pytest.mark.parametrize(
    ("coefficients", "root"),
    [
        ([0.0, 1.0], math.inf),
        ([1.0, -1.0], 1.0),
        ([6.0, -5.0, 1.0], 2.0),
        ([-6.0, -1.0, 1.0], 3.0),
        ([2.0, 3.0, 1.0], math.inf),
        ([1.0, -2.0, 1.0 + 1e-6], math.inf),
        ([1.0, -0.5, 1e-250], 2.0),
        ([5.0], math.inf),
    ],
)
def test_the_first_root_is_the_least_that_is_real_and_positive(coefficients, root):
    assert first_root(coefficients) == pytest.approx(root)
