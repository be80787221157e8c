"""V of one pursuer node at a time on a plane of evader nodes, and its counts over all nodes.

Each loop over bytes runs over arrays that do not overlap, so that the compiler can vectorise it.
"""

import numpy as np

from ...compiled import compiled, kernel
from .planes import (
    ALL,
    COLUMN,
    COLUMNS,
    FOR_EVER,
    ROW,
    ROWS,
    SLOT,
    TILE,
    Planes,
    Rules,
    best_at,
    tile_of,
)

# Rows of `make_buffers`: V; the best values of the neighbours in a tile, also flags of changed
# tiles; V in a strip of tiles, the same eroded, and two running minima; and for each place of a
# window what has to be computed: V only (NEEDED), or what is stored as well (DUE).
PLANE, BEST, STRIP, ERODED, ODD, EVEN, PLAN = range(7)
NEEDED, DUE = 1, 2


@compiled
def make_buffers(planes: Planes, rules: Rules) -> np.ndarray:
    """Allocate the buffers for computing one pursuer node at a time.

    Args:
        planes, rules: Of the game.

    Returns:
        Shape (7, nodes and rim of the largest window); for what, see `PLANE` and the others.
    """
    reach = len(rules.halves) // 2
    largest = TILE * TILE
    for p in range(len(planes.windows)):
        rows, columns = planes.windows[p, ROWS] * TILE, planes.windows[p, COLUMNS] * TILE
        largest = max(largest, (rows + 2 * reach) * (columns + 2 * reach))
    return np.zeros((7, largest), dtype=np.uint8)


@compiled
def steps_from(planes: Planes, rules: Rules, p: int) -> np.ndarray:
    """V from one pursuer node; FOR_EVER also where no evader can be.

    Args:
        planes: Solved.
        rules: Of the game.
        p: Number of the node.

    Returns:
        Shape (rows, columns) of whole tiles [steps].
    """
    reach = len(rules.halves) // 2
    rows, columns = rules.blocked.shape[0] - 2 * reach, rules.blocked.shape[1] - 2 * reach
    steps = np.empty((rows, columns), dtype=np.uint8)
    write_steps(planes, rules, p, make_buffers(planes, rules), steps)
    return steps


@kernel
def write_steps(
    planes: Planes, rules: Rules, p: int, buffers: np.ndarray, steps: np.ndarray
) -> None:
    """Write what `steps_from` returns.

    Args:
        planes, rules, p: See `steps_from`.
        buffers: From `make_buffers`, shape (7, s).
        steps: Written to, shape (rows, columns) of whole tiles.
    """
    reach = len(rules.halves) // 2
    rows, columns = steps.shape
    for j in range(rows):
        copy(steps[j], rules.blocked[reach + j, reach : reach + columns])
    window = planes.windows[p]
    if window[ROWS] > 0:
        todo = buffers[PLAN]
        todo[: window[ROWS] * window[COLUMNS]] = NEEDED
        stride, plane = _read_steps(p, planes, rules, buffers), buffers[PLANE]
        first = window[COLUMN] * TILE
        for j in range(window[ROWS] * TILE):
            at = (reach + j) * stride + reach
            row = steps[window[ROW] * TILE + j, first : first + window[COLUMNS] * TILE]
            copy(row, plane[at : at + len(row)])


@compiled
def count_pairs(planes: Planes, rules: Rules) -> np.ndarray:
    """For each pursuer node, count evader nodes in sight and kept for ever, and sum the other V.

    Args:
        planes: Solved, with the pursuer going first; otherwise see `count_kept`.
        rules: Of the game.

    Returns:
        Shape (n, 3): two numbers of nodes, and the sum of V over those not kept for ever.
    """
    best = np.zeros(TILE * TILE, dtype=np.uint8)
    counts = np.zeros((len(planes.windows), 3), dtype=np.int64)
    for p in range(len(planes.windows)):
        window = planes.windows[p]
        for place in range(window[ROWS] * window[COLUMNS]):
            t = planes.slots[window[SLOT] + place]
            if t >= 0:
                row = window[ROW] + place // window[COLUMNS]
                _best_of_neighbours(
                    p, planes, rules, row, window[COLUMN] + place % window[COLUMNS], best
                )
                for i in range(TILE * TILE):
                    if planes.tiles[t, i] != 0:
                        counts[p, 0] += 1
                        _count(counts[p], best[i], 1)
        for c in range(rules.care_starts[p], rules.care_starts[p + 1]):
            row, column = rules.care_nodes[c, 0], rules.care_nodes[c, 1]
            _count(counts[p], best_at(p, planes, rules, row, column, ALL), -1)
            _count(counts[p], best_at(p, planes, rules, row, column, rules.care_moves[c]), 1)
    return counts


@kernel
def _count(counts: np.ndarray, steps: int, times: int) -> None:
    """Add a pair's V to the last two entries of counts, `times` times."""
    if steps == FOR_EVER:
        counts[-2] += times
    else:
        counts[-1] += times * steps


@compiled
def count_kept(planes: Planes, runs: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Among pairs of given runs, count those kept for ever, and sum the steps of the others.

    Args:
        planes: Solved, with the evader going first.
        runs, ends: From `see_runs`, shapes (m, 3), (n,).

    Returns:
        For each pursuer node the number of pairs kept for ever and the sum of the other V, shape
        (n, 2).
    """
    counts, k = np.zeros((len(ends), 2), dtype=np.int64), 0
    for p in range(len(ends)):
        while k < ends[p]:
            row = int(runs[k, 0])
            for i in range(runs[k, 1], runs[k, 2]):
                t = tile_of(planes, p, row // TILE, i // TILE)
                if t >= 0:
                    _count(counts[p], planes.tiles[t, row % TILE * TILE + i % TILE], 1)
            k += 1
    return counts


@kernel
def lay_eroded(p: int, planes: Planes, rules: Rules, buffers: np.ndarray) -> int:
    """Write the plane to be eroded, on a pursuer node's window with a rim, to the first buffer.

    It is V, or, where the evader goes first, the largest V of the neighbours.

    Args:
        p: Number of the node.
        planes, rules: Of the game.
        buffers: From `make_buffers`, shape (7, s); tiles flagged in its last row are written.

    Returns:
        Length of the plane's rows.
    """
    window, reach = planes.windows[p], len(rules.halves) // 2
    plane, best, todo = buffers[PLANE], buffers[BEST, : TILE * TILE], buffers[PLAN]
    stride = _lay_blocked(p, planes, rules, plane)
    for place in range(window[ROWS] * window[COLUMNS]):
        t = planes.slots[window[SLOT] + place]
        if todo[place] == 0 or (t < 0 and not rules.evader_first):
            continue
        row, column = place // window[COLUMNS], place % window[COLUMNS]
        _best_of_neighbours(p, planes, rules, window[ROW] + row, window[COLUMN] + column, best)
        for j in range(TILE):
            at = (reach + row * TILE + j) * stride + reach + column * TILE
            if rules.evader_first:
                raise_to(plane[at : at + TILE], best[j * TILE : (j + 1) * TILE])
            else:
                seen = planes.tiles[t, j * TILE : (j + 1) * TILE]
                put_seen(plane[at : at + TILE], best[j * TILE : (j + 1) * TILE], seen)
    _take_care(p, planes, rules, buffers, stride)
    return stride


@kernel
def _read_steps(p, planes, rules, buffers):
    """Write V of one pursuer node to the first buffer; return the length of the plane's rows."""
    if not rules.evader_first:
        return lay_eroded(p, planes, rules, buffers)
    window, reach, plane = planes.windows[p], len(rules.halves) // 2, buffers[PLANE]
    stride = _lay_blocked(p, planes, rules, plane)
    for place in range(window[ROWS] * window[COLUMNS]):
        t = planes.slots[window[SLOT] + place]
        if t >= 0:
            row, column = place // window[COLUMNS], place % window[COLUMNS]
            for j in range(TILE):
                at = (reach + row * TILE + j) * stride + reach + column * TILE
                raise_to(plane[at : at + TILE], planes.tiles[t, j * TILE : (j + 1) * TILE])
    return stride


@kernel
def _lay_blocked(p, planes, rules, plane):
    """Copy `Rules.blocked` to the window of p with a rim; return the length of its rows."""
    window, reach = planes.windows[p], len(rules.halves) // 2
    stride = window[COLUMNS] * TILE + 2 * reach
    first_row, first_column = window[ROW] * TILE, window[COLUMN] * TILE
    for j in range(window[ROWS] * TILE + 2 * reach):
        source = rules.blocked[first_row + j, first_column : first_column + stride]
        copy(plane[j * stride : (j + 1) * stride], source)
    return stride


@kernel
def _take_care(p, planes, rules, buffers, stride):
    """Correct V where some moves lose sight on the way: only the others count."""
    window, reach = planes.windows[p], len(rules.halves) // 2
    plane, todo = buffers[PLANE], buffers[PLAN]
    for c in range(rules.care_starts[p], rules.care_starts[p + 1]):
        row, column = rules.care_nodes[c, 0], rules.care_nodes[c, 1]
        place = (row // TILE - window[ROW]) * window[COLUMNS] + column // TILE - window[COLUMN]
        if todo[place] == 0:
            continue
        t = planes.slots[window[SLOT] + place]
        # A node kept for ever if the pursuer stays needs no correction: staying keeps sight.
        if planes.tiles[t, row % TILE * TILE + column % TILE] != FOR_EVER:
            at = (reach + row - window[ROW] * TILE) * stride
            at += reach + column - window[COLUMN] * TILE
            plane[at] = best_at(p, planes, rules, row, column, rules.care_moves[c])


@kernel
def _best_of_neighbours(p, planes, rules, row, column, best):
    """Elementwise maximum, in one tile of the grid, of the stored values of the places to which a
    pursuer may go from p."""
    best[:] = 0
    if not rules.evader_first:
        own = planes.tiles[tile_of(planes, p, row, column)]
        copy(best, own)
        # Often all nodes that p sees in the tile are kept for ever already if it stays.
        if not is_less_somewhere(own):
            return
    for n in range(rules.neighbour_starts[p], rules.neighbour_starts[p + 1]):
        t = tile_of(planes, rules.neighbours[n], row, column)
        if t >= 0:
            raise_to(best, planes.tiles[t])


@kernel
def erode(
    plane: np.ndarray,
    stride: int,
    halves: np.ndarray,
    out: np.ndarray,
    odd: np.ndarray,
    even: np.ndarray,
) -> None:
    """out[f] = least of plane[f + move], in a flat plane whose rows are `stride` long.

    Rows and columns within reach of the rim are not meaningful. `odd` and `even` are scratch for
    running minima along rows, whose width grows by one column on each side in turn.

    Args:
        plane: Bytes, shape (f,).
        stride: Length of its rows.
        halves: Of the moves, as of `Rules`.
        out: Written to, shape (f,).
        odd, even: See above, shape (f,).
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
                lower_to(target, minima[low + r * stride :])


@kernel
def copy(out: np.ndarray, values: np.ndarray) -> None:
    """Copy bytes.

    Args:
        out: Written to, shape (n,).
        values: Copied, shape (n,).
    """
    for i in range(len(out)):
        out[i] = values[i]


@kernel
def put_seen(out: np.ndarray, values: np.ndarray, seen: np.ndarray) -> None:
    """Copy values where something is seen; leave the other entries as they are.

    Args:
        out: Written to where something is seen; before, `Rules.blocked` is laid there, shape (n,).
        values: Copied, shape (n,).
        seen: Not 0 where something is seen, shape (n,).
    """
    for i in range(len(out)):
        out[i] = values[i] if seen[i] != 0 else out[i]


@kernel
def step_up(values: np.ndarray, others: np.ndarray, most: np.uint8) -> bool:
    """Set values to others plus one step where something is seen; return whether any changed.

    Args:
        values: Written to, shape (n,); 0 where nothing is seen [steps].
        others: Values less one step, shape (n,) [steps].
        most: The horizon: from this value on, one step more is FOR_EVER [steps].
    """
    different = np.uint8(0)
    for i in range(len(values)):
        # A value beyond the horizon counts as for ever.
        more = others[i] + np.uint8(1) if others[i] < most else np.uint8(FOR_EVER)
        more = more if values[i] != 0 else np.uint8(0)
        different |= values[i] ^ more
        values[i] = more
    return different != 0


@kernel
def is_less_somewhere(values: np.ndarray) -> bool:
    """Whether something is seen that is not kept for ever.

    Args:
        values: 0 where nothing is seen, shape (n,) [steps].
    """
    found = np.uint8(0)
    for i in range(len(values)):
        found |= np.uint8(values[i] != 0) & np.uint8(values[i] != FOR_EVER)
    return found != 0


@kernel
def raise_to(values: np.ndarray, others: np.ndarray) -> None:
    """Write the elementwise maximum of two arrays into the first.

    Args:
        values: Written to, shape (n,).
        others: Compared with, shape (n,).
    """
    for i in range(len(values)):
        values[i] = others[i] if others[i] > values[i] else values[i]


@kernel
def lower_to(values: np.ndarray, others: np.ndarray) -> None:
    """Write the elementwise minimum of two arrays into the first.

    Args:
        values: Written to, shape (n,).
        others: Compared with, shape (n,).
    """
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
