"""How far an evader is from where it would be lost some day.

All places from which an evader is kept for ever are worth the same. The distance from the nearest
one where it is not tells them apart: straight, across obstacles too, since a pursuer sees the other
side of a thin one neither.

Of each plane the distance along columns comes first, from rows above and below in turn, then the
least of d^2 + (that distance)^2 over the offsets d along the row.
"""

import numpy as np

from ...compiled import compiled, kernel
from .sweeps import (
    COLUMN,
    COLUMNS,
    FOR_EVER,
    ROW,
    ROWS,
    SLOT,
    TILE,
    Planes,
    Rules,
    make_buffers,
    write_steps,
)

# As far as distances are told [cells].
FARTHEST = 255


@compiled
def distances_to_losing(planes: Planes, rules: Rules) -> np.ndarray:
    """From each pursuer node, how far each node in sight is from one where the evader gets lost.

    Args:
        planes: Solved.
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
            # What is kept for ever is all that matters.
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
    """Largest square so far, of the nodes of a row that are in sight for ever."""
    most = 0
    for c in range(last - first):
        t = tiles[c // TILE]
        kept = t >= 0 and steps[first + c] == FOR_EVER and squares[first + c] > most
        if kept and planes.tiles[t, row % TILE * TILE + c % TILE] != 0:
            most = squares[first + c]
    return most


@kernel
def _write_roots(planes, tiles, row, first, last, least, distances):
    """Distances of the nodes of a row that are in sight."""
    for c in range(last - first):
        t, at = tiles[c // TILE], row % TILE * TILE + c % TILE
        if t >= 0 and planes.tiles[t, at] != 0:
            distances[t, at] = min(int(np.sqrt(float(least[first + c]))), FARTHEST)


# One loop each, over arrays that do not overlap: so they become vector instructions.


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
