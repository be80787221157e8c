"""Reeds-Shepp paths: the shortest paths of a car that drives forwards and backwards.

Source: Reeds and Shepp 1990, section 8: nine formulas, which with their mirror images, with time
reversed and read from the other end cover the 48 words. The paper's conditions on the signs of the
pieces are left out: a word of other signs is a path too, so that the least length is the same.
"""

import math
from collections.abc import Sequence

import numpy as np

from ..errors import require_positive
from .car_path import CarPath, Words, least_lengths, paths_by_length, relative_poses


def reeds_shepp_paths(start: Sequence[float], end: Sequence[float], radius: float) -> list[CarPath]:
    """Reeds-Shepp words that lead from one pose to another, shortest first.

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


def reeds_shepp_lengths(start: Sequence[float], ends: np.ndarray, radius: float) -> np.ndarray:
    """Lengths of the shortest Reeds-Shepp paths from one pose to many, (n, 3) -> (n,) [m].

    Args:
        start: x, y, theta [m], [m], [rad].
        ends: The same, many times, shape (n, 3).
        radius: Least turning radius [m].
    """
    return least_lengths(reeds_shepp_words(start, ends, radius), radius)


def reeds_shepp_words(start: Sequence[float], ends: np.ndarray, radius: float) -> Words:
    """The words that lead from one pose to many, for `least_lengths` and `paths_by_length`.

    Args:
        start: x, y, theta [m], [m], [rad].
        ends: The same, many times, shape (n, 3).
        radius: Least turning radius [m].
    """
    return list(_words(relative_poses(start, ends, radius)))


def _words(poses: np.ndarray) -> Words:
    x, y, theta = poses.T
    # The same path read from its end.
    c, s = np.cos(theta), np.sin(theta)
    back_x, back_y = x * c + y * s, x * s - y * c
    for time in (1, -1):
        for side in (1, -1):
            angle = time * side * theta
            for formula, turns, palindrome in FORMULAS:
                sided = tuple(side * turn for turn in turns)
                yield sided, time * formula(time * x, side * y, angle)
                if not palindrome:
                    pieces = formula(time * back_x, side * back_y, angle)
                    yield sided[::-1], time * pieces[::-1]


def _left_straight_left(x, y, theta):
    """(8.1)."""
    u, t = _polar(x - np.sin(theta), y - 1 + np.cos(theta))
    return np.stack([t, u, _wrap(theta - t)])


def _left_straight_right(x, y, theta):
    """(8.2)."""
    distance, course = _polar(x + np.sin(theta), y - 1 - np.cos(theta))
    u = _root(distance**2 - 4)
    t = _wrap(course + np.arctan2(2, u))
    return np.stack([t, u, _wrap(t - theta)])


def _left_back_left(x, y, theta):
    """(8.3) and (8.4)."""
    distance, course = _polar(x - np.sin(theta), y - 1 + np.cos(theta))
    u = -2 * np.arcsin(_within(distance / 4, -1, 1))
    t = _wrap(course + u / 2 + math.pi)
    return np.stack([t, u, _wrap(theta - t + u)])


def _four_arcs_one_cusp(x, y, theta):
    """(8.7)."""
    xi, eta = x + np.sin(theta), y - 1 - np.cos(theta)
    u = np.arccos(_within((2 + np.hypot(xi, eta)) / 4, -1, 1))
    t, v = _outer_arcs(u, -u, xi, eta, theta)
    return np.stack([t, u, -u, v])


def _four_arcs_two_cusps(x, y, theta):
    """(8.8)."""
    xi, eta = x + np.sin(theta), y - 1 - np.cos(theta)
    u = -np.arccos(_within((20 - xi**2 - eta**2) / 16, 0, 1))
    t, v = _outer_arcs(u, u, xi, eta, theta)
    return np.stack([t, u, u, v])


def _outer_arcs(u, v, xi, eta, theta):
    """(8.5) and (8.6): the first and the last of four arcs."""
    delta = u - v
    a, b = np.sin(u) - np.sin(delta), np.cos(u) - np.cos(delta) - 1
    first = np.arctan2(eta * a - xi * b, xi * a + eta * b)
    flip = 2 * (np.cos(delta) - np.cos(v) - np.cos(u)) + 3 < 0
    first = _wrap(first + np.where(flip, math.pi, 0.0))
    return first, _wrap(first - u + v - theta)


def _quarter_straight_left(x, y, theta):
    """(8.9)."""
    distance, course = _polar(x - np.sin(theta), y - 1 + np.cos(theta))
    straight = _root(distance**2 - 4)
    t = _wrap(course + np.arctan2(straight, -2))
    v = _wrap(theta - math.pi / 2 - t)
    return np.stack([t, _quarter(t), 2 - straight, v])


def _quarter_straight_right(x, y, theta):
    """(8.10)."""
    xi, eta = x + np.sin(theta), y - 1 - np.cos(theta)
    distance, t = _polar(-eta, xi)
    return np.stack([t, _quarter(t), 2 - distance, _wrap(t + math.pi / 2 - theta)])


def _two_quarters(x, y, theta):
    """(8.11)."""
    xi, eta = x + np.sin(theta), y - 1 - np.cos(theta)
    u = 4 - _root(xi**2 + eta**2 - 4)
    t = _wrap(np.arctan2((4 - u) * xi - 2 * eta, -2 * xi + (u - 4) * eta))
    return np.stack([t, _quarter(t), u, _quarter(t), _wrap(t - theta)])


# Formula, turns of its pieces, and whether it gives the same words read from the other end.
FORMULAS = (
    (_left_straight_left, (1, 0, 1), True),
    (_left_straight_right, (1, 0, -1), True),
    (_left_back_left, (1, -1, 1), False),
    (_four_arcs_one_cusp, (1, -1, 1, -1), True),
    (_four_arcs_two_cusps, (1, -1, 1, -1), True),
    (_quarter_straight_left, (1, -1, 0, 1), False),
    (_quarter_straight_right, (1, -1, 0, -1), False),
    (_two_quarters, (1, -1, 0, 1, -1), True),
)


def _polar(x, y):
    return np.hypot(x, y), np.arctan2(y, x)


def _quarter(like):
    return np.full_like(like, -math.pi / 2)


def _root(square):
    # Touching circles, of which rounding would make crossing ones, count as touching.
    return np.sqrt(np.where(square < -1e-12, np.nan, np.maximum(square, 0)))


def _within(value, low, high):
    return np.where((value < low) | (value > high), np.nan, value)


def _wrap(angle):
    return np.remainder(angle + math.pi, math.tau) - math.pi
