"""A solved visibility game, as compiled code looks it up while a game is played."""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ...compiled import kernel
from ...errors import require
from .distances import distances_to_losing
from .guaranteed_times import GuaranteedTimes
from .sweeps import FOR_EVER, TILE, Planes, Rules, tile_of

# Distances to losing take this much at most [bytes].
MEMORY = 2e9


class Board(NamedTuple):
    """A solved game, as compiled code looks it up; make one with `make_board`.

    Attributes:
        planes, rules: See `sweeps`.
        numbers: Number of the pursuer's node in each row and column, or -1, shape (rows, columns).
        places: The pursuer's nodes, shape (n, 2) [m].
        pursuer_frame, evader_frame: x and y of the first node, and spacing, shape (3,) [m].
        evader_nodes: Where evaders can be, shape (rows, columns), bool.
        distances: From each pursuer node, how far each evader node in sight is from the nearest
            one where it would be lost some day, at most 255, shape (k, TILE * TILE), as
            `Planes.tiles` [cells]; by the lower bound none, shape (0, TILE * TILE).
    """

    planes: Planes
    rules: Rules
    numbers: np.ndarray
    places: np.ndarray
    pursuer_frame: np.ndarray
    evader_frame: np.ndarray
    evader_nodes: np.ndarray
    distances: np.ndarray


@lru_cache(maxsize=4)
def make_board(table: GuaranteedTimes) -> Board:
    """The tables of a solved game, made once for all who look them up.

    Args:
        table: By the middle bound, or by the lower one, which keeps its promises anywhere.

    Raises:
        InvalidInput: The distances would take too much memory.
    """
    grid, fine = table.pursuer_grid, table.evader_grid
    if table.bound == "lower":
        distances = np.empty((0, TILE * TILE), dtype=np.uint8)
    else:
        size = table.planes.tiles.nbytes
        require(size <= MEMORY, "grid", "be coarser for pursuit in so large a world", grid.spacing)
        distances = distances_to_losing(table.planes, table.rules)
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
        distances,
    )


@kernel
def distance_to_losing(board, q, row, column):
    """How far an evader is from where it would be lost some day, with the pursuer at a place.

    Args:
        board: The game by the middle bound.
        q: Number of the pursuer's node.
        row, column: Of the evader's node.

    Returns:
        At most 255 [cells].
    """
    t = tile_of(board.planes, q, row // TILE, column // TILE)
    return 0 if t < 0 else int(board.distances[t, row % TILE * TILE + column % TILE])


@kernel
def nearest_place(board, x, y):
    """Number of the pursuer's node nearest to a point, of the nine round it, or -1.

    Args:
        board: The solved game.
        x, y: Of the point [m].
    """
    return nearest_node(board.numbers, board.pursuer_frame, x, y)


@kernel
def nearest_node(numbers, frame, x, y):
    """Number of the node nearest to a point, of the nine round it, or -1 (kernel).

    Args:
        numbers: Of the nodes in each row and column, or -1, shape (rows, columns).
        frame: x and y of the first node, and spacing, shape (3,) [m].
        x, y: The point [m].
    """
    i, j = int(np.round((x - frame[0]) / frame[2])), int(np.round((y - frame[1]) / frame[2]))
    nearest, found = np.inf, -1
    for row in range(max(j - 1, 0), min(j + 2, numbers.shape[0])):
        for column in range(max(i - 1, 0), min(i + 2, numbers.shape[1])):
            if numbers[row, column] >= 0:
                dx, dy = frame[0] + column * frame[2] - x, frame[1] + row * frame[2] - y
                distance = math.hypot(dx, dy)
                if distance < nearest:
                    nearest, found = distance, numbers[row, column]
    return found


@kernel
def nearest_evader_node(board, x, y):
    """Row and column of the evader's node nearest to a point, of the nine round it, or -1, -1.

    Args:
        board: The solved game.
        x, y: Of the point [m].
    """
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


@kernel
def steps_from_now(steps):
    """Steps from now, if a step from now leaves so many; infinite for ever, 0 where it leaves none.

    Args:
        steps: As of `worst_reply`, which counts from the end of the step.
    """
    if steps == FOR_EVER:
        return np.inf
    return steps + 1.0 if steps > 0 else 0.0
