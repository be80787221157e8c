"""Values of the visibility game in whole steps, by sweeps over the pursuer's nodes in place.

One player says first where it will be after the step, and the other knows it. The pursuer first:

    V(p, e) = 1 + max over p' of min over e' of V(p', e')   where e is in sight of p, else 0;

or the evader first:

    V(p, e) = 1 + min over e' of max over p' of V(p', e')   where e is in sight of p, else 0.

The sweeps begin with "for ever" and come down to the greatest solution. What is kept where the
pursuer goes first is S(p, e) = 1 + min over e' of V(p, e') where e is in sight of p, else 0: one
byte a pair, which tells at the same time who is in sight. V is then the largest S of a node's
neighbours, and S an erosion of V by the evader's moves. Where the evader goes first V itself is
kept, and is an erosion of the largest V of the neighbours, in sight or not.

Planes are kept in square tiles, and only those in which something is in sight. A maximum over tiles
takes one instruction for 32 pairs, and a map of many rooms costs no more than what is seen in it. A
tile is computed anew only when V has changed in it or beside it.
"""

from typing import NamedTuple

import numpy as np

from ...compiled import compiled, kernel

# Kept for ever, or to the horizon; also nodes where no evader can be.
FOR_EVER = 255

# As far as steps are counted.
MOST_STEPS = 254

# Side of a tile [nodes]. Sight ends in the middle of tiles: larger ones would be half empty.
TILE = 16

# Columns of `Planes.windows`.
ROW, COLUMN, ROWS, COLUMNS, SLOT = range(5)

# Rows of `make_buffers`: V; the best of a tile's neighbours, and what is fresh; V in a strip of
# tiles and the same eroded, with room for two running minima; what is to be done with each place
# of a window: V alone, or S as well.
PLANE, BEST, STRIP, ERODED, ODD, EVEN, PLAN = range(7)
NEEDED, DUE = 1, 2

# All moves of a pursuer, as bits of `Rules.care_moves`.
ALL = np.uint32(0xFFFFFFFF)


class Planes(NamedTuple):
    """The pairs in sight, and what they are worth.

    Attributes:
        windows: For each of n pursuer nodes the first row and column of its tiles, how many rows
            and columns of them, and where its slots begin; shape (n, 5).
        slots: Number of the tile at each place of a window, or -1 where nothing is in sight,
            shape (s,).
        tiles: S, or V where the evader goes first, shape (k, TILE * TILE) [steps].
    """

    windows: np.ndarray
    slots: np.ndarray
    tiles: np.ndarray


class Rules(NamedTuple):
    """Who may go where.

    Attributes:
        blocked: FOR_EVER where no evader can be, else 0; the evader's grid, filled up to whole
            tiles, with a rim as wide as its moves reach; shape (rows, columns).
        halves: Of the evader's moves, see `Moves`.
        neighbour_starts, neighbours: Where a pursuer may go from each node: itself, and others;
            shapes (n + 1,), (w,).
        beside_walls: Evader nodes from which a wall blocks moves, tile by tile: row, column, and
            the first of the moves that are left and the first no more; shape (b, 4).
        wall_starts: Where the nodes of each tile of the grid begin in that, row by row, shape
            (tiles + 1,).
        moves_left: Those moves, rows and columns, shape (m, 2).
        care_starts, care_nodes, care_moves: Evader nodes from which some moves of a pursuer's node
            may lose sight on the way: where they begin for each, shape (n + 1,); row and column,
            by rows, shape (c, 2); the moves that keep sight, the k-th neighbour by the k-th bit,
            shape (c,). To stay always keeps it.
        horizon: What lasts longer counts as for ever, at most MOST_STEPS [steps].
        evader_first: Whether the evader says first where it goes.
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


class Agenda(NamedTuple):
    """What has to be computed; make one with `full_agenda`.

    Attributes:
        due: Which planes depend on one that has changed, shape (n,), bool.
        computed, lowered: When each plane was computed last, and changed, shape (n,).
        changed: When each tile changed last, shape (k,).
        clock: How many planes have been computed, shape (1,).
    """

    due: np.ndarray
    computed: np.ndarray
    lowered: np.ndarray
    changed: np.ndarray
    clock: np.ndarray


def full_agenda(planes: Planes) -> Agenda:
    """Everything has to be computed.

    Args:
        planes: To be lowered.
    """
    n, k = len(planes.windows), len(planes.tiles)
    computed, lowered, changed, clock = (np.zeros(size, dtype=np.uint32) for size in (n, n, k, 1))
    return Agenda(np.ones(n, dtype=bool), computed, lowered, changed, clock)


@compiled
def sweep(planes: Planes, rules: Rules, order: np.ndarray, agenda: Agenda) -> int:
    """Compute the planes that are due once more, in an order; return how many that were.

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
        _copy(steps[j], rules.blocked[reach + j, reach : reach + columns])
    window = planes.windows[p]
    if window[ROWS] > 0:
        todo = buffers[PLAN]
        todo[: window[ROWS] * window[COLUMNS]] = NEEDED
        stride, plane = _read_steps(p, planes, rules, buffers), buffers[PLANE]
        first = window[COLUMN] * TILE
        for j in range(window[ROWS] * TILE):
            at = (reach + j) * stride + reach
            row = steps[window[ROW] * TILE + j, first : first + window[COLUMNS] * TILE]
            _copy(row, plane[at : at + len(row)])


@compiled
def count_pairs(planes: Planes, rules: Rules) -> np.ndarray:
    """Evader nodes that each pursuer node keeps, those kept for ever, and the steps of the others.

    Args:
        planes: Solved, the pursuer going first; else see `count_kept`.
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
            _count(counts[p], _best_at(p, planes, rules, row, column, ALL), -1)
            _count(counts[p], _best_at(p, planes, rules, row, column, rules.care_moves[c]), 1)
    return counts


@kernel
def _count(counts: np.ndarray, steps: int, times: int) -> None:
    """Count a pair's V, in the last two of counts."""
    if steps == FOR_EVER:
        counts[-2] += times
    else:
        counts[-1] += times * steps


@compiled
def count_kept(planes: Planes, runs: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Pairs of given runs that are kept for ever, and the steps of the others.

    Args:
        planes: Solved, the evader going first.
        runs, ends: As `see_runs` has them, shapes (m, 3), (n,).

    Returns:
        For each pursuer node the number of pairs and the sum of V, shape (n, 2).
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


@compiled
def worst_reply(planes: Planes, p: int, row: int, column: int) -> int:
    """What the evader's best reply leaves once the pursuer is at p: least V over its moves [steps].

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
    """Whether a pursuer's move is one of those over which V of a pair is the maximum.

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
    """The most that is left to a pursuer's replies once the evader is at a node [steps].

    Args:
        planes: Solved, the evader going first.
        rules: Of the game.
        p: Number of the pursuer's node before its move.
        row, column: Of the evader's node after its own.
    """
    return _best_at(p, planes, rules, row, column, ALL)


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
    return _best_at(p, planes, rules, row, column, _moves_at(p, rules, row, column))


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
def _best_at(p, planes, rules, row, column, moves):
    """The most that is kept at one evader node over some moves of the pursuer from p."""
    at = row % TILE * TILE + column % TILE
    first, most = rules.neighbour_starts[p], 0
    for n in range(first, rules.neighbour_starts[p + 1]):
        if moves == ALL or (moves >> np.uint32(n - first)) & np.uint32(1):
            t = tile_of(planes, rules.neighbours[n], row // TILE, column // TILE)
            if t >= 0:
                most = max(most, int(planes.tiles[t, at]))
    return most


@compiled
def make_buffers(planes: Planes, rules: Rules) -> np.ndarray:
    """Room for all that is known of a pursuer node at a time.

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


@kernel
def _lower_plane(p, planes, rules, agenda, buffers):
    """Compute what is kept of one pursuer node anew where it may change; whether it did."""
    window, reach = planes.windows[p], len(rules.halves) // 2
    if window[ROWS] == 0 or not _plan(p, planes, rules, agenda, buffers):
        return False
    agenda.clock[0] += 1
    now = agenda.clock[0]
    agenda.computed[p] = now
    stride = _count_steps(p, planes, rules, buffers)
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
                _copy(strip[j * width : (j + 1) * width], plane[at : at + width])
            _erode(strip, width, rules.halves, eroded, buffers[ODD, :size], buffers[EVEN, :size])
            for c in range(first, column):
                t = planes.slots[window[SLOT] + row * window[COLUMNS] + c]
                start = reach * width + reach + (c - first) * TILE
                at_row, at_column = window[ROW] + row, window[COLUMN] + c
                _mind_walls(strip, eroded, start, width, at_row, at_column, planes.tiles[t], rules)
                different = False
                for j in range(TILE):
                    values = planes.tiles[t, j * TILE : (j + 1) * TILE]
                    at = start + j * width
                    different |= _replace(values, eroded[at : at + TILE], horizon)
                if different:
                    agenda.changed[t] = now
                    changed = True
    if changed:
        agenda.lowered[p] = now
    return changed


@kernel
def _plan(p, planes, rules, agenda, buffers):
    """Flag the tiles in which V may have changed, or beside one; whether there are any."""
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
                    # An evader that goes first may go out of sight.
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
    """Raise what is to be done at flagged places and the eight round each."""
    for r in range(rows):
        for c in range(columns):
            if flagged[r * columns + c]:
                for i in range(max(r - 1, 0), min(r + 2, rows)):
                    for k in range(max(c - 1, 0), min(c + 2, columns)):
                        todo[i * columns + k] = max(todo[i * columns + k], what)


@kernel
def _count_steps(p, planes, rules, buffers):
    """What is eroded, on the window of a pursuer node and a rim, into the first buffer: V, or where
    the evader goes first the largest V of the neighbours; length of its rows."""
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
                _raise_to(plane[at : at + TILE], best[j * TILE : (j + 1) * TILE])
            else:
                seen = planes.tiles[t, j * TILE : (j + 1) * TILE]
                _put_seen(plane[at : at + TILE], best[j * TILE : (j + 1) * TILE], seen)
    _take_care(p, planes, rules, buffers, stride)
    return stride


@kernel
def _read_steps(p, planes, rules, buffers):
    """V of one pursuer node, as `_count_steps` writes it where the pursuer goes first."""
    if not rules.evader_first:
        return _count_steps(p, planes, rules, buffers)
    window, reach, plane = planes.windows[p], len(rules.halves) // 2, buffers[PLANE]
    stride = _lay_blocked(p, planes, rules, plane)
    for place in range(window[ROWS] * window[COLUMNS]):
        t = planes.slots[window[SLOT] + place]
        if t >= 0:
            row, column = place // window[COLUMNS], place % window[COLUMNS]
            for j in range(TILE):
                at = (reach + row * TILE + j) * stride + reach + column * TILE
                _raise_to(plane[at : at + TILE], planes.tiles[t, j * TILE : (j + 1) * TILE])
    return stride


@kernel
def _lay_blocked(p, planes, rules, plane):
    """Lay `Rules.blocked` on the window of p and a rim; length of its rows."""
    window, reach = planes.windows[p], len(rules.halves) // 2
    stride = window[COLUMNS] * TILE + 2 * reach
    first_row, first_column = window[ROW] * TILE, window[COLUMN] * TILE
    for j in range(window[ROWS] * TILE + 2 * reach):
        source = rules.blocked[first_row + j, first_column : first_column + stride]
        _copy(plane[j * stride : (j + 1) * stride], source)
    return stride


@kernel
def _take_care(p, planes, rules, buffers, stride):
    """V over the moves that keep sight on the way, where some do not."""
    window, reach = planes.windows[p], len(rules.halves) // 2
    plane, todo = buffers[PLANE], buffers[PLAN]
    for c in range(rules.care_starts[p], rules.care_starts[p + 1]):
        row, column = rules.care_nodes[c, 0], rules.care_nodes[c, 1]
        place = (row // TILE - window[ROW]) * window[COLUMNS] + column // TILE - window[COLUMN]
        if todo[place] == 0:
            continue
        t = planes.slots[window[SLOT] + place]
        # What is kept for ever if the pursuer stays is so already.
        if planes.tiles[t, row % TILE * TILE + column % TILE] != FOR_EVER:
            at = (reach + row - window[ROW] * TILE) * stride
            at += reach + column - window[COLUMN] * TILE
            plane[at] = _best_at(p, planes, rules, row, column, rules.care_moves[c])


@kernel
def _best_of_neighbours(p, planes, rules, row, column, best):
    """The most that is kept at the places where a pursuer may go from p, in one tile of the
    grid."""
    best[:] = 0
    if not rules.evader_first:
        own = planes.tiles[tile_of(planes, p, row, column)]
        _copy(best, own)
        # Often all that p sees there is kept for ever already if it stays.
        if not _is_less_somewhere(own):
            return
    for n in range(rules.neighbour_starts[p], rules.neighbour_starts[p + 1]):
        t = tile_of(planes, rules.neighbours[n], row, column)
        if t >= 0:
            _raise_to(best, planes.tiles[t])


@kernel
def _mind_walls(strip, eroded, start, width, row, column, tile, rules):
    """Least value over the moves that are left, beside walls that block some, in one tile."""
    reach = len(rules.halves) // 2
    whole = row * ((rules.blocked.shape[1] - 2 * reach) // TILE) + column
    for b in range(rules.wall_starts[whole], rules.wall_starts[whole + 1]):
        beside = rules.beside_walls[b]
        j, i = beside[0] - row * TILE, beside[1] - column * TILE
        known, at = tile[j * TILE + i], start + j * width + i
        # With fewer moves it is worth more than eroded, and never more than it was.
        if known == 0 or eroded[at] == FOR_EVER or eroded[at] + 1 == known:
            continue
        least = strip[at]
        for k in range(beside[2], beside[3]):
            value = strip[at + rules.moves_left[k, 0] * width + rules.moves_left[k, 1]]
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
def _put_seen(out, values, seen):
    """Copy where something is seen; where nothing can be, for ever, or nothing is seen, 0."""
    for i in range(len(out)):
        out[i] = values[i] if seen[i] != 0 else out[i]


@kernel
def _replace(values, others, most):
    """A step more than the others where something is seen; whether anything was different."""
    different = np.uint8(0)
    for i in range(len(values)):
        # What would pass the horizon is for ever.
        more = others[i] + np.uint8(1) if others[i] < most else np.uint8(FOR_EVER)
        more = more if values[i] != 0 else np.uint8(0)
        different |= values[i] ^ more
        values[i] = more
    return different != 0


@kernel
def _is_less_somewhere(values):
    """Whether something is seen that is not kept for ever."""
    found = np.uint8(0)
    for i in range(len(values)):
        found |= np.uint8(values[i] != 0) & np.uint8(values[i] != FOR_EVER)
    return found != 0


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
