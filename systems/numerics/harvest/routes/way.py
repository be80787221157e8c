"""Ways of a cart: states at equal distances, with the trailer behind as it will follow."""

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ...compiled import compiled
from ...planning.trailer import trailer_rates
from ..machines.cart import Cart, hitch_of

# Between two states of a way [m].
STEP = 0.5

rates = compiled(trailer_rates)


@dataclass(frozen=True, eq=False)
class Way:
    """What a cart drives.

    Attributes:
        distances: From 0 on, shape (n,) [m].
        states: x, y, theta, beta there, shape (n, 4) [m], [m], [rad], [rad].
        kind: Where it comes from: "optimal", "car", "search", "aside".
    """

    distances: np.ndarray
    states: np.ndarray
    kind: str

    @property
    def length(self) -> float:
        """Way driven [m]."""
        return float(self.distances[-1])


@compiled
def trailing(poses, beta, trailer, distances):
    """Angles of a trailer towed along poses, by the cart's equations of motion.

    Args:
        poses: x, y, theta of the tractor, theta unwrapped, shape (n, 3).
        beta: At the first [rad].
        trailer: Anything with `length` and `hitch_offset` [m].
        distances: At the poses, shape (n,) [m].

    Returns:
        beta at each, shape (n,) [rad].
    """
    betas = np.empty(len(poses))
    betas[0] = beta
    for k in range(len(poses) - 1):
        way = distances[k + 1] - distances[k]
        turn = (poses[k + 1, 2] - poses[k, 2]) / way if way > 0 else 0.0
        count = max(1, int(np.ceil(12 * way / trailer.length)))
        step = way / count
        for _ in range(count):
            first = rates(0.0, beta, 1.0, turn, trailer)[3]
            middle = rates(0.0, beta + step / 2 * first, 1.0, turn, trailer)[3]
            beta += step * middle
        betas[k + 1] = beta
    return betas


def way_of_poses(poses: np.ndarray, beta: float, cart: Cart, kind: str) -> Way:
    """The way of a tractor through poses, shape (n, 3), with its trailer at first at beta.

    Args:
        beta: Of the trailer [rad].
        kind: How it was found.
    """
    distances = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(poses[:, :2], axis=0).T))])
    poses = poses.copy()
    poses[:, 2] = np.unwrap(poses[:, 2])
    betas = trailing(poses, beta, hitch_of(cart), distances)
    return Way(distances, np.column_stack([poses, betas]), kind)


def poses_on(line: np.ndarray, step: float, ways: np.ndarray) -> np.ndarray:
    """Poses after ways along a line of points at equal steps, shape (n,) -> (n, 3).

    Args:
        step: Between the line's points [m].
    """
    at = np.clip(ways / step, 0.0, len(line) - 1.001)
    k = at.astype(int)
    return line[k] + (at - k)[:, None] * (line[k + 1] - line[k])


def along_arcs(poses: np.ndarray) -> np.ndarray:
    """Poses STEP apart or less along arcs through poses, shape (n, 3) -> (m, 3)."""
    pieces = [poses[:1]]
    for a, b in pairwise(poses):
        turn = b[2] - a[2]
        chord = math.hypot(b[0] - a[0], b[1] - a[1])
        length = chord / np.sinc(turn / math.tau)
        count = max(1, math.ceil(length / STEP))
        share = np.arange(1, count + 1) / count
        middle = a[2] + share * turn / 2
        along = share * length * np.sinc(share * turn / math.tau)
        pieces.append(
            np.stack(
                [a[0] + along * np.cos(middle), a[1] + along * np.sin(middle), a[2] + share * turn],
                axis=1,
            )
        )
    return np.concatenate(pieces)
