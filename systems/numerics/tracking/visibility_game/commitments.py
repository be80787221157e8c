"""What pursuers that keep promises do next, as compiled code looks it up.

By the lower bound a pursuer commits itself to a place for a step, goes straight there, and commits
itself again. `GuaranteedTimes.best_step` is the policy to the letter: from anywhere, and only where
sight holds on the way as well. Here both are taken for being at their nearest nodes, which is what
whoever chooses among pairs, or plays against the policy beforehand, has time for.

Source: ours.
"""

import math

import numpy as np

from ...compiled import compiled, kernel
from .board import Board, nearest_evader_node, nearest_place, steps_from_now
from .sweeps import worst_reply

# Of each pursuer's commitment: where to, how many steps are left, after whom.
COMMITMENT = 4
X, Y, LEFT, EVADER = range(COMMITMENT)


@compiled
def promised_steps(
    board: Board, pursuers: np.ndarray, evaders: np.ndarray, visible: np.ndarray
) -> np.ndarray:
    """How long each pursuer can promise to keep each evader.

    Args:
        board: The game by the lower bound.
        pursuers, evaders: Positions, shapes (2 n,), (2 m,) [m].
        visible: Who sees whom, shape (n, m), bool.

    Returns:
        Shape (n, m) [steps]; infinite for ever, 0 where nothing can be promised.
    """
    n, m = visible.shape
    found = np.zeros((n, m))
    for i in range(n):
        here = nearest_place(board, pursuers[2 * i], pursuers[2 * i + 1])
        for j in range(m):
            if visible[i, j]:
                steps, _ = _committed_step(board, here, pursuers, i, evaders, j)
                found[i, j] = steps_from_now(steps)
    return found


@compiled
def committed_velocities(
    board: Board,
    pursuers: np.ndarray,
    evaders: np.ndarray,
    visible: np.ndarray,
    assignment: np.ndarray,
    field: np.ndarray,
    commitments: np.ndarray,
    steps: int,
    period: float,
) -> np.ndarray:
    """Velocities of a team, each member after its own evader.

    Args:
        board: The game by the lower bound.
        pursuers, evaders: Positions, shapes (2 n,), (2 m,) [m].
        visible: Who sees whom, shape (n, m), bool.
        assignment: Each pursuer's evader, -1 for none, shape (n,).
        field: Velocities by a pursuit field, where nothing can be promised, shape (2 n,) [m/s].
        commitments: Shape (n, COMMITMENT); zeros to begin with, brought up to date.
        steps: For how many periods a pursuer commits itself.
        period: For how long a velocity is held [s].

    Returns:
        Shape (2 n,) [m/s].
    """
    velocities = field.copy()
    for i in range(len(commitments)):
        own, j = commitments[i], int(assignment[i])
        if own[LEFT] == 0 or own[EVADER] != j:
            own[LEFT] = 0
            if j < 0 or not visible[i, j]:
                continue
            here = nearest_place(board, pursuers[2 * i], pursuers[2 * i + 1])
            left, place = _committed_step(board, here, pursuers, i, evaders, j)
            if left == 0:
                continue
            own[X], own[Y] = board.places[place, 0], board.places[place, 1]
            own[LEFT], own[EVADER] = steps, j
        for axis in range(2):
            way = own[axis] - pursuers[2 * i + axis]
            velocities[2 * i + axis] = way / (own[LEFT] * period)
        own[LEFT] -= 1
    return velocities


@kernel
def _committed_step(board, here, pursuers, i, evaders, j):
    """The most that pursuer i can promise of evader j from the end of a step [steps], and the
    nearest place to do it from; 0, -1 for nothing."""
    row, column = nearest_evader_node(board, evaders[2 * j], evaders[2 * j + 1])
    if here < 0 or row < 0:
        return 0, -1
    most, nearest, chosen = 0, np.inf, -1
    for k in range(board.rules.neighbour_starts[here], board.rules.neighbour_starts[here + 1]):
        q = board.rules.neighbours[k]
        steps = worst_reply(board.planes, q, row, column)
        dx, dy = board.places[q, 0] - pursuers[2 * i], board.places[q, 1] - pursuers[2 * i + 1]
        distance = math.sqrt(dx * dx + dy * dy)
        if steps > most or (steps == most and steps > 0 and distance < nearest):
            most, nearest, chosen = steps, distance, q
    return most, chosen
