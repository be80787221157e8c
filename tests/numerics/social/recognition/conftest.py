"""References of the thesis's maze, and pictures with squares pasted in at known corners."""

from collections.abc import Callable

import cv2
import numpy as np
import pytest

from sightfield.systems.numerics.social.landmarks.landmark_pictures import (
    landmark_picture,
    marker_picture,
)
from sightfield.systems.numerics.social.landmarks.thesis_maze import thesis_maze
from sightfield.systems.numerics.social.recognition.matching import homography_of
from sightfield.systems.numerics.social.recognition.references import (
    MARKER,
    References,
    maze_references,
)


@pytest.fixture(scope="session")
def references() -> References:
    """Of the thesis's maze, by SIFT."""
    return maze_references(thesis_maze())


@pytest.fixture(scope="session")
def paste() -> Callable[..., np.ndarray]:
    """A function of pairs of subject and corners: a noisy wall with them on it."""

    def make(*squares, width=640, height=480, fine=3, seed=0) -> np.ndarray:
        canvas = np.full((height * fine, width * fine, 3), 170, np.uint8)
        for subject, corners in squares:
            picture = marker_picture() if subject == MARKER else landmark_picture(subject)
            # From the picture's texels to the fine canvas's pixels, whose centres count from 0.
            texels = np.array([[1 / 256, 0, 0.5 / 256], [0, 1 / 256, 0.5 / 256], [0, 0, 1]])
            raster = np.array([[fine, 0, (fine - 1) / 2], [0, fine, (fine - 1) / 2], [0, 0, 1]])
            warp = raster @ homography_of(np.asarray(corners, float)) @ texels
            size = (width * fine, height * fine)
            cv2.warpPerspective(picture, warp, size, dst=canvas, borderMode=cv2.BORDER_TRANSPARENT)
        small = cv2.resize(canvas, (width, height), interpolation=cv2.INTER_AREA)
        noise = np.random.default_rng(seed).normal(0, 3, small.shape)
        return np.clip(small + noise, 0, 255).astype(np.uint8)

    return make
