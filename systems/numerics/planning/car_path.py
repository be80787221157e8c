"""Paths of a car: arcs of one radius and straights, forwards or backwards.

A tractor with its trailer's angle left free is a car, which is why the lengths of such paths bound
the travel times of the cart from below.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ..compiled import compiled

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
    """Length of the shortest word for each pose, shape (n,) [m]."""
    totals = np.stack([np.abs(pieces).sum(axis=0) for _, pieces in words])
    return radius * np.min(np.where(np.isnan(totals), np.inf, totals), axis=0)


def paths_by_length(
    words: Words, start: Sequence[float], radius: float, pose: int = 0
) -> list[CarPath]:
    """The words that lead to one of the poses, as paths, shortest first.

    Args:
        words: Of all poses.
        start: x, y, theta [m], [m], [rad].
        radius: Least turning radius [m].
        pose: Number of the one.
    """
    x, y, theta = map(float, start)
    paths = [
        CarPath(
            (x, y, theta), turns, tuple(float(radius * piece) for piece in pieces[:, pose]), radius
        )
        for turns, pieces in words
        if not np.isnan(pieces[:, pose]).any()
    ]
    return sorted(paths, key=lambda path: path.length)
