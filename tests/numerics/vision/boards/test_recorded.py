"""Calibrations on few noisy pictures of a board are as recorded."""

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.vision.boards.board import (
    Checkerboard,
    Pose,
    board_pose,
    copied,
)
from sightfield.systems.numerics.vision.boards.calibrate import (
    calibrate_on_board,
    first_guess,
    fixed_names,
    nearest_camera,
    with_degree,
)
from sightfield.systems.numerics.vision.boards.fit import (
    fit_aspect,
    fit_camera,
    fit_intervals,
    held_out_residuals,
    rms_of,
)

# Minima are met to about this share.
MET = 1e-4


def numbers_of(fit):
    """What is recorded of a fit, without the rounds that it took."""
    return {
        "names": fit.camera.names,
        "values": fit.camera.vector,
        "deviations": fit.deviations,
        "aspect": [fit.aspect, fit.aspect_deviation],
        "freedom": fit.freedom,
        "rms": fit.rms,
        "converged": fit.converged,
        "places": np.array([pose.translation for pose in fit.poses]),
    }


def test_a_first_guess_is_as_recorded(mirror, as_recorded):
    guess = first_guess(mirror.board.points, mirror.noisy(0.5, 3)[:4], 640, 480)
    as_recorded(guess, relative=MET)
    as_recorded(with_degree(guess, 4), "degree 4", relative=MET)
    with pytest.raises(InvalidInput, match="`degree` must be at least 2; got 1"):
        with_degree(guess, 1)
    assert with_degree(guess, 2) == guess
    first_guess(mirror.board.points, mirror.pictures[:3], 640, 480)


@pytest.mark.parametrize(
    ("model", "decentred"),
    [("scaramuzza", True), ("mei", True), ("mei_k3", False), ("kannala_brandt", False)],
)
def test_a_calibration_by_each_model_is_as_recorded(mirror, model, decentred, as_recorded):
    fit = calibrate_on_board(
        mirror.board,
        mirror.noisy(0.2, 5)[:4],
        width=640,
        height=480,
        model=model,
        decentred=decentred,
    )
    as_recorded([fit.rms, fit.converged, fit.freedom, fit.camera.names], "fit", relative=1e-3)
    rays = fit.camera.rays(np.concatenate(mirror.pictures[:2]))
    as_recorded(rays, "rays", relative=1e-3)
    as_recorded(fixed_names(model, decentred=decentred), "fixed")


@pytest.mark.parametrize("model", ["scaramuzza", "kannala_brandt"])
def test_the_nearest_camera_of_each_model_is_as_recorded(mirror, model, as_recorded):
    pixels = np.concatenate(mirror.pictures[:4])
    near = nearest_camera(model, mirror.camera, pixels)
    as_recorded(near.rays(pixels), relative=1e-3)
    with pytest.raises(InvalidInput, match="`pixels` must have at least 20 rays; got 19"):
        nearest_camera(model, mirror.camera, pixels[:19])
    nearest_camera(model, mirror.camera, pixels[:20])


def test_fits_their_intervals_and_what_is_left_out_are_as_recorded(mirror, as_recorded):
    points, pictures = mirror.board.points, mirror.noisy(0.3, 6)[:4]
    fixed = ("k2", "k3", "p1", "p2")
    fit = fit_camera(mirror.camera, points, pictures, fixed=fixed)
    as_recorded(numbers_of(fit), "fit", relative=MET)
    as_recorded(fit_intervals(fit, points, pictures, fixed=fixed), "ends", relative=1e-3)
    free = fit_aspect(fit, points * [1.0, 0.98], pictures, fixed=fixed)
    as_recorded(numbers_of(free), "aspect", relative=MET)
    ends = fit_intervals(free, points * [1.0, 0.98], pictures, fixed=fixed, confidence=0.7)
    as_recorded(ends, "ends with aspect", relative=1e-3)
    held = held_out_residuals(mirror.camera, points, pictures, folds=2, fixed=fixed)
    as_recorded([rms_of(each) for each in held], "held", relative=MET)
    assert fit.freedom == 4 * 70 - 6 - 4 * 6
    assert free.freedom == fit.freedom - 1


def test_pictures_with_no_more_numbers_than_are_fitted_are_refused(mirror):
    points, pixels = mirror.board.points[:4], [each[:4] for each in mirror.pictures]
    # Each picture has 8 numbers for 6 of its own: 4 of them leave 8 for the camera's 10.
    with pytest.raises(InvalidInput, match="`pictures` must hold over 40 numbers; got 40"):
        fit_camera(mirror.camera, points, pixels[:5])


def test_models_are_known_by_name(mirror):
    pixels = mirror.pictures[0]
    for call in (
        lambda: fixed_names("pinhole"),
        lambda: nearest_camera("pinhole", mirror.camera, pixels),
    ):
        with pytest.raises(InvalidInput, match="`model` must be one of scaramuzza, mei, mei_k3"):
            call()
    two = mirror.pictures[:2]
    with pytest.raises(InvalidInput, match="show the board at least 3 times; got 2"):
        first_guess(mirror.board.points, two, 640, 480)
    with pytest.raises(InvalidInput, match="`folds` must be from 2 to 2; got 3"):
        held_out_residuals(mirror.camera, mirror.board.points, two, folds=3)


def test_boards_end_where_they_say():
    board = Checkerboard(columns=3, rows=4, square_width=0.5, square_height=0.25)
    assert board.points[[0, 1, 3, 11]].tolist() == [[0, 0], [0.5, 0], [0, 0.25], [1, 0.75]]
    sizes = {"square_width": 1.0, "square_height": 1.0}
    assert len(Checkerboard(columns=1000, rows=100, **sizes).points) == 100_000
    for wrong in ((1000, 101), (2, 4), (4, 2), (4.0, 4), (True, 4)):
        with pytest.raises(InvalidInput):
            Checkerboard(columns=wrong[0], rows=wrong[1], **sizes)


def test_a_pose_puts_points_where_the_board_is():
    turn = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    placed = Pose(turn, np.array([1.0, 2.0, 3.0])).place(np.array([[0.5, 0.0], [0.0, 0.25]]))
    assert placed.tolist() == [[1.0, 2.5, 3.0], [1.0, 2.0, 3.25]]


def test_corners_that_differ_by_less_than_a_hundredth_of_a_pixel_are_a_copy(mirror):
    corners = mirror.pictures[0]
    for off, same in ((0.0099, True), (0.0101, False)):
        moved = corners.copy()
        moved[3, 1] += off
        assert copied(corners, [mirror.pictures[1], moved]) == same
    assert not copied(corners, [])


def test_four_rays_give_a_pose_and_three_do_not(mirror):
    points, pixels = mirror.board.points, mirror.pictures[2].copy()
    four = [0, 6, 30, 17]
    found = board_pose(mirror.camera, points[four], pixels[four])
    assert found.translation == pytest.approx(mirror.poses[2].translation, abs=1e-6)
    with pytest.raises(InvalidInput, match="`pixels` must have at least four rays; got 3"):
        board_pose(mirror.camera, points[four[:3]], pixels[four[:3]])
    # What has no ray is left out.
    pixels[8] = np.nan
    again = board_pose(mirror.camera, points, pixels)
    assert again.rotation == pytest.approx(mirror.poses[2].rotation, abs=1e-6)
