"""Assign pursuers to evaders so that the team's guaranteed time is as long as possible.

If each pursuer plays the one-against-one game with its own evader, then all evaders stay in sight
for at least the least of the pairs' guaranteed times, whatever they do: this is the certificate of
the matching. The best matching is therefore the one whose least time is greatest (a bottleneck
matching), and it is changed only if that makes the certificate longer.

Source: ours.
"""

import math

import numpy as np

from ...compiled import compiled, kernel
from ..assignment.matching import match_pairs
from ..assignment.team_view import UNASSIGNED
from .board import Board, nearest_evader_node, nearest_place, steps_from_now
from .bounds import team_certificate
from .planes import worst_reply

# A fast model of certified pursuers, for compiled code.
#
# By the lower bound a pursuer commits itself to a place for a step, goes straight there, and
# commits itself again. `GuaranteedTimes.best_step` is the exact policy: from any position, and only
# where sight is kept on the way as well. Here both players are assumed to be at their nearest
# nodes, which is fast enough for comparing pairs, and for rollouts against the policy.
#
# Source: ours.

# A pursuer's commitment: its destination, the number of steps left, and its evader.
COMMITMENT = 4
X, Y, LEFT, EVADER = range(COMMITMENT)


@compiled
def promised_steps(
    board: Board, pursuers: np.ndarray, evaders: np.ndarray, visible: np.ndarray
) -> np.ndarray:
    """For how long each pursuer can guarantee to keep each evader in sight.

    Args:
        board: The game by the lower bound.
        pursuers, evaders: Positions, shapes (2 n,), (2 m,) [m].
        visible: Who sees whom, shape (n, m), bool.

    Returns:
        Shape (n, m) [steps]; infinite if for ever, 0 where nothing can be guaranteed.
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
        field: Velocities by a pursuit field, used where nothing can be guaranteed, shape (2 n,)
            [m/s].
        commitments: Shape (n, COMMITMENT); zeros at the start, updated in place.
        steps: Number of periods for which a pursuer commits itself.
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
    """The longest time, from the end of a step, that pursuer i can guarantee for evader j [steps],
    and the nearest place for it; 0, -1 for nothing."""
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


# When a team changes its matching: at every step, when the held one is broken, or also when its
# certificate grows.
SWITCHES = ("none", "until_lost", "certificate")

# A new matching has to make the certificate longer by this share, and by a step.
GAIN = 0.1


def bottleneck(worth: np.ndarray) -> np.ndarray:
    """The matching whose least worth is greatest; of several, the one with the greatest total.

    As many evaders as possible are matched.

    Args:
        worth: Of each pair, 0 where the pursuer does not see the evader, shape (n, m).

    Returns:
        Each pursuer's evader, -1 for none, shape (n,).
    """
    values = np.unique(worth[worth > 0.0])
    if len(values) == 0:
        return np.full(len(worth), UNASSIGNED)
    targets = match_pairs(worth, worth > 0.0, maximise=True)
    most = np.count_nonzero(targets != UNASSIGNED)
    # Bisection for the greatest lower bound of the worths that still allows as many pairs; the
    # first value always does.
    low, high = 0, len(values)
    while high - low > 1:
        middle = (low + high) // 2
        above = match_pairs(worth, worth >= values[middle], maximise=True)
        if np.count_nonzero(above != UNASSIGNED) == most:
            low, targets = middle, above
        else:
            high = middle
    return targets


def with_helpers(targets: np.ndarray, worth: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """Give each pursuer without an evader one to help with: first evaders that nobody watches, then
    those of the weakest pairs.

    An evader without a pursuer is in sight only by chance, of a pursuer that watches another one.

    Args:
        targets: Each pursuer's evader, -1 for none, shape (n,).
        worth: Of each pair, 0 where the pursuer does not see the evader, shape (n, m).
        steps: How soon a pursuer could guard an evader that it does not see, infinite where there
            is no way, shape (n, m).
    """
    # Pursuers that see an evader come before those that do not; among those, the soonest is first.
    preference = np.where(worth > 0.0, worth, -steps)
    able = preference > -np.inf
    targets = targets.copy()
    while True:
        free = np.flatnonzero((targets == UNASSIGNED) & able.any(axis=1))
        if len(free) == 0:
            return targets
        watchers = np.bincount(targets[targets != UNASSIGNED], minlength=worth.shape[1])
        held = best_worths(targets, worth)
        helped = np.flatnonzero(able[free].any(axis=0))
        j = min(helped, key=lambda each: (watchers[each], held[each]))
        targets[free[np.argmax(preference[free, j])]] = j


def best_worths(targets: np.ndarray, worth: np.ndarray) -> np.ndarray:
    """Greatest worth of each evader's watchers, 0 without a watcher; shape (m,).

    Args:
        targets: Each pursuer's evader, -1 for none, shape (n,).
        worth: Of each pair, shape (n, m).
    """
    watched = targets[:, None] == np.arange(worth.shape[1])
    return np.where(watched, worth, 0.0).max(axis=0)


def certificate(targets: np.ndarray, times: np.ndarray) -> float:
    """How long all evaders stay in sight if each pursuer plays with its own [s].

    Args:
        targets: Each pursuer's evader, -1 for none, shape (n,).
        times: Guaranteed time of each pair, shape (n, m) [s].
    """
    own = np.where(targets == UNASSIGNED, 0.0, times[np.arange(len(times)), targets])
    return team_certificate(own, targets, times.shape[1])


def covered(targets: np.ndarray, visible: np.ndarray) -> int:
    """Number of evaders that are seen by a pursuer assigned to them.

    Args:
        targets: Each pursuer's evader, -1 for none, shape (n,).
        visible: Who sees whom, shape (n, m), bool.
    """
    return int(np.count_nonzero(best_worths(targets, visible)))


def is_longer(time: float, held: float, step: float) -> bool:
    """Whether a certificate is enough longer than the held one to justify a change.

    Args:
        time, held: Certificates [s].
        step: Of the game [s].
    """
    return time > (1.0 + GAIN) * held + step
