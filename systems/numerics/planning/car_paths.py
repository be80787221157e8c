"""The shortest paths of a car: Dubins's, which only drive forwards, and those of Reeds and Shepp.

A tractor with its trailer's angle left free is a car, which is why the lengths of such paths bound
the travel times of the cart from below.

Source: Dubins 1957; his words are solved here from the centres of their first and last circles.
Reeds and Shepp 1990, section 8: nine formulas, which with their mirror images, with time reversed
and read from the other end cover the 48 words. The paper's conditions on the signs of the pieces
are left out: a word of other signs is a path too, so that the least length is the same.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ..compiled import compiled
from ..errors import require_positive

LETTERS = {1: "L", 0: "S", -1: "R"}


@dataclass(frozen=True)
class CarPath:
    """Pieces of constant curvature, one after the other.

    Attributes:
        start: x, y, theta [m], [m], [rad].
        turns: Of each piece: 1 left, 0 straight, -1 right.
        lengths: Of each piece [m]; negative: driven backwards.
        radius: Of the arcs [m].
    """

    start: tuple[float, float, float]
    turns: tuple[int, ...]
    lengths: tuple[float, ...]
    radius: float

    @property
    def word(self) -> str:
        """Its letters, such as "LSR"; a minus behind a piece that is driven backwards."""
        return "".join(
            LETTERS[turn] + ("-" if length < 0 else "")
            for turn, length in zip(self.turns, self.lengths, strict=True)
        )

    @property
    def length(self) -> float:
        """Way driven [m]."""
        return sum(map(abs, self.lengths))

    def poses(self, distances: Sequence[float] | np.ndarray) -> np.ndarray:
        """Poses after given ways from the start.

        Args:
            distances: Clipped to [0, length], shape (n,) [m].

        Returns:
            x, y, theta, shape (n, 3); theta is not wrapped.
        """
        return _poses(
            np.array(self.start, dtype=float),
            np.array(self.turns, dtype=float) / self.radius,
            np.array(self.lengths, dtype=float),
            np.asarray(distances, dtype=float),
        )

    @property
    def end(self) -> tuple[float, float, float]:
        """Its last pose: x, y, theta [m], [m], [rad]."""
        x, y, theta = self.poses([self.length])[0]
        return float(x), float(y), float(theta)


@compiled
def _poses(start, curvatures, lengths, distances):
    poses = np.empty((len(distances), 3))
    for k in range(len(distances)):
        left = max(distances[k], 0.0)
        x, y, theta = start
        for piece in range(len(lengths)):
            way = min(left, abs(lengths[piece]))
            left -= way
            way = math.copysign(way, lengths[piece])
            half = curvatures[piece] * way / 2
            chord = way * (math.sin(half) / half if half != 0.0 else 1.0)
            x += chord * math.cos(theta + half)
            y += chord * math.sin(theta + half)
            theta += 2 * half
        poses[k] = x, y, theta
    return poses


def advance(poses: np.ndarray, curvature, ways) -> np.ndarray:
    """Poses after arcs.

    Args:
        poses: x, y, theta, shape (n, 3).
        curvature: Signed, one number or shape (n,) [1/m].
        ways: Signed, one number or shape (n,) [m].

    Returns:
        Shape (n, 3); theta is not wrapped.
    """
    bend = curvature * ways
    middle = poses[:, 2] + bend / 2
    chord = ways * np.sinc(bend / math.tau)
    steps = np.stack([chord * np.cos(middle), chord * np.sin(middle), bend + 0 * middle], axis=1)
    return poses + steps


def relative_poses(start: Sequence[float], poses: np.ndarray, radius: float) -> np.ndarray:
    """Poses as seen from a start pose, in units of the radius; shape (n, 3) -> (n, 3)."""
    poses = np.asarray(poses, dtype=float)
    dx, dy = (poses[:, 0] - start[0]) / radius, (poses[:, 1] - start[1]) / radius
    c, s = math.cos(start[2]), math.sin(start[2])
    return np.stack([c * dx + s * dy, c * dy - s * dx, poses[:, 2] - start[2]], axis=1)


# Turns of the pieces and their signed lengths in units of the radius, shape (pieces, n); NaN where
# a word does not lead to the pose.
Words = Iterable[tuple[tuple[int, ...], np.ndarray]]


def least_lengths(words: Words, radius: float) -> np.ndarray:
    """Length of the shortest word for each pose, shape (n,) [m]; `radius` of its arcs in [m]."""
    totals = np.stack([np.abs(pieces).sum(axis=0) for _, pieces in words])
    return radius * np.min(np.where(np.isnan(totals), np.inf, totals), axis=0)


def paths_by_length(words: Words, start: Sequence[float], radius: float) -> list[CarPath]:
    """The words that lead to the first of the poses, as paths, shortest first.

    Args:
        words: Of all poses.
        start: x, y, theta [m], [m], [rad].
        radius: Least turning radius [m].
    """
    x, y, theta = map(float, start)
    paths = [
        CarPath(
            (x, y, theta), turns, tuple(float(radius * piece) for piece in pieces[:, 0]), radius
        )
        for turns, pieces in words
        if not np.isnan(pieces[:, 0]).any()
    ]
    return sorted(paths, key=lambda path: path.length)


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
    return paths_by_length(_dubins_words(poses), start, radius)


def dubins_lengths(start: Sequence[float], ends: np.ndarray, radius: float) -> np.ndarray:
    """Lengths of the shortest Dubins paths from one pose to many, shape (n, 3) -> (n,) [m].

    Args:
        start: x, y, theta [m], [m], [rad].
        ends: The same, many times, shape (n, 3).
        radius: Least turning radius [m].
    """
    return least_lengths(_dubins_words(relative_poses(start, ends, radius)), radius)


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
    turns, pieces = zip(*_dubins_words(poses), strict=True)
    lengths = radius * np.stack(pieces)
    totals = lengths.sum(axis=1)
    best = np.argmin(np.where(np.isnan(totals), np.inf, totals), axis=0)
    return np.array(turns)[best], lengths[best, :, np.arange(len(best))]


def _dubins_words(poses: np.ndarray) -> Words:
    """The six words from the origin, radius 1; those that begin with R mirror the others."""
    x, y, theta = poses.T
    for side in (1, -1):
        yield (side, 0, side), _lsl(x, side * y, side * theta)
        yield (side, 0, -side), _lsr(x, side * y, side * theta)
        yield (side, -side, side), _lrl(x, side * y, side * theta)


def _lsl(x, y, theta):
    dx, dy = x - np.sin(theta), y - 1 + np.cos(theta)
    course, straight = np.arctan2(dy, dx), np.hypot(dx, dy)
    # The shorter the straight, the less exactly its course is known: an arc that may be zero is set
    # to zero, and the other one makes the whole turn.
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
    """An angle in [0, 2 pi); a whole turn, up to rounding, counts as zero."""
    turn = np.mod(angle, math.tau)
    return np.where(turn > math.tau - unknown, 0.0, turn)


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
    return paths_by_length(_reeds_shepp_words(poses), start, radius)


def reeds_shepp_lengths(start: Sequence[float], ends: np.ndarray, radius: float) -> np.ndarray:
    """Lengths of the shortest Reeds-Shepp paths from one pose to many, (n, 3) -> (n,) [m].

    Args:
        start: x, y, theta [m], [m], [rad].
        ends: The same, many times, shape (n, 3).
        radius: Least turning radius [m].
    """
    return least_lengths(_reeds_shepp_words(relative_poses(start, ends, radius)), radius)


def _reeds_shepp_words(poses: np.ndarray) -> Words:
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
