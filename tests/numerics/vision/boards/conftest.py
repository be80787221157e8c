"""Boards before cameras that are known, as a picture would show them."""

from dataclasses import dataclass

import cv2
import numpy as np
import pytest

from sightfield.systems.numerics.vision.boards.board import Checkerboard, Pose
from sightfield.systems.numerics.vision.camera_models.camera_model import CameraModel, in_picture
from sightfield.systems.numerics.vision.camera_models.central_cameras import MeiCamera


@dataclass(frozen=True)
class Scene:
    """A camera, a board, and where the board's corners are in its pictures.

    Attributes:
        poses: How the board lay.
        pictures: Exact pixels of the corners, shapes (n, 2).
    """

    camera: CameraModel
    board: Checkerboard
    poses: list[Pose]
    pictures: list[np.ndarray]

    def noisy(self, noise: float, seed: int) -> list[np.ndarray]:
        """The pixels with errors of this standard deviation [px]."""
        rng = np.random.default_rng(seed)
        return [each + noise * rng.standard_normal(each.shape) for each in self.pictures]


def make_scene(camera: CameraModel, count: int, seed: int) -> Scene:
    """Boards all round the axis of a camera, wholly in its picture, with their faces to it."""
    board = Checkerboard(columns=7, rows=5, square_width=0.04, square_height=0.03)
    rng = np.random.default_rng(seed)
    poses: list[Pose] = []
    pictures: list[np.ndarray] = []
    while len(poses) < count:
        angle, azimuth = rng.uniform(0.5, 1.7), 2.4 * len(poses) + rng.uniform(-0.3, 0.3)
        across = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
        place = np.sin(angle) * across + [0, 0, np.cos(angle)]
        # Axes of a board that faces the camera, then tilted.
        right = np.cross([0, 0, 1], place) / np.linalg.norm(np.cross([0, 0, 1], place))
        facing = np.column_stack([right, np.cross(place, right), place])
        rotation = cv2.Rodrigues(rng.uniform(-0.5, 0.5, 3))[0] @ facing
        middle = rng.uniform(0.15, 0.35) * place
        pose = Pose(rotation, middle - rotation[:, :2] @ board.points.mean(axis=0))
        pixels = camera.project(pose.place(board.points))
        if in_picture(camera, pixels).all():
            poses.append(pose)
            pictures.append(pixels)
    return Scene(camera, board, poses, pictures)


@pytest.fixture(scope="session")
def mirror() -> Scene:
    """Pictures of a camera near a parabolic mirror, whose axis is not in the picture's middle."""
    camera = MeiCamera(
        xi=0.95,
        focal_x=170.0,
        focal_y=171.0,
        centre_x=331.0,
        centre_y=229.0,
        k1=-0.04,
        k2=0.006,
        width=640,
        height=480,
    )
    return make_scene(camera, 10, seed=3)
