"""Dubins paths: the shortest paths of a car that only drives forwards.

Source: Dubins 1957; the words are solved here from the centres of their first and last circles.
"""

import math
from collections.abc import Sequence

import numpy as np

from ..errors import require_positive
from .car_path import CarPath, Words, least_lengths, paths_by_length, relative_poses

# Of angles [rad], and of squares in units of the squared radius.
ROUNDING = 1e-12


def dubins_paths(start: Sequence[float], end: Sequence[float], radius: float) -> list[CarPath]:
    """All Dubins words that lead from one pose to another, shortest first; at most six.

    Args:
        start: x, y, theta [m], [m], [rad].
        end: The same.
        radius: Least turning radius [m].

    Raises:
        InvalidInput: The radius is not positive.
    """
    require_positive("radius", radius)
    poses = relative_poses(start, np.array([end], dtype=float), radius)
    return paths_by_length(_words(poses), start, radius)


def dubins_lengths(start: Sequence[float], ends: np.ndarray, radius: float) -> np.ndarray:
    """Lengths of the shortest Dubins paths from one pose to many, shape (n, 3) -> (n,) [m].

    Args:
        start: x, y, theta [m], [m], [rad].
        ends: The same, many times, shape (n, 3).
        radius: Least turning radius [m].
    """
    return least_lengths(_words(relative_poses(start, ends, radius)), radius)


def dubins_between(
    starts: np.ndarray, ends: np.ndarray, radius: float
) -> tuple[np.ndarray, np.ndarray]:
    """Shortest Dubins paths of many pairs of poses.

    Args:
        starts, ends: x, y, theta, shape (n, 3) [m], [m], [rad].
        radius: Least turning radius [m].

    Returns:
        turns: Of each piece: 1 left, 0 straight, -1 right; shape (n, 3).
        lengths: Of each piece, shape (n, 3) [m].

    Raises:
        InvalidInput: The radius is not positive.
    """
    require_positive("radius", radius)
    dx, dy = (ends[:, :2] - starts[:, :2]).T / radius
    c, s = np.cos(starts[:, 2]), np.sin(starts[:, 2])
    poses = np.stack([c * dx + s * dy, c * dy - s * dx, ends[:, 2] - starts[:, 2]], axis=1)
    turns, pieces = zip(*_words(poses), strict=True)
    lengths = radius * np.stack(pieces)
    totals = lengths.sum(axis=1)
    best = np.argmin(np.where(np.isnan(totals), np.inf, totals), axis=0)
    return np.array(turns)[best], lengths[best, :, np.arange(len(best))]


def _words(poses: np.ndarray) -> Words:
    """The six words from the origin, radius 1; those that begin with R mirror the others."""
    x, y, theta = poses.T
    for side in (1, -1):
        yield (side, 0, side), _lsl(x, side * y, side * theta)
        yield (side, 0, -side), _lsr(x, side * y, side * theta)
        yield (side, -side, side), _lrl(x, side * y, side * theta)


def _lsl(x, y, theta):
    dx, dy = x - np.sin(theta), y - 1 + np.cos(theta)
    course, straight = np.arctan2(dy, dx), np.hypot(dx, dy)
    # The shorter the straight, the less its course is known: an arc that may be none is none, and
    # the other one is all of the turn.
    unknown = ROUNDING + 1e-14 / np.maximum(straight, 1e-300)
    whole, last = _turn(theta), _turn(theta - course, unknown)
    first = np.where(last == 0, whole, _turn(course, unknown))
    last = np.where(first == 0, whole, last)
    return np.stack([first, straight, last])


def _lsr(x, y, theta):
    dx, dy = x + np.sin(theta), y - 1 - np.cos(theta)
    square = dx**2 + dy**2 - 4
    # Touching circles, of which rounding would make crossing ones, count as touching.
    straight = np.sqrt(np.where(square < -ROUNDING, np.nan, np.maximum(square, 0)))
    course = np.arctan2(dy, dx) + np.arctan2(2, straight)
    return np.stack([_turn(course), straight, _turn(course - theta)])


def _lrl(x, y, theta):
    # With an arc p in the middle, the centres are 4 sin(p / 2) apart; the longer p is the one
    # that can be a shortest path.
    dx, dy = x - np.sin(theta), y - 1 + np.cos(theta)
    distance = np.hypot(dx, dy)
    half = math.pi - np.arcsin(np.where(distance > 4, np.nan, distance) / 4)
    first = np.arctan2(dy, dx) + half
    return np.stack([_turn(first), 2 * half, _turn(theta - first + 2 * half)])


def _turn(angle, unknown=ROUNDING):
    """An angle in [0, 2 pi), where a whole turn but for rounding is none."""
    turn = np.mod(angle, math.tau)
    return np.where(turn > math.tau - unknown, 0.0, turn)
