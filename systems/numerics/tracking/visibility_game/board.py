"""A solved visibility game, in the form in which compiled code looks it up during a game."""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ...compiled import compiled, kernel
from ...errors import require
from ...geometry.edge_index import EdgeIndex
from .guaranteed_times import GuaranteedTimes
from .plane_steps import make_buffers, write_steps
from .planes import COLUMN, COLUMNS, FOR_EVER, ROW, ROWS, SLOT, TILE, Planes, Rules, tile_of

# Distance of an evader from the nearest node at which it would not be kept for ever.
#
# All nodes at which an evader is kept for ever have the same value; this distance ranks them. It is
# the straight distance, also across obstacles, since the pursuer does not see the far side of a
# thin obstacle either.
#
# For each plane the distance along columns is computed first, from the rows above and then below;
# then the least d^2 + (that distance)^2 over the offsets d along the row.

# Largest distance that is stored [cells].
FARTHEST = 255


@compiled
def distances_to_losing(planes: Planes, rules: Rules) -> np.ndarray:
    """For each pursuer node, distances of the evader nodes in sight to one not kept for ever.

    Args:
        planes: Solved values.
        rules: Of the game.

    Returns:
        Shape (k, TILE * TILE), as `Planes.tiles`, rounded down [cells].
    """
    reach = len(rules.halves) // 2
    rows, columns = rules.blocked.shape[0] - 2 * reach, rules.blocked.shape[1] - 2 * reach
    steps, above = np.empty((rows, columns), dtype=np.uint8), np.empty((rows, columns), np.uint8)
    squares, least = np.empty(columns, dtype=np.int32), np.empty(columns, dtype=np.int32)
    buffers = make_buffers(planes, rules)
    distances = np.zeros(planes.tiles.shape, dtype=np.uint8)
    for p in range(len(planes.windows)):
        window = planes.windows[p]
        if window[ROWS] == 0:
            continue
        write_steps(planes, rules, p, buffers, steps)
        _measure_columns(steps, above)
        first, last = window[COLUMN] * TILE, (window[COLUMN] + window[COLUMNS]) * TILE
        for j in range(window[ROW] * TILE, (window[ROW] + window[ROWS]) * TILE):
            tiles = planes.slots[window[SLOT] + (j // TILE - window[ROW]) * window[COLUMNS] :]
            _square(squares, above[j])
            _square(least, above[j])
            # Only nodes kept for ever matter: the others have distance 0.
            farthest, d = _farthest_kept(planes, tiles, steps[j], j, first, last, least), 1
            while d < columns and d * d < farthest:
                _least_with_offset(least[: columns - d], squares[d:], d * d)
                _least_with_offset(least[d:], squares[: columns - d], d * d)
                if d % 4 == 0:
                    farthest = _farthest_kept(planes, tiles, steps[j], j, first, last, least)
                d += 1
            _write_roots(planes, tiles, j, first, last, least, distances)
    return distances


@kernel
def _measure_columns(steps, above):
    """Distance along columns from each node to the nearest one that is not kept for ever."""
    rows = len(steps)
    above[0] = FARTHEST
    for j in range(rows):
        _pass_on(above[j], above[max(j - 1, 0)], steps[j])
    for j in range(rows - 2, -1, -1):
        _pass_back(above[j], above[j + 1])


@kernel
def _farthest_kept(planes, tiles, steps, row, first, last, squares):
    """Largest squared distance so far of the nodes of a row that are in sight and kept for ever."""
    most = 0
    for c in range(last - first):
        t = tiles[c // TILE]
        kept = t >= 0 and steps[first + c] == FOR_EVER and squares[first + c] > most
        if kept and planes.tiles[t, row % TILE * TILE + c % TILE] != 0:
            most = squares[first + c]
    return most


@kernel
def _write_roots(planes, tiles, row, first, last, least, distances):
    """Write the distances of the nodes of a row that are in sight."""
    for c in range(last - first):
        t, at = tiles[c // TILE], row % TILE * TILE + c % TILE
        if t >= 0 and planes.tiles[t, at] != 0:
            distances[t, at] = min(int(np.sqrt(float(least[first + c]))), FARTHEST)


# One loop each, over arrays that do not overlap, so that the compiler can vectorise them.


@kernel
def _pass_on(out, before, steps):
    most = np.uint8(FARTHEST)
    for i in range(len(out)):
        more = before[i] + np.uint8(1) if before[i] < most else most
        out[i] = more if steps[i] == FOR_EVER else np.uint8(0)


@kernel
def _pass_back(out, after):
    most = np.uint8(FARTHEST)
    for i in range(len(out)):
        more = after[i] + np.uint8(1) if after[i] < most else most
        out[i] = more if more < out[i] else out[i]


@kernel
def _square(out, values):
    for i in range(len(out)):
        out[i] = np.int32(values[i]) * np.int32(values[i])


@kernel
def _least_with_offset(out, squares, square):
    for i in range(len(out)):
        value = squares[i] + np.int32(square)
        out[i] = value if value < out[i] else out[i]


# Most memory for the distances to losing [bytes].
MEMORY = 2e9


class Board(NamedTuple):
    """A solved game, as compiled code looks it up; make one with `make_board`.

    Attributes:
        planes, rules: See `planes`.
        numbers: Number of the pursuer's node in each row and column, or -1, shape (rows, columns).
        places: The pursuer's nodes, shape (n, 2) [m].
        pursuer_frame, evader_frame: x and y of the first node, and spacing, shape (3,) [m].
        evader_nodes: Nodes where evaders can be, shape (rows, columns), bool.
        distances: For each pursuer node, distance of each evader node in sight to the nearest one
            that is not kept for ever, at most 255, shape (k, TILE * TILE), as `Planes.tiles`
            [cells]; empty for the lower bound, shape (0, TILE * TILE).
        sight, pursuer_region: Edges that block sight, and edges of the pursuer's region.
    """

    planes: Planes
    rules: Rules
    numbers: np.ndarray
    places: np.ndarray
    pursuer_frame: np.ndarray
    evader_frame: np.ndarray
    evader_nodes: np.ndarray
    distances: np.ndarray
    sight: EdgeIndex
    pursuer_region: EdgeIndex


@lru_cache(maxsize=4)
def make_board(table: GuaranteedTimes) -> Board:
    """The tables of a solved game, made once and shared (cached).

    Args:
        table: The game by the middle bound, or by the lower one, for which no distances are made.

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
        table.sight,
        table.pursuer_region,
    )


@kernel
def distance_to_losing(board, q, row, column):
    """Distance of an evader to the nearest node not kept for ever, with the pursuer at a place.

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
    """Convert the steps left after the next step into steps from now; inf for FOR_EVER, 0 for 0.

    Args:
        steps: From `worst_reply`, which counts from the end of the step.
    """
    if steps == FOR_EVER:
        return np.inf
    return steps + 1.0 if steps > 0 else 0.0
