"""Values of the visibility game in whole steps, by sweeps over the pursuer's nodes in place.

The pursuer moves first, and the evader knows it:

    V(p, e) = 1 + max over p' of min over e' of V(p', e')   where e is in sight of p, else 0.

The sweeps begin with "for ever" and come down to the greatest solution. What is kept is W(p, e) =
min over e' of V(p, e'), one byte a pair: a node then takes one maximum over its neighbours' planes,
and one erosion by the evader's moves.

Planes are kept in square tiles, and only those in which something is in sight. A maximum over tiles
takes one instruction for 32 pairs, and a map of many rooms costs no more than what is seen in it.
"""

from typing import NamedTuple

import numpy as np

from ...compiled import compiled, kernel

# Kept for ever, or to the horizon; also nodes where no evader can be.
FOR_EVER = 255

# As far as steps are counted.
MOST_STEPS = 254

# Side of a tile [nodes].
TILE = 32

# Columns of `Planes.windows`.
ROW, COLUMN, ROWS, COLUMNS, SLOT = range(5)


class Planes(NamedTuple):
    """The pairs in sight, and what they are worth.

    Attributes:
        windows: For each of n pursuer nodes the first row and column of its tiles, how many rows
            and columns of them, and where its slots begin; shape (n, 5).
        slots: Number of the tile at each place of a window, or -1 where nothing is in sight,
            shape (s,).
        row_starts: Where the rows of each window begin in `run_starts`, shape (n,).
        run_starts: Where the runs of each row begin in `runs`, shape (r + 1,).
        runs: First column in sight and first one no more, shape (m, 2).
        tiles: W, shape (k, TILE * TILE) [steps].
    """

    windows: np.ndarray
    slots: np.ndarray
    row_starts: np.ndarray
    run_starts: np.ndarray
    runs: np.ndarray
    tiles: np.ndarray


class Rules(NamedTuple):
    """Who may go where.

    Attributes:
        blocked: FOR_EVER where no evader can be, else 0; the evader's grid, filled up to whole
            tiles, with a rim as wide as its moves reach; shape (rows, columns).
        halves: Of the evader's moves, see `Moves`.
        neighbour_starts, neighbours: Where a pursuer may go from each node: itself, and others;
            shapes (n + 1,), (w,).
        beside_walls: Evader nodes from which a wall blocks moves: row, column, and the first of
            the moves that are left and the first no more; shape (b, 4).
        moves_left: Those moves, rows and columns, shape (m, 2).
        horizon: What lasts longer counts as for ever, at most MOST_STEPS [steps].
    """

    blocked: np.ndarray
    halves: np.ndarray
    neighbour_starts: np.ndarray
    neighbours: np.ndarray
    beside_walls: np.ndarray
    moves_left: np.ndarray
    horizon: int


@compiled
def sweep(planes: Planes, rules: Rules, order: np.ndarray, due: np.ndarray) -> int:
    """Compute the planes that are due once more, in an order; return how many that were.

    Args:
        planes: To be lowered.
        rules: Of the game.
        order: Pursuer nodes, shape (n,).
        due: Which planes depend on one that has changed, shape (n,), bool; kept up to date.
    """
    buffers = _make_buffers(planes, rules)
    count = 0
    for k in range(len(order)):
        p = order[k]
        if not due[p]:
            continue
        due[p] = False
        count += 1
        if _lower_plane(p, planes, rules, buffers):
            for n in range(rules.neighbour_starts[p], rules.neighbour_starts[p + 1]):
                due[rules.neighbours[n]] = True
    return count


@compiled
def steps_from(planes: Planes, rules: Rules, p: int) -> np.ndarray:
    """V from one pursuer node: FOR_EVER also where no evader can be.

    Args:
        planes: Solved.
        rules: Of the game.
        p: Number of the node.

    Returns:
        Shape (rows, columns) of whole tiles [steps].
    """
    reach = len(rules.halves) // 2
    rows, columns = rules.blocked.shape[0] - 2 * reach, rules.blocked.shape[1] - 2 * reach
    steps = rules.blocked[reach : reach + rows, reach : reach + columns].copy()
    buffers = _make_buffers(planes, rules)
    window = planes.windows[p]
    if window[ROWS] > 0:
        stride, plane = _count_steps(p, planes, rules, buffers), buffers[0]
        first = window[COLUMN] * TILE
        for j in range(window[ROWS] * TILE):
            at = (reach + j) * stride + reach
            row = steps[window[ROW] * TILE + j, first : first + window[COLUMNS] * TILE]
            _copy(row, plane[at : at + len(row)])
    return steps


@compiled
def count_pairs(planes: Planes, rules: Rules) -> np.ndarray:
    """Evader nodes in sight of each pursuer node, and those kept for ever, shape (n, 2).

    Args:
        planes: Solved.
        rules: Of the game.
    """
    reach = len(rules.halves) // 2
    buffers = _make_buffers(planes, rules)
    counts = np.zeros((len(planes.windows), 2), dtype=np.int64)
    for p in range(len(planes.windows)):
        window = planes.windows[p]
        if window[ROWS] == 0:
            continue
        stride, plane = _count_steps(p, planes, rules, buffers), buffers[0]
        for j in range(window[ROWS] * TILE):
            at = (reach + j) * stride + reach - window[COLUMN] * TILE
            row = planes.row_starts[p] + j
            for k in range(planes.run_starts[row], planes.run_starts[row + 1]):
                for i in range(planes.runs[k, 0], planes.runs[k, 1]):
                    counts[p, 0] += 1
                    counts[p, 1] += plane[at + i] == FOR_EVER
    return counts


@compiled
def worst_reply(planes: Planes, p: int, row: int, column: int) -> int:
    """W: what the evader's best reply leaves once the pursuer is at p [steps].

    Args:
        planes: Solved.
        p: Number of the pursuer's node.
        row, column: Of the evader's node before its reply.
    """
    t = _tile_of(planes, p, row // TILE, column // TILE)
    return 0 if t < 0 else int(planes.tiles[t, (row % TILE) * TILE + column % TILE])


@compiled
def _make_buffers(planes, rules):
    """Room for whole planes, shape (5, nodes and rim of the largest)."""
    reach = len(rules.halves) // 2
    largest = TILE * TILE
    for p in range(len(planes.windows)):
        rows, columns = planes.windows[p, ROWS] * TILE, planes.windows[p, COLUMNS] * TILE
        largest = max(largest, (rows + 2 * reach) * (columns + 2 * reach))
    return np.zeros((6, largest), dtype=np.uint8)


@kernel
def _lower_plane(p, planes, rules, buffers):
    """Compute W of one pursuer node anew; whether it changed."""
    window = planes.windows[p]
    if window[ROWS] == 0:
        return False
    stride, reach = _count_steps(p, planes, rules, buffers), len(rules.halves) // 2
    size = stride * (window[ROWS] * TILE + 2 * reach)
    plane, eroded = buffers[0, :size], buffers[2, :size]
    _erode(plane, stride, rules.halves, eroded, buffers[3, :size], buffers[4, :size])
    _mind_walls(plane, eroded, stride, window, rules)
    changed = False
    for place in range(window[ROWS] * window[COLUMNS]):
        t = planes.slots[window[SLOT] + place]
        if t < 0:
            continue
        row, column = place // window[COLUMNS] * TILE, place % window[COLUMNS] * TILE
        for j in range(TILE):
            at = (reach + row + j) * stride + reach + column
            values = planes.tiles[t, j * TILE : (j + 1) * TILE]
            changed |= _replace(values, eroded[at : at + TILE])
    return changed


@kernel
def _count_steps(p, planes, rules, buffers):
    """V of one pursuer node, on its window and a rim, into the first buffer; length of its rows."""
    window, reach = planes.windows[p], len(rules.halves) // 2
    rows, columns = window[ROWS] * TILE, window[COLUMNS] * TILE
    stride = columns + 2 * reach
    plane, best = buffers[0, : stride * (rows + 2 * reach)], buffers[1]
    first_row, first_column = window[ROW] * TILE, window[COLUMN] * TILE
    for j in range(rows + 2 * reach):
        source = rules.blocked[first_row + j, first_column : first_column + stride]
        _copy(plane[j * stride : (j + 1) * stride], source)
    tile = buffers[5, : TILE * TILE]
    for place in range(window[ROWS] * window[COLUMNS]):
        if planes.slots[window[SLOT] + place] < 0:
            continue
        row, column = place // window[COLUMNS], place % window[COLUMNS]
        tile[:] = 0
        for n in range(rules.neighbour_starts[p], rules.neighbour_starts[p + 1]):
            t = _tile_of(planes, rules.neighbours[n], window[ROW] + row, window[COLUMN] + column)
            if t >= 0:
                _raise_to(tile, planes.tiles[t])
        for j in range(TILE):
            at = (reach + row * TILE + j) * stride + reach + column * TILE
            _copy(best[at : at + TILE], tile[j * TILE : (j + 1) * TILE])
    for j in range(rows):
        at = (reach + j) * stride + reach - first_column
        row = planes.row_starts[p] + j
        for k in range(planes.run_starts[row], planes.run_starts[row + 1]):
            first, last = at + planes.runs[k, 0], at + planes.runs[k, 1]
            _one_more(plane[first:last], best[first:last], rules.horizon)
    return stride


@kernel
def _tile_of(planes, p, row, column):
    """Number of a pursuer node's tile, or -1."""
    window = planes.windows[p]
    row -= window[ROW]
    column -= window[COLUMN]
    if row < 0 or column < 0 or row >= window[ROWS] or column >= window[COLUMNS]:
        return -1
    return planes.slots[window[SLOT] + row * window[COLUMNS] + column]


@kernel
def _mind_walls(plane, eroded, stride, window, rules):
    """Least value over the moves that are left, beside walls that block some."""
    reach = len(rules.halves) // 2
    for b in range(len(rules.beside_walls)):
        beside = rules.beside_walls[b]
        j, i = beside[0] - window[ROW] * TILE, beside[1] - window[COLUMN] * TILE
        if j < 0 or i < 0 or j >= window[ROWS] * TILE or i >= window[COLUMNS] * TILE:
            continue
        at = (reach + j) * stride + reach + i
        least = plane[at]
        for k in range(beside[2], beside[3]):
            value = plane[at + rules.moves_left[k, 0] * stride + rules.moves_left[k, 1]]
            least = value if value < least else least
        eroded[at] = least


@kernel
def _erode(plane, stride, halves, out, odd, even):
    """out[f] = least of plane[f + move], in a flat plane whose rows are `stride` long.

    Rows and columns within reach of the rim are left as they were. `odd` and `even` are room for
    running minima along rows, whose width grows by one column a side in turn.
    """
    size, reach = len(plane), len(halves) // 2
    low, high = reach * stride + reach, size - reach * stride - reach
    target = out[low:high]
    target[:] = FOR_EVER
    for half in range(halves[reach] + 1):
        if half == 1:
            _least(odd[1 : size - 1], plane[: size - 2], plane[1 : size - 1], plane[2:])
        elif half > 1 and half % 2 == 0:
            _lesser(even[1 : size - 1], odd[: size - 2], odd[2:])
        elif half > 1:
            _lesser(odd[1 : size - 1], even[: size - 2], even[2:])
        minima = plane if half == 0 else (odd if half % 2 else even)
        for r in range(-reach, reach + 1):
            if halves[r + reach] == half:
                _lower_to(target, minima[low + r * stride : high + r * stride])


# One loop each, over arrays that do not overlap: so they become vector instructions.


@kernel
def _copy(out, values):
    for i in range(len(out)):
        out[i] = values[i]


@kernel
def _replace(values, others):
    """Copy, and tell whether anything was different."""
    different = np.uint8(0)
    for i in range(len(values)):
        different |= values[i] ^ others[i]
        values[i] = others[i]
    return different != 0


@kernel
def _raise_to(values, others):
    for i in range(len(values)):
        values[i] = others[i] if others[i] > values[i] else values[i]


@kernel
def _lower_to(values, others):
    for i in range(len(values)):
        values[i] = others[i] if others[i] < values[i] else values[i]


@kernel
def _lesser(out, a, b):
    for i in range(len(out)):
        out[i] = a[i] if a[i] < b[i] else b[i]


@kernel
def _least(out, a, b, c):
    for i in range(len(out)):
        least = a[i] if a[i] < b[i] else b[i]
        out[i] = least if least < c[i] else c[i]


@kernel
def _one_more(out, steps, horizon):
    """One step more; what would pass the horizon is for ever."""
    most = np.uint8(horizon)
    for i in range(len(out)):
        out[i] = steps[i] + np.uint8(1) if steps[i] < most else np.uint8(FOR_EVER)
