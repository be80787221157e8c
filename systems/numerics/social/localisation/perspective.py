"""Poses of an upright square before a level camera, by solvePnP and by weighted least squares.

A relative pose is: ahead of the camera and to its left [m], and the direction of the square's front
from the camera's heading [rad]. A square seen small or from far has two that fit almost alike, its
left side nearer or its right.
"""

import math

import cv2
import numpy as np

from ..landmarks.forward_camera import ForwardCamera, project
from ..landmarks.maze import upright_square

_STEPS, _ENOUGH = 12, 1e-6


def squares_by_pnp(camera: ForwardCamera, corners: np.ndarray, side: float) -> list[np.ndarray]:
    """What OpenCV's solvePnP makes of four corners (Collins and Bartoli 2014), the best first.

    Args:
        camera: Its optics.
        corners: Shape (4, 2) [px].
        side: Of the square [m].

    Returns:
        At most two relative poses, shape (3,), laid on the floor.
    """
    h = 0.5 * side
    square = np.array([[-h, h, 0], [h, h, 0], [h, -h, 0], [-h, -h, 0]])
    try:
        _, turns, moves, *_ = cv2.solvePnPGeneric(
            square, corners.reshape(-1, 1, 2), camera.matrix, None, flags=cv2.SOLVEPNP_IPPE_SQUARE
        )
    except cv2.error:
        return []
    poses = []
    for turn, move in zip(turns, moves, strict=True):
        right, _, ahead = np.ravel(move)
        # The square's own third axis is its front's normal.
        normal = cv2.Rodrigues(turn)[0][:, 2]
        if ahead > 0 and np.isfinite(normal).all():
            poses.append(np.array([ahead, -right, math.atan2(-normal[0], normal[2])]))
    return poses


def fit_square(
    camera: ForwardCamera,
    corners: np.ndarray,
    covariance: np.ndarray,
    side: float,
    middle_height: float,
    start: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, float] | None:
    """Relative pose that explains the corners best, the camera being level (Gauss and Newton).

    Args:
        camera: Its optics.
        corners: Shape (4, 2) [px].
        covariance: Of the corners, shape (8, 8) [px^2].
        side, middle_height: Of the square [m].
        start: A relative pose, shape (3,).

    Returns:
        Relative pose, shape (3,); its covariance, shape (3, 3); and the sum of squares that is
        left, of 5 degrees of freedom. None if the square passes behind the camera.
    """
    weight = np.linalg.inv(covariance)

    def residual(pose: np.ndarray) -> np.ndarray:
        middle = np.array([pose[0], pose[1], middle_height])
        return (
            project(camera, np.zeros(3), upright_square(middle, side, pose[2])) - corners
        ).ravel()

    pose = np.asarray(start, dtype=float).copy()
    error = residual(pose)
    for _ in range(_STEPS):
        if not np.isfinite(error).all():
            return None
        slope = slopes(residual, pose)
        if not np.isfinite(slope).all():
            return None
        information = slope.T @ weight @ slope + 1e-9 * np.eye(3)
        change = -np.linalg.solve(information, slope.T @ weight @ error)
        shrink = 1.0
        cost = error @ weight @ error
        while shrink > 1e-3:
            trial = residual(pose + shrink * change)
            if np.isfinite(trial).all() and trial @ weight @ trial <= cost:
                break
            shrink *= 0.5
        else:
            break
        pose, error = pose + shrink * change, trial
        if np.abs(change).max() < _ENOUGH:
            break
    slope = slopes(residual, pose)
    if not np.isfinite(slope).all():
        return None
    pose[2] = math.atan2(math.sin(pose[2]), math.cos(pose[2]))
    return pose, np.linalg.inv(slope.T @ weight @ slope), float(error @ weight @ error)


def slopes(function, at: np.ndarray, step: float = 1e-5) -> np.ndarray:
    """Derivatives of a vector function by central differences, shape (values, arguments)."""
    columns = []
    for k in range(len(at)):
        moved = np.zeros(len(at))
        moved[k] = step
        columns.append((function(at + moved) - function(at - moved)) / (2 * step))
    return np.column_stack(columns)
