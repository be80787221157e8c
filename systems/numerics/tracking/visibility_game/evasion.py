"""Evasion by the solved visibility game.

An evader that a pursuer sees takes the move that leaves the least time, whatever the pursuer then
does: the evader's optimal play of the game that the table solves. If several pursuers see it, all
have to lose it, so the longest of their times counts.

The table covers all corners at once, but knows the players only to the nearest nodes; the closed
form of one corner uses their exact positions. Near the barrier a single node decides, and there an
evader that follows the table does worse than one that follows the closed form, even against
pursuers that use the same table. So the evader follows the closed form

- where the table has nothing better, as for moves with equal values;
- where the closed form promises to be hidden sooner.

Where the evader can be kept for ever all its moves have the same value. With `with_distance` it
then makes for the nearest place at which it is not kept for ever, as long as that is nearer than
the corner of the closed form. So it presses the pursuer to the barrier, and crosses it at the first
mistake.

Source: ours.
"""

import math

import numpy as np

from ...compiled import compiled, kernel
from ...geometry.edge_index import EdgeIndex
from ...geometry.segment_sight import segment_is_clear
from .board import Board, distance_to_losing, nearest_evader_node, nearest_place
from .planes import FOR_EVER, steps_at
from .pursuit import STEP

# Allowed difference between the table's distance and the closed form's margin [cells].
DOUBT = 1.5


@compiled
def optimal_velocities(
    board: Board,
    region: EdgeIndex,
    pursuers: np.ndarray,
    evaders: np.ndarray,
    visibility: np.ndarray,
    closed_form: np.ndarray,
    with_distance: bool,
) -> np.ndarray:
    """Velocities of a team of evaders.

    Args:
        board: The solved game.
        region: Edges of where evaders can be.
        pursuers, evaders: Positions, shapes (2 n,), (2 m,) [m].
        visibility: 1.0 where a pursuer sees an evader, shape (n, m).
        closed_form: Each evader's velocity at full speed by the corner game [m/s], the predicted
            time until sight is lost [steps], and the margin [m], shape (m, 4).
        with_distance: Whether the distance to losing decides where an evader can be kept for ever.

    Returns:
        Shape (2 m,) [m/s]; the closed form's velocity for an evader that the table does not cover.
    """
    velocities = closed_form[:, :2].copy().ravel()
    seeing = np.empty(len(pursuers) // 2, dtype=np.int64)
    for j in range(len(evaders) // 2):
        count = 0
        for i in range(len(seeing)):
            if visibility[i, j] > 0.5:
                p = nearest_place(board, pursuers[2 * i], pursuers[2 * i + 1])
                if p >= 0:
                    seeing[count] = p
                    count += 1
        if count > 0:
            velocities[2 * j], velocities[2 * j + 1] = _velocity(
                board,
                region,
                seeing[:count],
                evaders[2 * j],
                evaders[2 * j + 1],
                closed_form[j],
                with_distance,
            )
    return velocities


@kernel
def _velocity(board, region, seeing, ex, ey, closed_form, with_distance):
    """Velocity of one evader that is seen by pursuers at the places `seeing`."""
    vx, vy, promised, margin = closed_form[0], closed_form[1], closed_form[2], closed_form[3]
    row, column = nearest_evader_node(board, ex, ey)
    speed = math.sqrt(vx * vx + vy * vy)
    if row < 0 or speed == 0.0:
        return vx, vy
    frame, nodes, halves = board.evader_frame, board.evader_nodes, board.rules.halves
    reach = len(halves) // 2
    # The best move, of equal ones the one most along the closed form's velocity; and the value of
    # the move that is most along it among all moves.
    least, likeness, ux, uy = np.inf, -np.inf, 0.0, 0.0
    most_alike, its_worth = -np.inf, np.inf
    for down in range(-reach, reach + 1):
        half = halves[down + reach]
        for right in range(-half, half + 1):
            r, c = row + down, column + right
            if r < 0 or c < 0 or r >= nodes.shape[0] or c >= nodes.shape[1] or not nodes[r, c]:
                continue
            dx, dy = frame[0] + c * frame[2] - ex, frame[1] + r * frame[2] - ey
            if not segment_is_clear(region, ex, ey, ex + dx, ey + dy):
                continue
            worth, alike = _worth(board, seeing, r, c, with_distance), dx * vx + dy * vy
            if alike > most_alike:
                most_alike, its_worth = alike, worth
            if worth < least or (worth == least and alike > likeness):
                least, likeness, ux, uy = worth, alike, dx, dy
    if its_worth == least:
        return vx, vy
    steps = math.floor(least / STEP)
    # V counts from the end of the evader's move, and sight is lost within its last step.
    if promised < steps + 0.5:
        return vx, vy
    if steps == FOR_EVER and margin / frame[2] < least - STEP * steps + DOUBT:
        return vx, vy
    distance = math.sqrt(ux * ux + uy * uy)
    if distance == 0.0:
        return 0.0, 0.0
    return speed * ux / distance, speed * uy / distance


@kernel
def _worth(board, seeing, row, column, with_distance):
    """Value of an evader's node to the pursuers that see it: the largest over these."""
    most = -np.inf
    for k in range(len(seeing)):
        worth = STEP * steps_at(board.planes, board.rules, seeing[k], row, column)
        if with_distance:
            worth += distance_to_losing(board, seeing[k], row, column)
        most = max(most, worth)
    return most
