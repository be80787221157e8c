"""Results shared by the rollouts in which one evader tries its plans.

Only that evader moves differently from rollout to rollout. The other evaders keep their motion, and
pursuers that do not mind it (keep an eye on it) react as before as long as they are at the same
places. So what each of them sees and does is computed once for all plans.

Source: ours.
"""

from typing import NamedTuple

import numpy as np

from ...compiled import compiled, kernel
from ...geometry.edge_index import EdgeIndex
from ...geometry.segment_sight import CornerIndex, see_corners, segment_is_clear
from ..sight_state import split_sight


class CommonPlay(NamedTuple):
    """Results of the first rollout that reached each turn.

    Attributes:
        turns: Number of turns with known positions and sight, and number of turns with known
            velocities, shape (2,), int.
        pursuers, evaders: Positions, shapes (t, 2 n), (t, 2 m) [m].
        sight: Who saw what, shape (t, n m + n k + m k), as from `observe`.
        assigned: Each pursuer's evader, -1 for none, shape (t, n), int.
        minded: Which evaders each pursuer minded, shape (t, n, m), bool.
        velocities: Of pursuers by the solved game, shape (t, 2 n) [m/s].
    """

    turns: np.ndarray
    pursuers: np.ndarray
    evaders: np.ndarray
    sight: np.ndarray
    assigned: np.ndarray
    minded: np.ndarray
    velocities: np.ndarray


@compiled
def no_common_play(turns: int, pursuers: int, evaders: int, corners: int) -> CommonPlay:
    """Allocate a `CommonPlay` of which nothing is known yet.

    Args:
        turns, pursuers, evaders, corners: Their numbers.
    """
    size = pursuers * evaders + (pursuers + evaders) * corners
    return CommonPlay(
        np.zeros(2, dtype=np.int64),
        np.zeros((turns, 2 * pursuers)),
        np.zeros((turns, 2 * evaders)),
        np.zeros((turns, size)),
        np.zeros((turns, pursuers), dtype=np.int64),
        np.zeros((turns, pursuers, evaders), dtype=np.bool_),
        np.zeros((turns, 2 * pursuers)),
    )


@kernel
def stands_as_before(common: CommonPlay, turn: int, pursuers: np.ndarray, i: int) -> bool:
    """Whether a pursuer is where it was at this turn in the first rollout (kernel).

    Args:
        common: Results shared by the rollouts.
        turn: The present turn.
        pursuers: Present positions, shape (2 n,) [m].
        i: The pursuer.
    """
    return (
        turn < common.turns[0]
        and common.pursuers[turn, 2 * i] == pursuers[2 * i]
        and common.pursuers[turn, 2 * i + 1] == pursuers[2 * i + 1]
    )


@compiled
def see_whom(
    common: CommonPlay,
    turn: int,
    j: int,
    index: EdgeIndex,
    pursuers: np.ndarray,
    evaders: np.ndarray,
    visibility: np.ndarray,
) -> bool:
    """Fill in which evaders each pursuer sees; return whether any pursuer sees evader j.

    Args:
        common, turn: See `stands_as_before`.
        j: The evader that tries its plans.
        index: The world's edges.
        pursuers, evaders: Present positions, shapes (2 n,), (2 m,) [m].
        visibility: Filled with 1.0 and 0.0, shape (n, m).
    """
    n, m = visibility.shape
    seen = False
    for i in range(n):
        same = stands_as_before(common, turn, pursuers, i)
        for e in range(m):
            if same and e != j:
                visibility[i, e] = common.sight[turn, i * m + e]
            else:
                visibility[i, e] = segment_is_clear(
                    index,
                    pursuers[2 * i],
                    pursuers[2 * i + 1],
                    evaders[2 * e],
                    evaders[2 * e + 1],
                )
        seen = seen or visibility[i, j] > 0.5
    return seen


@compiled
def see_which_corners(
    common: CommonPlay,
    turn: int,
    j: int,
    index: EdgeIndex,
    corners: CornerIndex,
    pursuers: np.ndarray,
    evaders: np.ndarray,
    own: np.ndarray,
    sight: np.ndarray,
) -> None:
    """Fill in which corners each agent sees, and store a turn that no rollout reached before.

    Args:
        common, turn, j, index, pursuers, evaders: See `see_whom`.
        corners: The world's corners.
        own: Scratch, see `see_corners`.
        sight: Shape (n m + n k + m k,); which evaders are seen is filled in already.
    """
    n, m, k = len(pursuers) // 2, len(evaders) // 2, len(corners.points)
    _, pursuer_corners, evader_corners = split_sight(sight, n, m, k)
    _, by_pursuers, by_evaders = split_sight(common.sight[turn], n, m, k)
    for i in range(n):
        if stands_as_before(common, turn, pursuers, i):
            pursuer_corners[i] = by_pursuers[i]
        else:
            viewer = pursuers[2 * i : 2 * i + 2]
            see_corners(index, corners, viewer, own, pursuer_corners[i : i + 1])
    for e in range(m):
        if turn < common.turns[0] and e != j:
            evader_corners[e] = by_evaders[e]
        else:
            viewer = evaders[2 * e : 2 * e + 2]
            see_corners(index, corners, viewer, own, evader_corners[e : e + 1])
    if turn == common.turns[0]:
        common.turns[0] += 1
        common.pursuers[turn], common.evaders[turn], common.sight[turn] = pursuers, evaders, sight


@kernel
def answers_as_before(
    common: CommonPlay,
    turn: int,
    pursuers: np.ndarray,
    assigned: np.ndarray,
    minded: np.ndarray,
    i: int,
    j: int,
) -> bool:
    """Whether pursuer i has the same velocity as at this turn in the first rollout (kernel).

    Args:
        common, turn: See `stands_as_before`.
        pursuers: Present positions, shape (2 n,) [m].
        assigned: Each one's evader, -1 for none, shape (n,).
        minded: Which evaders each minds, shape (n, m), bool.
        i: The pursuer.
        j: The evader that tries its plans.
    """
    if turn >= common.turns[1] or not stands_as_before(common, turn, pursuers, i):
        return False
    if assigned[i] == j or assigned[i] != common.assigned[turn, i] or minded[i, j]:
        return False
    same = True
    for e in range(minded.shape[1]):
        same = same and minded[i, e] == common.minded[turn, i, e]
    return same


@compiled
def remember_answers(
    common: CommonPlay,
    turn: int,
    assigned: np.ndarray,
    minded: np.ndarray,
    velocities: np.ndarray,
) -> None:
    """Store the pursuers' velocities at a turn that no rollout reached before.

    Args:
        common, turn, assigned, minded: See `answers_as_before`.
        velocities: Of pursuers, shape (2 n,) [m/s].
    """
    if turn == common.turns[1]:
        common.turns[1] += 1
        common.assigned[turn], common.minded[turn] = assigned, minded
        common.velocities[turn] = velocities
