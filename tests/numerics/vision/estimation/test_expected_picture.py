"""What a picture of a shell should show."""

import math

import cv2
import numpy as np
import pytest

from sightfield.systems.numerics.vision.estimation.expected_picture import SPREAD, smooth


@pytest.mark.parametrize("length", [0.0, 3.0, 9.0, 12.0])
@pytest.mark.parametrize("heading", [0.0, 0.4, 2.0])
def test_smoothing_along_one_direction_is_that_of_a_camera_that_moved_while_it_looked(
    scene, length, heading
):
    rng = np.random.default_rng(2)
    image = cv2.GaussianBlur(rng.standard_normal(scene.shape), (0, 0), 1.5).astype(np.float32)
    sharp = 0.8
    way = np.array([math.cos(heading), math.sin(heading)])
    spread = sharp**2 * np.eye(2) + length**2 / 12 * np.outer(way, way)
    values = np.zeros(20)
    values[SPREAD] = spread[0, 0], spread[0, 1], spread[1, 1]
    smoothed = smooth(scene, image.reshape(-1, 1), values).reshape(scene.shape)
    # The mean of many sharp pictures, each taken a little farther along the way.
    moved = [
        cv2.warpAffine(
            cv2.GaussianBlur(image, (0, 0), sharp, borderType=cv2.BORDER_REPLICATE),
            np.array([[1.0, 0.0, share * length * way[0]], [0.0, 1.0, share * length * way[1]]]),
            scene.shape[::-1],
            flags=cv2.INTER_CUBIC,
            borderMode=cv2.BORDER_REPLICATE,
        )
        for share in np.linspace(-0.5, 0.5, 241)
    ]
    middle = slice(9, -9)
    expected = np.mean(moved, axis=0)[middle, middle]
    assert smoothed[middle, middle] == pytest.approx(expected, abs=float(0.03 * expected.std()))
