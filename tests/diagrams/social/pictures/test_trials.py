"""Trial pictures show what they say, and nearly all of it is recognised, and nothing else."""

import math

import numpy as np
import pytest

from sightfield.diagrams.social.pictures.trials import make_trials
from sightfield.systems.numerics.social.landmarks.landmark_pictures import landmark_picture
from sightfield.systems.numerics.social.landmarks.thesis_maze import hang_landmarks, thesis_maze
from sightfield.systems.numerics.social.localisation.location import locate_evader
from sightfield.systems.numerics.social.recognition.recognition import recognise
from sightfield.systems.numerics.social.recognition.references import MARKER, maze_references
from sightfield.systems.social.maze_renderer import Poster

MAZE = thesis_maze()
COUNT = 24


@pytest.fixture(scope="module")
def trials():
    # Landmarks of no number on the map hang among the others.
    places = hang_landmarks(MAZE.world, 16)[13:]
    decoys = [Poster(landmark_picture(900 + k), each.corners) for k, each in enumerate(places)]
    return list(make_trials(MAZE, COUNT, 11, decoys=decoys))


@pytest.fixture(scope="module")
def recognised(trials):
    references = maze_references(MAZE)
    return [recognise(trial.picture, references) for trial in trials]


def test_squares_face_the_camera_and_look_upright(trials):
    squares = [square for trial in trials for square in trial.squares]
    assert all(square.obliqueness < 0.5 * math.pi for square in squares)
    assert all((square.corners[[3, 2], 1] > square.corners[[0, 1], 1]).all() for square in squares)
    # A front is seen with its left edge on the left.
    assert all((square.corners[[1, 2], 0] > square.corners[[0, 3], 0]).all() for square in squares)
    assert any(square.whole for square in squares)
    assert any(trial.evader is None for trial in trials)


def test_trials_repeat_with_their_seed(trials):
    (again,) = make_trials(MAZE, 1, 11)
    assert np.array_equal(again.camera, trials[0].camera)
    assert again.squares[0].subject == trials[0].squares[0].subject


def test_nothing_is_recognised_that_is_not_there(trials, recognised):
    for trial, found in zip(trials, recognised, strict=True):
        for each in found.detections:
            misses = [
                np.abs(each.corners - square.corners).max() / square.size
                for square in trial.squares
                if square.subject == each.subject
            ]
            assert min(misses) < 0.25


def test_what_is_in_clear_view_is_recognised(trials, recognised):
    hits = []
    for trial, found in zip(trials, recognised, strict=True):
        for square in trial.squares:
            if square.whole and square.size > 32 and square.obliqueness < math.radians(60):
                hits.append(
                    any(
                        each.subject == square.subject
                        and np.abs(each.corners - square.corners).max() < 0.25 * square.size
                        for each in found.detections
                    )
                )
    assert len(hits) > 8
    assert np.mean(hits) > 0.9


def test_the_evader_is_located_to_a_few_centimetres(trials, recognised):
    off = []
    for trial, found in zip(trials, recognised, strict=True):
        location = locate_evader(found, MAZE)
        if location.outcome.has_location:
            assert trial.evader is not None
            assert any(square.subject == MARKER for square in trial.squares)
            off.append(math.dist(location.position, trial.evader[:2]))
    assert len(off) > 2
    assert np.median(off) < 0.05
    assert max(off) < 0.3
