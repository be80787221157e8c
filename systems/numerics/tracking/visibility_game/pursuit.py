"""Pursuit with the solved visibility game at hand.

What the table guarantees is a poor aim alone: all places from which the evader is kept for ever
are worth the same, and the pursuer would drift to their rim. So it takes the step that leaves the
longest time whatever the evader does. Of several it takes the one after which the evader is
farthest from all places where it would be lost some day, and of equal ones that which is most as a
pursuit field has it. Where the table knows nothing the field alone decides.

Source: ours.
"""

import math
from typing import NamedTuple

import numpy as np
from scipy.ndimage import distance_transform_edt

from ...compiled import compiled, kernel
from ...errors import require
from .guaranteed_times import GuaranteedTimes
from .sweeps import FOR_EVER, Planes, Rules, steps_from, worst_reply

# Distances to losing take this much at most [bytes].
MEMORY = 2e9

# A step is worth more than any distance; the field decides between equal ones.
STEP, LIKENESS = 1000.0, 1e-3


class Board(NamedTuple):
    """A solved game, as compiled code looks it up; make one with `make_board`.

    Attributes:
        planes, rules: See `sweeps`.
        numbers: Number of the pursuer's node in each row and column, or -1, shape (rows, columns).
        places: The pursuer's nodes, shape (n, 2) [m].
        pursuer_frame, evader_frame: x and y of the first node, and spacing, shape (3,) [m].
        evader_nodes: Where evaders can be, shape (rows, columns), bool.
        distances: From each pursuer node, how far each node of the evader is from the nearest one
            where it would be lost some day, at most 255, shape (n, rows, columns) [cells].
    """

    planes: Planes
    rules: Rules
    numbers: np.ndarray
    places: np.ndarray
    pursuer_frame: np.ndarray
    evader_frame: np.ndarray
    evader_nodes: np.ndarray
    distances: np.ndarray


def make_board(table: GuaranteedTimes) -> Board:
    """The tables of a solved game.

    Args:
        table: By the middle bound.

    Raises:
        InvalidInput: The distances would take too much memory.
    """
    grid, fine = table.pursuer_grid, table.evader_grid
    size = len(table.places) * table.evader_nodes.size
    require(size <= MEMORY, "grid", "be coarser for pursuit in so large a world", grid.spacing)
    numbers = np.full((grid.rows, grid.columns), -1)
    numbers[grid.nearest(table.places)] = np.arange(len(table.places))
    return Board(
        table.planes,
        table.rules,
        numbers,
        table.places,
        np.array([grid.x, grid.y, grid.spacing]),
        np.array([fine.x, fine.y, fine.spacing]),
        table.evader_nodes,
        np.stack([_distances(table, p) for p in range(len(table.places))]),
    )


def _distances(table: GuaranteedTimes, p: int) -> np.ndarray:
    """One plane of `Board.distances`."""
    steps = steps_from(table.planes, table.rules, p)
    rows, columns = table.evader_nodes.shape
    safe = (steps[:rows, :columns] == FOR_EVER) | ~table.evader_nodes
    if safe.all():
        return np.full(safe.shape, 255, dtype=np.uint8)
    distances = np.asarray(distance_transform_edt(safe))
    return np.minimum(distances, 255.0).astype(np.uint8)


@compiled
def guarantee_velocities(
    board: Board,
    pursuers: np.ndarray,
    evaders: np.ndarray,
    assignment: np.ndarray,
    field: np.ndarray,
    speed: float,
    period: float,
) -> np.ndarray:
    """Velocities of a team, each member after its own evader.

    Args:
        board: The solved game.
        pursuers, evaders: Positions, shapes (2 n,), (2 m,) [m].
        assignment: Each pursuer's evader, -1 for none, shape (n,).
        field: Velocities by a pursuit field, shape (2 n,) [m/s].
        speed: Pursuers' top speed [m/s].
        period: For how long a velocity is held, 0 for continuous time [s].

    Returns:
        Shape (2 n,) [m/s].
    """
    velocities = field.copy()
    for i in range(len(assignment)):
        j = int(assignment[i])
        if j >= 0:
            velocities[2 * i], velocities[2 * i + 1] = _velocity(
                board,
                pursuers[2 * i],
                pursuers[2 * i + 1],
                evaders[2 * j],
                evaders[2 * j + 1],
                field[2 * i],
                field[2 * i + 1],
                speed,
                period,
            )
    return velocities


@kernel
def _velocity(board, px, py, ex, ey, vx, vy, speed, period):
    """One pursuer's velocity after one evader."""
    here = _nearest_place(board, px, py)
    row, column = _nearest_evader_node(board, ex, ey)
    if here < 0 or row < 0:
        return vx, vy
    most, chosen = -np.inf, -1
    longest = 0
    for k in range(board.rules.neighbour_starts[here], board.rules.neighbour_starts[here + 1]):
        q = board.rules.neighbours[k]
        steps = worst_reply(board.planes, q, row, column)
        longest = max(longest, steps)
        dx, dy = board.places[q, 0] - px, board.places[q, 1] - py
        worth = STEP * steps + board.distances[q, row, column] + LIKENESS * (dx * vx + dy * vy)
        if worth > most:
            most, chosen = worth, q
    if longest == 0:
        return vx, vy
    dx, dy = board.places[chosen, 0] - px, board.places[chosen, 1] - py
    distance = math.sqrt(dx * dx + dy * dy)
    if distance == 0.0:
        return 0.0, 0.0
    pace = min(speed, distance / period) if period > 0.0 else speed
    return pace * dx / distance, pace * dy / distance


@kernel
def _nearest_place(board, x, y):
    """Number of the pursuer's node nearest to a point, of the nine round it, or -1."""
    frame, numbers = board.pursuer_frame, board.numbers
    i, j = int(np.round((x - frame[0]) / frame[2])), int(np.round((y - frame[1]) / frame[2]))
    nearest, found = np.inf, -1
    for row in range(max(j - 1, 0), min(j + 2, numbers.shape[0])):
        for column in range(max(i - 1, 0), min(i + 2, numbers.shape[1])):
            n = numbers[row, column]
            if n >= 0:
                distance = math.hypot(board.places[n, 0] - x, board.places[n, 1] - y)
                if distance < nearest:
                    nearest, found = distance, n
    return found


@kernel
def _nearest_evader_node(board, x, y):
    """Row and column of the evader's node nearest to a point, of the nine round it, or -1, -1."""
    frame, nodes = board.evader_frame, board.evader_nodes
    i, j = int(np.round((x - frame[0]) / frame[2])), int(np.round((y - frame[1]) / frame[2]))
    nearest, at_row, at_column = np.inf, -1, -1
    for row in range(max(j - 1, 0), min(j + 2, nodes.shape[0])):
        for column in range(max(i - 1, 0), min(i + 2, nodes.shape[1])):
            if nodes[row, column]:
                dx, dy = frame[0] + column * frame[2] - x, frame[1] + row * frame[2] - y
                distance = math.hypot(dx, dy)
                if distance < nearest:
                    nearest, at_row, at_column = distance, row, column
    return at_row, at_column
