"""Calibrations find the camera that took the pictures, and say how surely."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from scipy.optimize._numdiff import approx_derivative
from scipy.stats import t as student

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.vision.boards.board import Checkerboard, board_pose, find_corners
from sightfield.systems.numerics.vision.boards.calibrate import (
    calibrate_on_board,
    first_guess,
    fixed_names,
    nearest_camera,
)
from sightfield.systems.numerics.vision.boards.fit import (
    _Problem,
    fit_aspect,
    fit_camera,
    fit_intervals,
    held_out_residuals,
    rms_of,
)
from sightfield.systems.numerics.vision.camera_models.camera_model import angle_between

FIXED = ("k3", "p1", "p2")
TILTS = [(0.3, 0.1, 0.0), (-0.3, 0.2, 0.2), (0.1, -0.4, 0.0), (0.2, 0.3, -0.3)]


def fitted(scene, pictures=None, model="mei"):
    return calibrate_on_board(
        scene.board, pictures or scene.pictures, width=640, height=480, model=model
    )


def test_exact_corners_give_back_the_camera_and_the_poses(mirror):
    fit = fitted(mirror)
    assert fit.converged
    assert fit.camera.vector == pytest.approx(mirror.camera.vector, rel=1e-5, abs=1e-6)
    assert fit.rms < 1e-6
    for found, true in zip(fit.poses, mirror.poses, strict=True):
        assert found.translation == pytest.approx(true.translation, abs=1e-6)
        assert found.rotation == pytest.approx(true.rotation, abs=1e-6)


@pytest.mark.parametrize("model", ["scaramuzza", "kannala_brandt"])
def test_other_models_see_the_same_bearings(mirror, model):
    fit = fitted(mirror, model=model)
    pixels = np.concatenate(mirror.pictures)
    apart = angle_between(fit.camera.rays(pixels), mirror.camera.rays(pixels))
    assert np.degrees(apart).max() < 0.2
    assert fit.rms < 0.1


def test_a_picture_and_its_copy_are_not_two_pictures(mirror):
    corners = mirror.pictures[0]
    nearly = corners + 0.002 * np.random.default_rng(0).standard_normal(corners.shape)
    with pytest.raises(InvalidInput, match="`pictures` must differ from each other; got number 2"):
        fitted(mirror, [*mirror.pictures[:2], nearly])


def test_the_first_guess_is_near(mirror):
    guess = first_guess(mirror.board.points, mirror.pictures, 640, 480)
    assert np.hypot(guess.centre_x - 331, guess.centre_y - 229) < 6
    pixels = np.concatenate(mirror.pictures)
    assert np.degrees(angle_between(guess.rays(pixels), mirror.camera.rays(pixels))).mean() < 5


def test_a_pose_from_exact_rays_is_exact(mirror):
    for true, pixels in zip(mirror.poses, mirror.pictures, strict=True):
        found = board_pose(mirror.camera, mirror.board.points, pixels)
        assert found.rotation == pytest.approx(true.rotation, abs=1e-6)
        assert found.translation == pytest.approx(true.translation, abs=1e-6)


def test_the_derivative_by_blocks_is_that_of_the_whole(mirror):
    problem = _Problem(
        mirror.camera, mirror.board.points, np.stack(mirror.noisy(0.3, 1)), True, np.arange(10)
    )
    dense = approx_derivative(problem.residuals, problem.start, method="3-point")
    blocks = problem.derivative(problem.start)
    scale = np.linalg.norm(dense, axis=0)
    assert np.abs((blocks - dense) / scale).max() < 1e-5


def test_errors_of_the_fit_are_as_large_as_it_says(mirror):
    normal = []
    for seed in range(6):
        fit = fit_camera(mirror.camera, mirror.board.points, mirror.noisy(0.3, seed), fixed=FIXED)
        free = fit.deviations > 0
        normal.append((fit.camera.vector - mirror.camera.vector)[free] / fit.deviations[free])
    # Chi squared of 6 x 7 numbers, correlated among the 7, has a mean of 1.
    assert 0.4 < np.mean(np.square(normal)) < 2.0


def test_intervals_end_where_the_best_fit_is_so_much_worse(mirror):
    pictures, points = mirror.noisy(0.3, 4)[:6], mirror.board.points
    fit = fit_camera(mirror.camera, points, pictures, fixed=FIXED)
    ends = fit_intervals(fit, points, pictures, fixed=FIXED)
    assert np.array_equal(ends[fit.deviations == 0], np.zeros((3, 2)))
    squares = np.sum(fit.residuals**2)
    linear = student.ppf(0.975, fit.freedom) * fit.deviations
    for name in ("xi", "k1", "centre_x"):
        index = next(k for k, each in enumerate(fit.camera.names) if each.startswith(f"{name} "))
        for end in ends[index]:
            # The slow way: a whole fit from the start, with the parameter held.
            vector = fit.camera.vector
            vector[index] = end
            held = fit_camera(
                fit.camera.with_vector(vector), points, pictures, fixed=(*FIXED, name)
            )
            excess = (np.sum(held.residuals**2) / squares - 1) * fit.freedom
            assert excess == pytest.approx(student.ppf(0.975, fit.freedom) ** 2, rel=0.03)
        longer = np.diff(ends[index])[0] / (2 * linear[index])
        # The centre is a linear problem; xi and k1 lie along a valley that bends.
        assert longer > 1.1 if name != "centre_x" else longer == pytest.approx(1, abs=0.03)
    half = fit_intervals(fit, points, pictures, fixed=FIXED, confidence=0.5)
    free = fit.deviations > 0
    assert np.all((ends[free, 0] < half[free, 0]) & (half[free, 1] < ends[free, 1]))


def test_where_pictures_leave_a_parameter_open_its_interval_has_no_end(mirror):
    # Boards near the axis alone tell xi and focal length together, neither of the two.
    points = mirror.board.points
    place = np.array([0.0, 0.0, 0.6]) - [*points.mean(axis=0), 0.0]
    pictures = [
        mirror.camera.project(points @ turn[:, :2].T + place)
        for turn in (cv2.Rodrigues(np.array(tilt))[0] for tilt in TILTS)
    ]
    rng = np.random.default_rng(0)
    pictures = [each + 0.3 * rng.standard_normal(each.shape) for each in pictures]
    fixed = (*FIXED, "k1", "k2")
    fit = fit_camera(mirror.camera, points, pictures, fixed=fixed)
    ends = fit_intervals(fit, points, pictures, fixed=fixed)
    assert np.isinf(ends[0, 1])
    assert ends[0, 0] < mirror.camera.xi


def test_the_size_of_a_board_cannot_be_told_and_changes_no_camera(mirror):
    pictures = mirror.noisy(0.2, 7)
    fits = [
        fit_camera(mirror.camera, scale * mirror.board.points, pictures, fixed=FIXED)
        for scale in (1.0, 1.3)
    ]
    assert fits[1].rms == pytest.approx(fits[0].rms, rel=1e-6)
    assert fits[1].camera.vector == pytest.approx(fits[0].camera.vector, rel=1e-5, abs=1e-6)
    far = [np.linalg.norm(fit.poses[0].translation) for fit in fits]
    assert far[1] / far[0] == pytest.approx(1.3, rel=1e-4)


@pytest.mark.parametrize("stretch", [1.0, 1.03])
def test_a_ruler_that_is_wrong_in_one_direction_is_noticed(mirror, stretch):
    measured = mirror.board.points * [1.0, 1 / stretch]
    pictures = mirror.noisy(0.2, 5)
    fit = fit_camera(mirror.camera, measured, pictures, fixed=FIXED)
    free = fit_aspect(fit, measured, pictures, fixed=FIXED)
    assert free.aspect == pytest.approx(stretch, abs=4 * free.aspect_deviation)
    assert (abs(free.aspect - 1) > 4 * free.aspect_deviation) == (stretch != 1)


def test_pictures_left_out_are_met_as_well_as_their_noise(mirror):
    held = held_out_residuals(
        mirror.camera, mirror.board.points, mirror.noisy(0.3, 2), folds=2, fixed=FIXED
    )
    assert held.shape == (10, 35, 2)
    # 0.3 px in each of two coordinates.
    assert rms_of(held) == pytest.approx(0.3 * np.sqrt(2), rel=0.1)


def test_the_nearest_camera_of_the_same_model_is_the_camera(mirror):
    pixels = np.concatenate(mirror.pictures)
    near = nearest_camera("mei", mirror.camera, pixels)
    assert near.project(mirror.camera.rays(pixels)) == pytest.approx(pixels, abs=1e-4)


def test_corners_are_found_where_they_were_drawn():
    board = Checkerboard(columns=5, rows=4, square_width=1.0, square_height=1.0)
    picture = np.full((200, 240), 255, np.uint8)
    for row in range(5):
        for column in range(6):
            if (row + column) % 2 == 0:
                x, y = 30 + 30 * column, 25 + 30 * row
                picture[y : y + 30, x : x + 30] = 0
    found = find_corners(picture, board)
    assert found is not None
    drawn = 30 * board.points + [59.5, 54.5]
    # A board is also itself turned by half, or seen from behind.
    nearest = np.abs(found[:, None] - drawn[None]).max(axis=2).min(axis=1)
    assert nearest.max() < 0.1
    assert find_corners(np.full((200, 240), 255, np.uint8), board) is None


def test_what_is_no_board_and_no_calibration_is_refused(mirror):
    with pytest.raises(InvalidInput, match="`columns` must be a whole number of at least 3; got 2"):
        Checkerboard(columns=2, rows=5, square_width=1, square_height=1)
    with pytest.raises(InvalidInput, match=r"`columns \* rows` must be at most 100000; got 1000"):
        Checkerboard(columns=10**6, rows=10**6, square_width=1, square_height=1)
    with pytest.raises(InvalidInput, match="`square_height` must be of a size from 1e-18 to"):
        Checkerboard(columns=4, rows=5, square_width=1, square_height=1e300)
    with pytest.raises(InvalidInput, match="`square_width` must be positive; got 0"):
        Checkerboard(columns=4, rows=5, square_width=0, square_height=1)
    with pytest.raises(
        InvalidInput, match="`pictures` must show the board at least 3 times; got 2"
    ):
        fitted(mirror, mirror.pictures[:2])
    with pytest.raises(InvalidInput, match="`model` must be one of scaramuzza, mei"):
        fitted(mirror, model="pinhole")
    with pytest.raises(InvalidInput, match="`folds` must be from 2 to 10; got 1"):
        held_out_residuals(mirror.camera, mirror.board.points, mirror.pictures, folds=1)
    fit = fitted(mirror)
    with pytest.raises(InvalidInput, match=r"`confidence` must lie in \(0, 1\); got 95"):
        fit_intervals(fit, mirror.board.points, mirror.pictures, confidence=95)
    with pytest.raises(InvalidInput, match="`fixed` must be one of xi, focal_x"):
        fit_camera(mirror.camera, mirror.board.points, mirror.pictures, fixed=("k9",))


def test_only_a_decentred_mirror_frees_what_turns_the_frame():
    assert fixed_names("mei") == ("k3", "p1", "p2")
    assert fixed_names("mei", decentred=True) == ("k3",)
    assert fixed_names("kannala_brandt", decentred=True) == ()


def test_a_mirror_off_its_axis_is_found_so(mirror):
    true = replace(mirror.camera, p1=0.004, p2=-0.003)
    points = mirror.board.points
    pictures = [true.project(pose.place(points)) for pose in mirror.poses]
    fit = calibrate_on_board(
        mirror.board, pictures, width=640, height=480, model="mei", decentred=True
    )
    assert fit.camera.vector == pytest.approx(true.vector, rel=1e-4, abs=1e-5)


def test_a_turned_board_is_the_same_board(mirror):
    turned = [each[::-1] for each in mirror.pictures]
    fit = fit_camera(mirror.camera, mirror.board.points, turned, fixed=FIXED)
    assert fit.rms < 1e-5
