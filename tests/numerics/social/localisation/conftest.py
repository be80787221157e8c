"""Detections as they would be of a picture taken somewhere, made without one."""

from collections.abc import Callable

import numpy as np
import pytest

from sightfield.systems.numerics.social.landmarks.forward_camera import project_forward
from sightfield.systems.numerics.social.landmarks.maze import Maze
from sightfield.systems.numerics.social.landmarks.thesis_maze import thesis_maze
from sightfield.systems.numerics.social.recognition.matching import Matches
from sightfield.systems.numerics.social.recognition.recognition import (
    LandmarkDetection,
    Recognition,
    Stance,
    stance_of,
)
from sightfield.systems.numerics.social.recognition.references import MARKER

NOTHING = Matches(np.zeros(0, int), np.zeros((0, 2)), np.zeros((0, 2)))


@pytest.fixture(scope="session")
def maze() -> Maze:
    """The thesis's."""
    return thesis_maze()


@pytest.fixture(scope="session")
def detect() -> Callable[..., LandmarkDetection]:
    """A function of a subject and corners [px], which it moves by their deviation if given dice."""

    def make(subject, corners, deviation=0.2, rng=None) -> LandmarkDetection:
        shift = rng.normal(0, deviation, (4, 2)) if rng is not None else 0.0
        corners = np.asarray(corners, dtype=float) + shift
        return LandmarkDetection(
            subject=subject,
            corners=corners,
            covariance=deviation**2 * np.eye(8),
            correlation=1.0,
            visible=1.0,
            stance=stance_of(corners, 0.5),
            places=NOTHING.place,
            pixels=NOTHING.pixel,
        )

    return make


@pytest.fixture(scope="session")
def look(maze, detect) -> Callable[..., Recognition]:
    """A function of a camera's pose, numbers of landmarks and the evader's pose or None.

    The evader shows the sides that are turned to the camera by 60 degrees at least.
    """

    def make(camera, landmarks, evader=None, **options) -> Recognition:
        camera = np.asarray(camera, dtype=float)
        squares = [(number, maze.landmark(number).corners) for number in landmarks]
        if evader is not None:
            for corners in maze.marker.corners(np.asarray(evader, dtype=float)):
                middle = corners.mean(axis=0)[:2]
                out, way = middle - np.asarray(evader)[:2], camera[:2] - middle
                if out @ way > 0.5 * np.hypot(*out) * np.hypot(*way):
                    squares.append((MARKER, corners))
        found = [
            detect(subject, project_forward(maze.camera, camera, corners), **options)
            for subject, corners in squares
        ]
        assert all(each.stance is Stance.UPRIGHT for each in found)
        return Recognition(tuple(found), NOTHING)

    return make
