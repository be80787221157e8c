"""Poses of an upright square before a level camera, by solvePnP and by weighted least squares.

A relative pose consists of the distances ahead of the camera and to its left [m], and the direction
of the square's front from the camera's heading [rad]. For a small or far square two poses fit
almost equally well, with its left or its right side nearer.
"""

import math

import cv2
import numpy as np

from ..landmarks.forward_camera import ForwardCamera, project_forward
from ..landmarks.maze import upright_square
from .edges import middle_by_size

_STEPS, _ENOUGH = 12, 1e-6
# How far the front is turned from the camera at first [rad].
_TURN = 0.7


def starting_poses(camera: ForwardCamera, corners: np.ndarray, side: float) -> list[np.ndarray]:
    """Rough relative poses, shape (3,): by apparent size, the front turned either way.

    Args:
        camera: Its optics.
        corners: Of the square in the picture, shape (4, 2) [px].
        side: Of the square [m].
    """
    middle = middle_by_size(camera, corners, side)
    if middle is None:
        return []
    back = math.atan2(-middle[1], -middle[0])
    return [np.array([*middle, back + turn]) for turn in (_TURN, -_TURN)]


def square_by_pnp(
    camera: ForwardCamera, corners: np.ndarray, side: float, start: np.ndarray
) -> tuple[np.ndarray, float] | None:
    """Pose from four corners by OpenCV's solvePnP: all six degrees of freedom, unweighted.

    It iterates from a given pose: in OpenCV 5.0 the closed form for squares (SOLVEPNP_IPPE_SQUARE)
    divides by nearly zero if edges are upright in the picture, as all are here.

    Args:
        camera: Its optics.
        corners: Shape (4, 2) [px].
        side: Of the square [m].
        start: A relative pose, shape (3,).

    Returns:
        The relative pose, projected onto the floor, shape (3,), and the remaining sum of squares
        [px^2]; None if there is no pose before the camera.
    """
    h = 0.5 * side
    square = np.array([[-h, h, 0], [h, h, 0], [h, -h, 0], [-h, -h, 0]])
    ahead, left, facing = start
    # The square's axes in the camera's: to the right of its picture, up, and out of its front.
    out = np.array([-math.sin(facing), 0.0, math.cos(facing)])
    up = np.array([0.0, -1.0, 0.0])
    turn, _ = cv2.Rodrigues(np.column_stack([np.cross(up, out), up, out]))
    move = np.array([[-left], [0.0], [ahead]])
    pixels = corners.reshape(-1, 1, 2)
    try:
        done, turn, move = cv2.solvePnP(
            square, pixels, camera.matrix, None, turn, move, True, cv2.SOLVEPNP_ITERATIVE
        )
    except cv2.error:
        return None
    if not done or not (np.isfinite(turn).all() and np.isfinite(move).all()) or move[2, 0] <= 0:
        return None
    seen, _ = cv2.projectPoints(square, turn, move, camera.matrix, None)
    normal = cv2.Rodrigues(turn)[0][:, 2]
    pose = np.array([move[2, 0], -move[0, 0], math.atan2(-normal[0], normal[2])])
    return pose, float(np.sum((seen - pixels) ** 2))


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
        Relative pose, shape (3,); its covariance, shape (3, 3); and the remaining sum of squares,
        with 5 degrees of freedom. None if the square passes behind the camera.
    """
    weight = np.linalg.inv(covariance)

    def residual(pose: np.ndarray) -> np.ndarray:
        middle = np.array([pose[0], pose[1], middle_height])
        return (
            project_forward(camera, np.zeros(3), upright_square(middle, side, pose[2])) - corners
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
    """Derivatives of a vector function by central differences, shape (values, arguments).

    Args:
        function: From a vector to a vector.
        at: Where, shape (arguments,).
        step: Half of each difference, in the arguments' units [-].
    """
    columns = []
    for k in range(len(at)):
        moved = np.zeros(len(at))
        moved[k] = step
        columns.append((function(at + moved) - function(at - moved)) / (2 * step))
    return np.column_stack(columns)
