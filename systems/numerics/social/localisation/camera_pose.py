"""Where a picture was taken, from the landmarks in it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from ..landmarks.forward_camera import project_forward
from ..landmarks.maze import Landmark, Maze
from ..recognition.recognition import LandmarkDetection
from .perspective import slopes
from .relative import Relative, relative_poses

# Scale of the robust weight: a landmark's weight falls as the sum of squares of its eight residuals
# passes this (Geman and McClure 1987); one with a weight below a quarter is not used.
_DOUBTFUL, _USED = 60.0, 0.25
_STEPS, _ENOUGH = 15, 1e-6
# Two estimates nearer than this are one [m or rad].
_SAME = 0.01
# Estimates whose cost exceeds the best one's by this are dropped.
_WORSE = 25.0
# Estimates of the camera may lie this far inside a wall [m].
_WALL_SLACK = 0.05


@dataclass(frozen=True, eq=False)
class CameraPose:
    """A pose and what it rests on.

    Attributes:
        pose: x, y [m], heading [rad], shape (3,).
        covariance: Shape (3, 3).
        cost: Robust sum of squared residuals, in units of their variances.
        used: Numbers of the landmarks that agree with it.
    """

    pose: np.ndarray
    covariance: np.ndarray
    cost: float
    used: tuple[int, ...]


def camera_poses(
    maze: Maze, landmarks: Sequence[LandmarkDetection], method: str
) -> list[CameraPose]:
    """Poses from which a picture may have been taken, the likeliest first.

    Method "level" fits all landmarks at once, with robust weights that reduce the influence of
    those that disagree. With the other methods each landmark gives its own poses, and around each
    of them those that agree are averaged by their covariances.

    Args:
        maze: Map of the landmarks.
        landmarks: Detections of upright landmarks of the maze.
        method: One of METHODS.

    Returns:
        Poses inside the maze only; may be empty.
    """
    single = []
    for detection in landmarks:
        landmark = maze.landmark(detection.subject)
        for each in relative_poses(
            maze.camera, detection, landmark.side, landmark.middle_height, method
        ):
            single.append(_placed(landmark, each))
    if method == "level":
        fitted = [_fit(maze, landmarks, start.pose) for start in single]
    else:
        fitted = [_average(single, around) for around in single]
    room = maze.world.polygon.buffer(_WALL_SLACK)
    found: list[CameraPose] = []
    for each in sorted((each for each in fitted if each is not None), key=lambda each: each.cost):
        known = any(np.abs(_difference(each.pose, other.pose)).max() < _SAME for other in found)
        if not known and shapely.contains_xy(room, *each.pose[:2]):
            found.append(each)
    return [each for each in found if each.cost < found[0].cost + _WORSE]


def _placed(landmark: Landmark, relative: Relative) -> CameraPose:
    """Camera pose in the world, from a landmark's pose relative to the camera."""

    def camera(pose: np.ndarray) -> np.ndarray:
        heading = landmark.facing - pose[2]
        c, s = math.cos(heading), math.sin(heading)
        x = landmark.x - (c * pose[0] - s * pose[1])
        return np.array([x, landmark.y - (s * pose[0] + c * pose[1]), heading])

    slope = slopes(camera, relative.pose)
    pose = camera(relative.pose)
    return CameraPose(
        _wrapped(pose), slope @ relative.covariance @ slope.T, relative.cost, (landmark.number,)
    )


def _fit(
    maze: Maze, landmarks: Sequence[LandmarkDetection], start: np.ndarray
) -> CameraPose | None:
    """Fit all landmarks at once (Gauss and Newton, reweighted)."""
    points = [maze.landmark(each.subject).corners for each in landmarks]
    weights = [np.linalg.inv(each.covariance) for each in landmarks]
    pose = np.asarray(start, dtype=float)

    def residuals(at: np.ndarray) -> np.ndarray:
        return np.concatenate(
            [
                (project_forward(maze.camera, at, corners) - each.corners).ravel()
                for corners, each in zip(points, landmarks, strict=True)
            ]
        )

    information, squares = np.eye(3), np.zeros(len(landmarks))
    for _ in range(_STEPS):
        error = residuals(pose).reshape(-1, 8)
        slope = slopes(residuals, pose).reshape(-1, 8, 3)
        # A landmark that would be behind the camera is ignored.
        ahead = np.array(
            [
                np.isfinite(e).all() and np.isfinite(j).all()
                for e, j in zip(error, slope, strict=True)
            ]
        )
        error[~ahead], slope[~ahead] = 0.0, 0.0
        squares = np.array([e @ w @ e for e, w in zip(error, weights, strict=True)])
        squares[~ahead] = np.inf
        share = (1 / (1 + squares / _DOUBTFUL)) ** 2
        information, pull = np.zeros((3, 3)), np.zeros(3)
        for e, j, w, k in zip(error, slope, weights, share, strict=True):
            information += k * j.T @ w @ j
            pull += k * j.T @ w @ e
        if np.linalg.cond(information) > 1e12:
            return None
        change = -np.linalg.solve(information, pull)
        change *= min(1.0, 0.3 / max(float(np.abs(change).max()), 1e-12))
        pose = pose + change
        if np.abs(change).max() < _ENOUGH:
            break
    used = squares < (1 / math.sqrt(_USED) - 1) * _DOUBTFUL
    if not used.any():
        return None
    freedom = 8 * int(used.sum()) - 3
    scale = max(1.0, float(squares[used].sum()) / freedom)
    # Each landmark costs at most as much as if it were not one.
    cost = float(np.sum(_DOUBTFUL * (1 - 1 / (1 + squares / _DOUBTFUL))))
    numbers = tuple(each.subject for each, use in zip(landmarks, used, strict=True) if use)
    return CameraPose(_wrapped(pose), scale * np.linalg.inv(information), cost, numbers)


def _average(single: Sequence[CameraPose], around: CameraPose) -> CameraPose | None:
    """Mean of the poses that agree with a given one, weighted by their information."""
    information, pull, cost = np.zeros((3, 3)), np.zeros(3), 0.0
    used = []
    for number in dict.fromkeys(each.used[0] for each in single):
        nearest, square, away = None, math.inf, np.zeros(3)
        for each in (each for each in single if each.used[0] == number):
            apart = _difference(each.pose, around.pose)
            doubt = each.covariance + around.covariance + 1e-9 * np.eye(3)
            far = each.cost + float(apart @ np.linalg.solve(doubt, apart))
            if far < square:
                nearest, square, away = each, far, apart
        # Each landmark costs at most as much as if it were not one.
        cost += _DOUBTFUL * (1 - 1 / (1 + square / _DOUBTFUL))
        if nearest is not None and square < _DOUBTFUL:
            weight = np.linalg.inv(nearest.covariance + 1e-9 * np.eye(3))
            information, pull = information + weight, pull + weight @ away
            used.append(number)
    if not used:
        return None
    pose = around.pose + np.linalg.solve(information, pull)
    return CameraPose(_wrapped(pose), np.linalg.inv(information), cost, tuple(used))


def _difference(pose: np.ndarray, other: np.ndarray) -> np.ndarray:
    return _wrapped(pose - other)


def _wrapped(pose: np.ndarray) -> np.ndarray:
    turned = math.atan2(math.sin(pose[2]), math.cos(pose[2]))
    return np.array([pose[0], pose[1], turned])
