"""Where cameras and evaders are said to be, with which covariances, is as recorded."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.social.landmarks.forward_camera import (
    ForwardCamera,
    project_forward,
)
from sightfield.systems.numerics.social.landmarks.maze import MarkerBlock, upright_square
from sightfield.systems.numerics.social.localisation.location import camera_poses, locate_evader
from sightfield.systems.numerics.social.localisation.perspective import (
    fit_square,
    middle_by_size,
    slopes,
    square_by_edges,
    square_by_pnp,
    starting_poses,
)
from sightfield.systems.numerics.social.localisation.relative import (
    METHODS,
    evader_place,
    relative_poses,
)
from sightfield.systems.numerics.social.recognition.recognition import Recognition
from sightfield.systems.numerics.social.recognition.references import MARKER

LENS = ForwardCamera(width=600, height=440, field_of_view=math.radians(70), lens_height=0.2)
BLOCK = MarkerBlock(copies=5, side=0.11, middle_height=0.17)
# What iterates is as sure as its last step.
SURE = {"relative": 1e-3, "absolute": 1e-7}


def square_seen(ahead, left, turn, side, height, seed):
    facing = math.atan2(-left, -ahead) + turn
    corners = upright_square(np.array([ahead, left, height]), side, facing)
    pixels = project_forward(LENS, np.zeros(3), corners)
    return pixels + np.random.default_rng(seed).normal(0, 0.4, (4, 2))


SQUARES = [
    square_seen(0.9, 0.2, 0.5, 0.26, 0.18, 0),
    square_seen(1.7, -0.6, -0.8, 0.26, 0.18, 1),
    square_seen(0.5, 0.05, 0.1, 0.26, 0.18, 2),
]


def correlated(seed):
    root = np.random.default_rng(seed).normal(0, 0.2, (8, 8))
    return 0.09 * np.eye(8) + root @ root.T


@pytest.mark.parametrize("number", range(len(SQUARES)))
def test_poses_of_a_square_are_as_recorded(number, as_recorded):
    corners = SQUARES[number]
    starts = starting_poses(LENS, corners, 0.26)
    as_recorded(starts, "starts")
    fits = [fit_square(LENS, corners, correlated(3), 0.26, 0.18, start) for start in starts]
    as_recorded(fits, "fitted", **SURE)
    as_recorded([square_by_pnp(LENS, corners, 0.26, start) for start in starts], "pnp", **SURE)
    for printed in (False, True):
        about = "as printed" if printed else ""
        as_recorded(square_by_edges(LENS, corners, 0.26, printed=printed), f"edges {about}")
        as_recorded(middle_by_size(LENS, corners, 0.26, printed=printed), f"size {about}")


@pytest.mark.parametrize("method", METHODS)
def test_relative_poses_and_the_evaders_place_are_as_recorded(method, detect, as_recorded):
    seen = [detect(4, corners, 0.5) for corners in SQUARES]
    as_recorded([relative_poses(LENS, each, 0.26, 0.18, method) for each in seen], "poses", **SURE)
    block = BLOCK.corners(np.array([0.8, 0.15, 0.7]))
    middles = np.hypot(*block.mean(axis=1)[:, :2].T)
    copies = [
        detect(MARKER, project_forward(LENS, np.zeros(3), block[k]), 0.3 + 0.2 * k)
        for k in np.argsort(middles)[:2]
    ]
    stray = detect(MARKER, copies[0].corners * [0.8, 1.0] + [30.0, 0.0], 0.6)
    for found, name in (
        (copies[:1], "one side"),
        (copies, "two sides"),
        ([stray, *copies], "with a stray one"),
        ([], "none"),
    ):
        as_recorded(evader_place(LENS, BLOCK, found, method), name, **SURE)


# Camera, landmarks in the picture, evader, and the pixels' deviation.
VIEWS = {
    "near": ([1.25, 1.0, 0.9], [1], [1.55, 1.5, 0.4], 0.3),
    "two": ([1.25, 1.0, 0.9], [1, 0], [1.55, 1.5, 2.0], 0.9),
    "far": ([0.25, 1.25, -0.1], [9], [1.1, 1.2, 1.0], 0.6),
    "noisy": ([1.25, 1.0, 1.0], [0], [1.5, 1.45, -2.0], 2.0),
    "at a wall": ([1.25, 1.0, 0.9], [1], [1.745, 1.5, 0.4], 0.3),
    "behind": ([1.25, 1.0, 0.9], [1], [2.3, 1.6, 0.3], 0.3),
    "outside": ([1.7, 1.9, 1.57], [0], [1.7, 3.2, 0.0], 0.3),
    "from outside": ([1.9, -0.5, 1.57], [0], [1.55, 1.5, 0.4], 0.3),
}


@pytest.mark.parametrize("name", VIEWS)
def test_an_evader_is_located_as_recorded(name, look, maze, detect, as_recorded):
    camera, landmarks, evader, deviation = VIEWS[name]
    true = look(camera, landmarks, evader, deviation=deviation, rng=np.random.default_rng(4))
    corners = true.landmarks[0].corners
    false = detect(7, 0.7 * (corners - corners.mean(axis=0)) + [150.0, 240.0], 0.5)
    for method in METHODS:
        as_recorded(locate_evader(true, maze, method), method, **SURE)
        misled = Recognition((false, *true.detections), true.matches)
        as_recorded(locate_evader(misled, maze, method), f"{method} misled", **SURE)
        as_recorded(camera_poses(maze, misled.landmarks, method), f"{method} poses", **SURE)


def test_slopes_are_those_of_a_curve():
    at = np.array([0.3, -0.8])
    found = slopes(lambda x: np.array([x[0] ** 2 * x[1], math.sin(x[0] - x[1])]), at)
    x, y = at
    expected = [[2 * x * y, x * x], [math.cos(x - y), -math.cos(x - y)]]
    np.testing.assert_allclose(found, expected, atol=1e-8)
    # Of a cubic the central difference is off by the square of the step.
    off = slopes(lambda x: x**3, np.array([2.0]), 0.1)[0, 0] - 12.0
    assert abs(off - 0.01) < 1e-9
