"""The families of words among which the shortest paths of a car are found.

Each family has three lengths to choose; the other pieces are tied to them.

Source: Dubins 1957; Reeds and Shepp 1990, section 8.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class WordFamily:
    """Pieces in units of the turning radius: lengths = coefficients @ choice + fixed.

    Attributes:
        turns: Of each piece: 1 left, 0 straight, -1 right.
        coefficients: Shape (pieces, 3); in a row at most one entry, 1 or -1.
        fixed: Shape (pieces,).
        limits: The choice lies in [0, limits], shape (3,); infinite for straights.
    """

    turns: tuple[int, ...]
    coefficients: np.ndarray
    fixed: np.ndarray
    limits: np.ndarray


# Turns, and of each piece its sign and which of the choices it is; Q: a quarter turn.
Q = -1
CAR_WITH_REVERSE = (
    ((1, 0, 1), (1, 1, 1), (0, 1, 2)),
    ((1, 0, -1), (1, 1, 1), (0, 1, 2)),
    ((1, -1, 1), (1, -1, 1), (0, 1, 2)),
    ((1, -1, 1), (1, -1, -1), (0, 1, 2)),
    ((1, -1, 1), (1, 1, -1), (0, 1, 2)),
    ((1, -1, 1, -1), (1, 1, -1, -1), (0, 1, 1, 2)),
    ((1, -1, 1, -1), (1, -1, -1, 1), (0, 1, 1, 2)),
    ((1, -1, 0, 1), (1, -1, -1, -1), (0, Q, 1, 2)),
    ((1, -1, 0, -1), (1, -1, -1, -1), (0, Q, 1, 2)),
    ((1, 0, -1, 1), (1, 1, 1, -1), (0, 1, Q, 2)),
    ((1, 0, 1, -1), (1, 1, 1, -1), (0, 1, Q, 2)),
    ((1, -1, 0, 1, -1), (1, -1, -1, -1, 1), (0, Q, 1, Q, 2)),
)
CAR_WITHOUT_REVERSE = (
    ((1, 0, 1), (1, 1, 1), (0, 1, 2)),
    ((1, 0, -1), (1, 1, 1), (0, 1, 2)),
    ((1, -1, 1), (1, 1, 1), (0, 1, 2)),
)


def word_families(reverse: bool) -> Iterator[WordFamily]:
    """The six Dubins families, or the 48 of Reeds and Shepp.

    Args:
        reverse: Whether the car may drive backwards: Reeds and Shepp.
    """
    # Backwards round the rest of the circle is shorter than an arc beyond half a turn.
    longest = math.pi if reverse else math.tau
    for turns, signs, choices in CAR_WITH_REVERSE if reverse else CAR_WITHOUT_REVERSE:
        coefficients = np.zeros((len(turns), 3))
        fixed = np.zeros(len(turns))
        limits = np.full(3, longest)
        for piece, (turn, sign, choice) in enumerate(zip(turns, signs, choices, strict=True)):
            if choice == Q:
                fixed[piece] = sign * math.pi / 2
            else:
                coefficients[piece, choice] = sign
            if turn == 0:
                limits[choice] = math.inf
        for side in (1, -1):
            for time in (1, -1) if reverse else (1,):
                sided = tuple(side * turn for turn in turns)
                yield WordFamily(sided, time * coefficients, time * fixed, limits)
