"""Evasion with the solved visibility game at hand.

An evader that a pursuer sees takes the move that leaves the least time, however the pursuer goes on
from where it is: the evader's own play of the game that the table solves. Of several pursuers that
see it all have to lose it, and what counts is the longest of their times.

The table knows all corners at once, but the players only to the nearest nodes; the closed form of
one corner knows exactly where they are. Near the barrier a node too many decides, and there an
evader that trusts a table plays for nothing: it loses to the closed form, even against pursuers
that trust the same table. So it goes as the closed form has it

- where the table has nothing better, of which moves worth the same are one case;
- where the closed form promises to be hidden sooner.

Where the evader can be kept for ever all its moves are worth the same. With the distance it then
makes for the nearest place at which it is lost some day, as long as that is nearer than the corner
of the closed form. So it presses the pursuer to the barrier, and is over it at the first mistake.

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

# Of one place the table's distance and the closed form's margin may differ by this [cells].
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
        closed_form: Each evader's velocity at full speed by the corner game [m/s], the time that
            it promises until sight is lost [steps], and its margin [m], shape (m, 4).
        with_distance: Whether the distance to losing decides where an evader can be kept.

    Returns:
        Shape (2 m,) [m/s]; the closed form's for an evader that the table knows nothing of.
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
    """One evader's velocity before pursuers at some places."""
    vx, vy, promised, margin = closed_form[0], closed_form[1], closed_form[2], closed_form[3]
    row, column = nearest_evader_node(board, ex, ey)
    speed = math.sqrt(vx * vx + vy * vy)
    if row < 0 or speed == 0.0:
        return vx, vy
    frame, nodes, halves = board.evader_frame, board.evader_nodes, board.rules.halves
    reach = len(halves) // 2
    # The best move, of equal ones the one that is most as the closed form has it; and that which
    # is most so of all.
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
    """What a node of the evader is worth to the pursuers that see it, to the best of them."""
    most = -np.inf
    for k in range(len(seeing)):
        worth = STEP * steps_at(board.planes, board.rules, seeing[k], row, column)
        if with_distance:
            worth += distance_to_losing(board, seeing[k], row, column)
        most = max(most, worth)
    return most
