"""What is seen in a picture, and what is not."""

import cv2
import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.social.landmarks.thesis_maze import thesis_maze
from sightfield.systems.numerics.social.recognition.recognition import Stance, recognise, stance_of
from sightfield.systems.numerics.social.recognition.references import (
    MARKER,
    FeatureFinder,
    maze_references,
)

SQUARE = np.array([[200.0, 150.0], [320.3, 170.2], [320.1, 280.4], [199.8, 300.6]])
RIGHT = np.array([[420.5, 190.0], [500.2, 175.0], [500.0, 275.0], [420.6, 260.0]])


def subjects(found):
    return sorted(each.subject for each in found.detections)


def test_corners_are_found_to_a_fraction_of_a_pixel(paste, references):
    (seen,) = recognise(paste((5, SQUARE)), references).detections
    assert (seen.subject, seen.stance) == (5, Stance.UPRIGHT)
    assert seen.corners == pytest.approx(SQUARE, abs=0.3)
    assert seen.visible > 0.8


@pytest.mark.parametrize("number", range(13))
def test_every_landmark_is_told_from_the_others_when_it_is_small(number, paste, references):
    small = np.array([[300.0, 200], [345, 204], [345, 246], [300, 250]])
    assert subjects(recognise(paste((number, small)), references)) == [number]


def test_what_covariances_promise_corners_keep(paste, references):
    rng = np.random.default_rng(3)
    squares = []
    for k in range(12):
        corners = SQUARE + rng.uniform(-9, 9, 2)
        corners[1:3, 1] += [2 * k, -2 * k]
        (seen,) = recognise(paste((k, corners), seed=k), references).detections
        error = (seen.corners - corners).ravel()
        squares.append(error @ np.linalg.solve(seen.covariance, error) / 8)
    assert 0.05 < np.mean(squares) < 3


def test_several_landmarks_and_copies_of_the_marker_are_found_in_one_picture(paste, references):
    block = np.array([[340.0, 200], [400, 200], [400, 260], [340, 260]])
    far = np.array([[560.0, 200], [610, 200], [610, 250], [560, 250]])
    picture = paste((3, SQUARE), (MARKER, block), (7, RIGHT), (MARKER, far))
    found = recognise(picture, references)
    assert subjects(found) == [MARKER, MARKER, 3, 7]
    assert len(found.markers) == 2
    assert {each.subject for each in found.landmarks} == {3, 7}


def test_a_landmark_upside_down_is_said_to_be(paste, references):
    (seen,) = recognise(paste((4, SQUARE[[2, 3, 0, 1]])), references).detections
    assert seen.stance is Stance.UPSIDE_DOWN


def test_a_landmark_cut_by_the_frame_is_completed(paste, references):
    cut = SQUARE - [255.0, 0.0]
    (seen,) = recognise(paste((9, cut)), references).detections
    assert seen.corners == pytest.approx(cut, abs=3.0)
    assert seen.visible < 0.7
    # What is outside the frame is less sure.
    deviation = np.sqrt(np.diag(seen.covariance)).reshape(4, 2)
    assert deviation[0, 0] > 2 * deviation[1, 0]


def test_a_landmark_half_hidden_is_not_pulled_towards_what_hides_it(paste, references):
    picture = paste((9, SQUARE))
    picture[140:320, 262:330] = [90, 130, 60]
    (seen,) = recognise(picture, references).detections
    assert seen.corners == pytest.approx(SQUARE, abs=3.0)
    assert seen.visible < 0.7


def test_a_landmark_in_a_mirror_is_none(paste, references):
    assert subjects(recognise(paste((5, SQUARE))[:, ::-1], references)) == []


def test_a_landmark_lying_on_its_side_is_none(paste, references):
    assert subjects(recognise(paste((5, SQUARE[[1, 2, 3, 0]])), references)) == []


@pytest.mark.parametrize("number", [100, 101, 102])
def test_a_picture_of_the_same_kind_that_is_not_on_the_map_is_none(number, paste, references):
    assert subjects(recognise(paste((number, SQUARE)), references)) == []


def test_nothing_is_found_where_there_is_nothing(references):
    rng = np.random.default_rng(0)
    noise = rng.integers(0, 256, (480, 640, 3), dtype=np.uint8)
    clouds = cv2.GaussianBlur(noise, (0, 0), 6)
    clouds = cv2.normalize(clouds, None, 0, 255, cv2.NORM_MINMAX)
    for picture in (np.zeros_like(noise), np.full_like(noise, 255), noise, clouds, noise[:16, :16]):
        assert recognise(picture, references).detections == ()


def test_orb_finds_what_is_near(paste):
    references = maze_references(thesis_maze(), "orb")
    found = recognise(paste((3, SQUARE), (8, RIGHT)), references)
    assert subjects(found) == [3, 8]


def test_an_unknown_method_is_refused():
    with pytest.raises(InvalidInput, match="`method` must be one of sift, orb, surf; got brisk"):
        FeatureFinder("brisk")


def test_surf_works_or_says_why_not(paste):
    if hasattr(cv2, "xfeatures2d"):
        references = maze_references(thesis_maze(), "surf")
        assert subjects(recognise(paste((3, SQUARE)), references)) == [3]
    else:
        with pytest.raises(InvalidInput, match=r"sift or orb; got surf, and OpenCV .* is built"):
            maze_references(thesis_maze(), "surf")


@pytest.mark.parametrize(
    ("order", "stance"),
    [
        ([0, 1, 2, 3], Stance.UPRIGHT),
        ([2, 3, 0, 1], Stance.UPSIDE_DOWN),
        ([1, 2, 3, 0], Stance.TILTED),
    ],
)
def test_which_way_up_a_square_hangs(order, stance):
    assert stance_of(SQUARE[order], 0.12) is stance


def test_a_square_with_an_edge_of_no_height_hangs_no_way_up():
    corners = SQUARE[[0, 1, 2, 0]]
    assert stance_of(corners, 0.12) is Stance.TILTED
