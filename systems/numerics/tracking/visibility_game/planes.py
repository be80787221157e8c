"""Tables of the visibility game: pairs of nodes in sight, and their values, stored in tiles.

S is stored where the pursuer goes first, V itself where the evader does; see `sweeps.py`. Planes
are stored in square tiles, and only those in which some node is in sight. A maximum over tiles
takes one instruction for 32 pairs, and the memory for a map of many rooms is only that for the
pairs in sight.
"""

from typing import NamedTuple

import numpy as np

from ...compiled import compiled, kernel

# Kept for ever, or to the horizon; also nodes where no evader can be.
FOR_EVER = 255

# Largest finite number of steps.
MOST_STEPS = 254

# Side of a tile [nodes]. The rim of what is seen runs through tiles: larger ones waste memory.
TILE = 16

# Columns of `Planes.windows`.
ROW, COLUMN, ROWS, COLUMNS, SLOT = range(5)

# All moves of a pursuer, as bits of `Rules.care_moves`.
ALL = np.uint32(0xFFFFFFFF)


class Planes(NamedTuple):
    """The pairs in sight, and their values.

    Attributes:
        windows: For each of n pursuer nodes the first row and column of its tiles, the numbers of
            rows and columns of tiles, and where its slots begin; shape (n, 5).
        slots: Number of the tile at each place of a window, or -1 where nothing is in sight,
            shape (s,).
        tiles: S, or V where the evader goes first, shape (k, TILE * TILE) [steps].
    """

    windows: np.ndarray
    slots: np.ndarray
    tiles: np.ndarray


class Rules(NamedTuple):
    """The moves of both players.

    Attributes:
        blocked: FOR_EVER where no evader can be, else 0; the evader's grid, filled up to whole
            tiles, with a rim as wide as its moves reach; shape (rows, columns).
        halves: Of the evader's moves, see `Moves`.
        neighbour_starts, neighbours: Nodes to which a pursuer may go from each node, that node
            included; shapes (n + 1,), (w,).
        beside_walls: Evader nodes from which a wall blocks moves, tile by tile: row, column, and
            the range [first, end) of the moves that are left in `moves_left`; shape (b, 4).
        wall_starts: Where the nodes of each tile of the grid begin in `beside_walls`, row by row,
            shape (tiles + 1,).
        moves_left: Those moves, rows and columns, shape (m, 2).
        care_starts, care_nodes, care_moves: Evader nodes for which some moves from a pursuer's node
            may lose sight on the way: where they begin for each node, shape (n + 1,); row and
            column, sorted by rows, shape (c, 2); the moves that keep sight, bit k standing for
            neighbour k, shape (c,). Staying always keeps sight.
        horizon: Number of steps above which a value counts as for ever, at most MOST_STEPS [steps].
        evader_first: Whether the evader commits to its move first.
    """

    blocked: np.ndarray
    halves: np.ndarray
    neighbour_starts: np.ndarray
    neighbours: np.ndarray
    beside_walls: np.ndarray
    wall_starts: np.ndarray
    moves_left: np.ndarray
    care_starts: np.ndarray
    care_nodes: np.ndarray
    care_moves: np.ndarray
    horizon: int
    evader_first: bool


@kernel
def tile_of(planes: Planes, p: int, row: int, column: int) -> int:
    """Number of a pursuer node's tile, or -1.

    Args:
        planes: Solved or not.
        p: Number of the node.
        row, column: Of the tile.
    """
    window = planes.windows[p]
    row -= window[ROW]
    column -= window[COLUMN]
    if row < 0 or column < 0 or row >= window[ROWS] or column >= window[COLUMNS]:
        return -1
    return int(planes.slots[window[SLOT] + row * window[COLUMNS] + column])


@compiled
def worst_reply(planes: Planes, p: int, row: int, column: int) -> int:
    """W: least V over the evader's replies once the pursuer is at p [steps].

    Args:
        planes: Solved, the pursuer going first.
        p: Number of the pursuer's node.
        row, column: Of the evader's node before its reply.
    """
    t = tile_of(planes, p, row // TILE, column // TILE)
    if t < 0:
        return 0
    steps = int(planes.tiles[t, (row % TILE) * TILE + column % TILE])
    return steps if steps == 0 or steps == FOR_EVER else steps - 1


@compiled
def keeps_by_table(planes: Planes, rules: Rules, p: int, q: int, row: int, column: int) -> bool:
    """Whether a pursuer's move is one of those over which V of a pair is maximised.

    Args:
        planes: Solved, the pursuer going first.
        rules: Of the game.
        p, q: Numbers of the pursuer's nodes before its move and after.
        row, column: Of the evader's node before its reply.
    """
    t = tile_of(planes, p, row // TILE, column // TILE)
    if t < 0 or planes.tiles[t, row % TILE * TILE + column % TILE] == 0:
        return False
    moves, first = _moves_at(p, rules, row, column), rules.neighbour_starts[p]
    for n in range(first, rules.neighbour_starts[p + 1]):
        if rules.neighbours[n] == q:
            return moves == ALL or ((moves >> np.uint32(n - first)) & np.uint32(1)) != 0
    return False


@compiled
def best_answer(planes: Planes, rules: Rules, p: int, row: int, column: int) -> int:
    """Largest V over the pursuer's replies once the evader is at a node [steps].

    Args:
        planes: Solved, the evader going first.
        rules: Of the game.
        p: Number of the pursuer's node before its move.
        row, column: Of the evader's node after its own.
    """
    return best_at(p, planes, rules, row, column, ALL)


@kernel
def steps_at(planes: Planes, rules: Rules, p: int, row: int, column: int) -> int:
    """V of one pair of nodes (kernel): FOR_EVER where no evader can be.

    Args:
        planes: Solved.
        rules: Of the game.
        p: Number of the pursuer's node.
        row, column: Of the evader's node.
    """
    reach = len(rules.halves) // 2
    if rules.blocked[row + reach, column + reach] == FOR_EVER:
        return FOR_EVER
    at = (row % TILE) * TILE + column % TILE
    t = tile_of(planes, p, row // TILE, column // TILE)
    if t < 0 or planes.tiles[t, at] == 0:
        return 0
    if rules.evader_first:
        return int(planes.tiles[t, at])
    return best_at(p, planes, rules, row, column, _moves_at(p, rules, row, column))


@kernel
def _moves_at(p, rules, row, column):
    """The moves from p that keep sight of an evader node on the way, as bits; ALL for all."""
    low, high = rules.care_starts[p], rules.care_starts[p + 1]
    while low < high:
        middle = (low + high) // 2
        at_row, at_column = rules.care_nodes[middle, 0], rules.care_nodes[middle, 1]
        if at_row == row and at_column == column:
            return rules.care_moves[middle]
        if at_row < row or (at_row == row and at_column < column):
            low = middle + 1
        else:
            high = middle
    return ALL


@kernel
def best_at(p: int, planes: Planes, rules: Rules, row: int, column: int, moves: np.uint32) -> int:
    """Largest stored value at one evader node over some moves of the pursuer from p (kernel).

    Args:
        p: Number of the pursuer's node.
        planes, rules: Of the game.
        row, column: Of the evader's node.
        moves: As bits of `Rules.care_moves`; ALL for all.
    """
    at = row % TILE * TILE + column % TILE
    first, most = rules.neighbour_starts[p], 0
    for n in range(first, rules.neighbour_starts[p + 1]):
        if moves == ALL or (moves >> np.uint32(n - first)) & np.uint32(1):
            t = tile_of(planes, rules.neighbours[n], row // TILE, column // TILE)
            if t >= 0:
                most = max(most, int(planes.tiles[t, at]))
    return most
