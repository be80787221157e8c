"""The input of an assignment rule."""

from typing import NamedTuple

import numpy as np

from ...compiled import compiled

# What unmatched pursuers do: wait, or go after the riskiest evader that they see.
EXTRA_PURSUERS = ("stay", "riskiest")


class TeamView(NamedTuple):
    """A moment of the game, as the assignment rules see it.

    Attributes:
        visible: Whether pursuer i sees evader j, shape (n, m), bool.
        risk: Risk of pair (i, j), shape (n, m) [1/m].
        pursuers: Positions, shape (n, 2) [m].
        evaders: Positions, shape (m, 2) [m].
        extra: One of EXTRA_PURSUERS.
        seed: For rules that draw lots.
        numbers: Which pursuers of the team these are, for lots, shape (n,); empty: all of them.
    """

    visible: np.ndarray
    risk: np.ndarray
    pursuers: np.ndarray
    evaders: np.ndarray
    extra: str = "stay"
    seed: int = 0
    numbers: np.ndarray = np.empty(0, dtype=int)


# Assigned to pursuers that track nobody.
UNASSIGNED = -1


@compiled
def names_evaders(assignment: np.ndarray, evaders: int) -> bool:
    """Whether every entry is the number of an evader, or -1.

    Args:
        assignment: Shape (n,).
        evaders: How many there are.
    """
    named = 0
    for target in assignment:
        # No comparison with NaN is true.
        if target >= UNASSIGNED and target < evaders and target == np.floor(target):
            named += 1
    return named == len(assignment)
