"""Values of the visibility game in whole steps, by sweeps over the pursuer's nodes in place.

One player commits first to its position after the step, and the other knows it. If the pursuer is
first:

    V(p, e) = 1 + max over p' of min over e' of V(p', e')   where e is in sight of p, else 0;

if the evader is first:

    V(p, e) = 1 + min over e' of max over p' of V(p', e')   where e is in sight of p, else 0.

The sweeps begin with "for ever" and decrease to the greatest solution. If the pursuer is first,
S(p, e) = 1 + min over e' of V(p, e') where e is in sight of p, else 0, is stored: one byte a pair,
which also says whether it is in sight. V is then the largest S of a node's neighbours, and S an
erosion of V by the evader's moves. If the evader is first V itself is stored. It is an erosion of
the largest V of the neighbours, in sight or not.

A tile is recomputed only when V has changed in it or beside it.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ...compiled import compiled, kernel
from .plane_steps import (
    BEST,
    DUE,
    ERODED,
    EVEN,
    NEEDED,
    ODD,
    PLAN,
    PLANE,
    STRIP,
    copy,
    erode,
    lay_eroded,
    make_buffers,
    step_up,
)
from .planes import COLUMN, COLUMNS, FOR_EVER, ROW, ROWS, SLOT, TILE, Planes, Rules


class Agenda(NamedTuple):
    """What has to be computed; make one with `full_agenda`. Times are values of `clock`.

    Attributes:
        due: Which planes depend on one that has changed, shape (n,), bool.
        computed, lowered: Times of the last computation and last change of each plane, shape (n,).
        changed: Time at which each tile last changed, shape (k,).
        clock: Number of planes computed so far, shape (1,).
    """

    due: np.ndarray
    computed: np.ndarray
    lowered: np.ndarray
    changed: np.ndarray
    clock: np.ndarray


def full_agenda(planes: Planes) -> Agenda:
    """Make an agenda in which everything has to be computed.

    Args:
        planes: To be lowered.
    """
    n, k = len(planes.windows), len(planes.tiles)
    computed, lowered, changed, clock = (np.zeros(size, dtype=np.uint32) for size in (n, n, k, 1))
    return Agenda(np.ones(n, dtype=bool), computed, lowered, changed, clock)


@compiled
def sweep(planes: Planes, rules: Rules, order: np.ndarray, agenda: Agenda) -> int:
    """Recompute the planes that are due, in a given order; return how many those were.

    Args:
        planes: To be lowered.
        rules: Of the game.
        order: Pursuer nodes, shape (n,).
        agenda: What is due; kept up to date.
    """
    buffers = make_buffers(planes, rules)
    count = 0
    for k in range(len(order)):
        p = order[k]
        if not agenda.due[p]:
            continue
        agenda.due[p] = False
        count += 1
        if _lower_plane(p, planes, rules, agenda, buffers):
            for n in range(rules.neighbour_starts[p], rules.neighbour_starts[p + 1]):
                agenda.due[rules.neighbours[n]] = True
    return count


@kernel
def _lower_plane(p, planes, rules, agenda, buffers):
    """Recompute the stored tiles of one pursuer node that may change; return whether any did."""
    window, reach = planes.windows[p], len(rules.halves) // 2
    if window[ROWS] == 0 or not _plan(p, planes, rules, agenda, buffers):
        return False
    agenda.clock[0] += 1
    now = agenda.clock[0]
    agenda.computed[p] = now
    stride = lay_eroded(p, planes, rules, buffers)
    plane, todo, horizon = buffers[PLANE], buffers[PLAN], np.uint8(rules.horizon)
    changed = False
    for row in range(window[ROWS]):
        column = 0
        while column < window[COLUMNS]:
            if todo[row * window[COLUMNS] + column] != DUE:
                column += 1
                continue
            first = column
            while column < window[COLUMNS] and todo[row * window[COLUMNS] + column] == DUE:
                column += 1
            width = (column - first) * TILE + 2 * reach
            size = width * (TILE + 2 * reach)
            strip, eroded = buffers[STRIP, :size], buffers[ERODED, :size]
            for j in range(TILE + 2 * reach):
                at = (row * TILE + j) * stride + first * TILE
                copy(strip[j * width : (j + 1) * width], plane[at : at + width])
            erode(strip, width, rules.halves, eroded, buffers[ODD, :size], buffers[EVEN, :size])
            for c in range(first, column):
                t = planes.slots[window[SLOT] + row * window[COLUMNS] + c]
                start = reach * width + reach + (c - first) * TILE
                at_row, at_column = window[ROW] + row, window[COLUMN] + c
                _mind_walls(strip, eroded, start, width, at_row, at_column, planes.tiles[t], rules)
                different = False
                for j in range(TILE):
                    values = planes.tiles[t, j * TILE : (j + 1) * TILE]
                    at = start + j * width
                    different |= step_up(values, eroded[at : at + TILE], horizon)
                if different:
                    agenda.changed[t] = now
                    changed = True
    if changed:
        agenda.lowered[p] = now
    return changed


@kernel
def _plan(p, planes, rules, agenda, buffers):
    """Flag tiles in which V may have changed, and those beside them; return whether any is due."""
    window, since = planes.windows[p], agenda.computed[p]
    rows, columns = window[ROWS], window[COLUMNS]
    fresh, todo = buffers[BEST], buffers[PLAN]
    todo[: rows * columns] = 0
    fresh[: rows * columns] = 0
    found = False
    for n in range(rules.neighbour_starts[p], rules.neighbour_starts[p + 1]):
        q = rules.neighbours[n]
        if agenda.lowered[q] < since:
            continue
        other = planes.windows[q]
        for r in range(
            max(window[ROW], other[ROW]), min(window[ROW] + rows, other[ROW] + other[ROWS])
        ):
            for c in range(
                max(window[COLUMN], other[COLUMN]),
                min(window[COLUMN] + columns, other[COLUMN] + other[COLUMNS]),
            ):
                t = planes.slots[
                    other[SLOT] + (r - other[ROW]) * other[COLUMNS] + c - other[COLUMN]
                ]
                if t >= 0 and agenda.changed[t] >= since:
                    place = (r - window[ROW]) * columns + c - window[COLUMN]
                    # An evader that commits first may go out of sight.
                    if rules.evader_first or planes.slots[window[SLOT] + place] >= 0:
                        fresh[place] = 1
                        found = True
    if not found:
        return False
    _spread(fresh, todo, rows, columns, DUE)
    found = False
    for place in range(rows * columns):
        if planes.slots[window[SLOT] + place] < 0:
            todo[place] = 0
        fresh[place] = todo[place] == DUE
        found |= todo[place] == DUE
    _spread(fresh, todo, rows, columns, NEEDED)
    return found


@kernel
def _spread(flagged, todo, rows, columns, what):
    """Raise `todo` to `what` at flagged places and their eight neighbours."""
    for r in range(rows):
        for c in range(columns):
            if flagged[r * columns + c]:
                for i in range(max(r - 1, 0), min(r + 2, rows)):
                    for k in range(max(c - 1, 0), min(c + 2, columns)):
                        todo[i * columns + k] = max(todo[i * columns + k], what)


@kernel
def _mind_walls(strip, eroded, start, width, row, column, tile, rules):
    """In one tile, replace the erosion beside walls by the least value over unblocked moves."""
    reach = len(rules.halves) // 2
    whole = row * ((rules.blocked.shape[1] - 2 * reach) // TILE) + column
    for b in range(rules.wall_starts[whole], rules.wall_starts[whole + 1]):
        beside = rules.beside_walls[b]
        j, i = beside[0] - row * TILE, beside[1] - column * TILE
        known, at = tile[j * TILE + i], start + j * width + i
        # With fewer moves the value is at least the eroded one, and at most the old one.
        if known == 0 or eroded[at] == FOR_EVER or eroded[at] + 1 == known:
            continue
        least = strip[at]
        for k in range(beside[2], beside[3]):
            value = strip[at + rules.moves_left[k, 0] * width + rules.moves_left[k, 1]]
            least = value if value < least else least
        eroded[at] = least


def settle(
    nodes: tuple[np.ndarray, ...],
    due: np.ndarray,
    compute: Callable[[np.ndarray], int],
    progress: Callable[[float], None] | None,
) -> int:
    """Sweep by rows and columns, back and forth, until nothing is due; count planes computed.

    Args:
        nodes: Rows and columns of the pursuer's nodes, shape (n,) each.
        due: Which planes have to be computed, shape (n,), bool; updated by `compute`.
        compute: Given an order of the nodes, shape (n,), computes what is due and counts it.
        progress: Called now and then with the fraction of the planes that are settled.
    """
    rows, columns = nodes
    by_rows, by_columns = np.lexsort((columns, rows)), np.lexsort((rows, columns))
    updates = 0
    while True:
        for order in (by_rows, by_rows[::-1].copy(), by_columns, by_columns[::-1].copy()):
            if not due.any():
                return updates
            updates += compute(order)
            if progress is not None:
                progress(1.0 - float(due.mean()))
