"""Values of the game of one pursuer and two evaders in whole steps, by sweeps in place.

The pursuer moves first, and both evaders know it:

    V(p, e1, e2) = 1 + max over p' of min over e1' and e2' of V(p', e1', e2')

where p sees both evaders, else 0, over the moves that keep sight of both on the way. The sweeps
begin with "for ever" and decrease to the greatest solution. The minimum W(p, e1, e2) is stored, one
byte a triple, only for those triples where neither evader's moves lead out of sight of p: elsewhere
W is zero. As V is symmetric in the evaders, the half with e2 <= e1 is enough.

The minimum over both evaders' moves is taken over one's, then over the other's. With a plane of
V(p, ., .) as a square matrix the first is a minimum of whole rows; so is the second, after the
matrix is transposed.
"""

from typing import NamedTuple

import numpy as np

from ...compiled import compiled, kernel
from .plane_steps import lower_to, raise_to
from .planes import ALL, FOR_EVER

# Side of the blocks in which matrices are transposed.
BLOCK = 32


class Triples(NamedTuple):
    """The triples in sight, and their values.

    Attributes:
        seen_starts, seen: Numbers of the evader nodes that each of n places sees, ascending; shapes
            (n + 1,), (s,).
        core_starts, core: Those of them from which no move leads out of sight, shapes (n + 1,),
            (c,).
        rank: Index in `core` of each evader node for each place, or -1, shape (n, m).
        row_starts: Where the row of each entry of the core begins in `values`, shape (c + 1,). A
            row has a column for each evader node from the core's first one to the entry's own.
        values: W, shape (v,) [steps]; zero at the columns that are not in the core.
    """

    seen_starts: np.ndarray
    seen: np.ndarray
    core_starts: np.ndarray
    core: np.ndarray
    rank: np.ndarray
    row_starts: np.ndarray
    values: np.ndarray


class Roads(NamedTuple):
    """The moves of all players.

    Attributes:
        neighbour_starts, neighbours: Nodes to which the pursuer may go from each node, that node
            included; shapes (n + 1,), (w,).
        evader_starts, evader_ways: The same for the evaders, shapes (m + 1,), (u,).
        care_starts, care_nodes, care_moves: Numbers of the evader nodes that each place sees and
            of which some of its moves may lose sight on the way, ascending, and the moves that keep
            sight, bit k standing for neighbour k; shapes (n + 1,), (c,), (c,). For all other nodes
            every move keeps sight.
        horizon: Number of steps above which a value counts as for ever, at most
            `planes.MOST_STEPS` [steps].
    """

    neighbour_starts: np.ndarray
    neighbours: np.ndarray
    evader_starts: np.ndarray
    evader_ways: np.ndarray
    care_starts: np.ndarray
    care_nodes: np.ndarray
    care_moves: np.ndarray
    horizon: int


@compiled
def lay_out_triples(
    runs: np.ndarray,
    ends: np.ndarray,
    numbers: np.ndarray,
    evader_starts: np.ndarray,
    evader_ways: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """List the nodes that each place sees, their core, and where the core's rows begin.

    Args:
        runs, ends: From `see_runs`, shapes (r, 3), (n,).
        numbers: Numbers of the evader's nodes in order of rows, shape (rows, columns).
        evader_starts, evader_ways: See `Roads`.

    Returns:
        All of `Triples` except the values.
    """
    places, nodes = len(ends), len(evader_starts) - 1
    seen_starts = np.zeros(places + 1, dtype=np.int64)
    total = 0
    for k in range(len(runs)):
        total += runs[k, 2] - runs[k, 1]
    seen = np.empty(total, dtype=np.int32)
    core = np.empty(total, dtype=np.int32)
    core_starts = np.zeros(places + 1, dtype=np.int64)
    row_starts = np.zeros(total + 1, dtype=np.int64)
    rank = np.full((places, nodes), -1, dtype=np.int32)
    in_sight = np.full(nodes, -1)
    s, c, v, k = 0, 0, 0, 0
    for p in range(places):
        while k < ends[p]:
            for i in range(runs[k, 1], runs[k, 2]):
                seen[s] = numbers[runs[k, 0], i]
                in_sight[seen[s]] = p
                s += 1
            k += 1
        seen_starts[p + 1] = s
        for j in range(seen_starts[p], s):
            e = seen[j]
            inside = True
            for w in range(evader_starts[e], evader_starts[e + 1]):
                inside = inside and in_sight[evader_ways[w]] == p
            if inside:
                core[c] = e
                rank[p, e] = c
                row_starts[c] = v
                v += e - core[core_starts[p]] + 1
                c += 1
        core_starts[p + 1] = c
    row_starts[c] = v
    return seen_starts, seen, core_starts, core[:c].copy(), rank, row_starts[: c + 1].copy()


@compiled
def begin_for_ever(core_starts: np.ndarray, core: np.ndarray, row_starts: np.ndarray) -> np.ndarray:
    """W before the first sweep, shape (v,).

    Args:
        core_starts, core, row_starts: See `Triples`.
    """
    values = np.zeros(row_starts[len(row_starts) - 1], dtype=np.uint8)
    for p in range(len(core_starts) - 1):
        for c in range(core_starts[p], core_starts[p + 1]):
            at = row_starts[c] - core[core_starts[p]]
            for j in range(core_starts[p], c + 1):
                values[at + core[j]] = FOR_EVER
    return values


@compiled
def sweep_triples(triples: Triples, roads: Roads, order: np.ndarray, due: np.ndarray) -> int:
    """Recompute the planes of the places that are due; return how many those were.

    Args:
        triples: To be lowered.
        roads: Of the game.
        order: Places, shape (n,).
        due: Which places depend on one that has changed, shape (n,), bool; updated.
    """
    room = _make_room(triples)
    count = 0
    for k in range(len(order)):
        p = order[k]
        if not due[p]:
            continue
        due[p] = False
        count += 1
        if _lower_plane(p, triples, roads, room):
            for n in range(roads.neighbour_starts[p], roads.neighbour_starts[p + 1]):
                due[roads.neighbours[n]] = True
    return count


@compiled
def worst_reply_of_two(triples: Triples, p: int, e1: int, e2: int) -> int:
    """W: least V over the evaders' replies once the pursuer is at p [steps].

    Args:
        triples: Solved.
        p: Number of the place.
        e1, e2: Numbers of the evaders' nodes before their replies.
    """
    last, other = max(e1, e2), min(e1, e2)
    c = triples.rank[p, last]
    if c < 0 or triples.rank[p, other] < 0:
        return 0
    first = triples.core[triples.core_starts[p]]
    return int(triples.values[triples.row_starts[c] + other - first])


@compiled
def steps_of_two(triples: Triples, roads: Roads, p: int) -> np.ndarray:
    """V from one place for all pairs of evader nodes that it sees, shape (s, s) [steps].

    Args:
        triples: Solved.
        roads: Of the game.
        p: Number of the place.
    """
    room = _make_room(triples)
    size = triples.seen_starts[p + 1] - triples.seen_starts[p]
    _count_steps(p, triples, roads, room)
    return room[1][0, : size * size].copy().reshape((size, size))


@compiled
def keeps_two_by_table(roads: Roads, p: int, q: int, e1: int, e2: int) -> bool:
    """Whether a pursuer's move is one of those over which V is maximised.

    Args:
        roads: Of the game.
        p, q: Numbers of the pursuer's nodes before its move and after.
        e1, e2: Numbers of the evaders' nodes, which p sees.
    """
    moves = _moves_at(p, roads, e1) & _moves_at(p, roads, e2)
    first = roads.neighbour_starts[p]
    for n in range(first, roads.neighbour_starts[p + 1]):
        if roads.neighbours[n] == q:
            return (moves >> np.uint32(n - first)) & np.uint32(1) != 0
    return False


@compiled
def count_triples(triples: Triples, roads: Roads) -> np.ndarray:
    """Numbers of pairs of evader nodes in sight of each place, and kept for ever, shape (n, 2).

    Args:
        triples: Solved.
        roads: Of the game.
    """
    room = _make_room(triples)
    counts = np.zeros((len(triples.seen_starts) - 1, 2), dtype=np.int64)
    for p in range(len(counts)):
        size = triples.seen_starts[p + 1] - triples.seen_starts[p]
        _count_steps(p, triples, roads, room)
        counts[p, 0] = size * size
        for k in range(size * size):
            counts[p, 1] += room[1][0, k] == FOR_EVER
    return counts


@compiled
def _make_room(triples):
    """Allocate scratch for a plane: rows of all nodes, matrices, nodes' indices in them, moves."""
    nodes, largest = triples.rank.shape[1], 1
    for p in range(len(triples.seen_starts) - 1):
        largest = max(largest, triples.seen_starts[p + 1] - triples.seen_starts[p])
    row = np.zeros((2, max(nodes, 1)), dtype=np.uint8)
    squares = np.zeros((3, largest * largest), dtype=np.uint8)
    local = np.zeros(nodes, dtype=np.int32)
    moves, careful = np.full(largest, ALL), np.zeros(largest, dtype=np.int32)
    return row, squares, local, moves, careful


@kernel
def _moves_at(p, roads, e):
    """The moves from p that keep sight of an evader node on the way, as bits; ALL for all."""
    low, high = roads.care_starts[p], roads.care_starts[p + 1]
    while low < high:
        middle = (low + high) // 2
        if roads.care_nodes[middle] == e:
            return roads.care_moves[middle]
        if roads.care_nodes[middle] < e:
            low = middle + 1
        else:
            high = middle
    return ALL


@kernel
def _count_steps(p, triples, roads, room):
    """Write V of one place for all pairs that it sees to the first square matrix of the scratch."""
    row, squares, local, moves, careful = room
    plane, seen = squares[0], triples.seen[triples.seen_starts[p] : triples.seen_starts[p + 1]]
    n, around = len(seen), roads.neighbour_starts[p]
    for i in range(n):
        local[seen[i]], moves[i] = i, ALL
    cares = roads.care_starts[p + 1] - roads.care_starts[p]
    for c in range(cares):
        careful[c] = local[roads.care_nodes[roads.care_starts[p] + c]]
        moves[careful[c]] = roads.care_moves[roads.care_starts[p] + c]
    for i in range(n):
        e, low = seen[i], seen[0]
        row[0, low : e + 1] = 0
        for k in range(roads.neighbour_starts[p + 1] - around):
            if not (moves[i] >> np.uint32(k)) & np.uint32(1):
                continue
            q = roads.neighbours[around + k]
            c = triples.rank[q, e]
            if c >= 0:
                first = triples.core[triples.core_starts[q]]
                begin, start = max(first, low), triples.row_starts[c] - first
                raise_to(row[0, begin : e + 1], triples.values[start + begin : start + e + 1])
        for c in range(cares):
            if careful[c] > i:
                break
            both = moves[i] & moves[careful[c]]
            row[0, seen[careful[c]]] = _best_of_moves(p, triples, roads, e, seen[careful[c]], both)
        _one_more(row[1, low : e + 1], row[0, low : e + 1], roads.horizon)
        for j in range(i + 1):
            plane[i * n + j] = row[1, seen[j]]
    for a in range(0, n, BLOCK):
        for b in range(0, a + 1, BLOCK):
            for i in range(a, min(a + BLOCK, n)):
                for j in range(b, min(b + BLOCK, i)):
                    plane[j * n + i] = plane[i * n + j]


@kernel
def _best_of_moves(p, triples, roads, e1, e2, moves):
    """Largest W of a pair of evader nodes, e2 <= e1, over some of the pursuer's moves from p."""
    best, around = np.uint8(0), roads.neighbour_starts[p]
    for k in range(roads.neighbour_starts[p + 1] - around):
        q = roads.neighbours[around + k]
        c = triples.rank[q, e1]
        if (moves >> np.uint32(k)) & np.uint32(1) and c >= 0 and triples.rank[q, e2] >= 0:
            at = triples.row_starts[c] + e2 - triples.core[triples.core_starts[q]]
            best = max(best, triples.values[at])
    return best


@kernel
def _lower_plane(p, triples, roads, room):
    """Recompute W of one place; return whether it changed."""
    row, squares, local, _, _ = room
    first = triples.core_starts[p]
    n, m = triples.seen_starts[p + 1] - triples.seen_starts[p], triples.core_starts[p + 1] - first
    if m == 0:
        return False
    plane, eroded, turned = squares[0], squares[1], squares[2]
    _count_steps(p, triples, roads, room)
    for c in range(m):
        _least_row(plane, n, n, triples.core[first + c], roads, local, eroded[c * n : c * n + n])
    for a in range(0, m, BLOCK):
        for b in range(0, n, BLOCK):
            for i in range(a, min(a + BLOCK, m)):
                for j in range(b, min(b + BLOCK, n)):
                    turned[j * m + i] = eroded[i * n + j]
    different = np.uint8(0)
    for c in range(m):
        least = row[0, : c + 1]
        _least_row(turned, m, c + 1, triples.core[first + c], roads, local, least)
        at = triples.row_starts[first + c] - triples.core[first]
        for j in range(c + 1):
            k = at + triples.core[first + j]
            different |= triples.values[k] ^ least[j]
            triples.values[k] = least[j]
    return different != 0


@kernel
def _least_row(matrix, stride, length, e, roads, local, out):
    """Elementwise minimum of the rows to which moves from node e lead, up to `length` entries."""
    out[:] = FOR_EVER
    for w in range(roads.evader_starts[e], roads.evader_starts[e + 1]):
        at = local[roads.evader_ways[w]] * stride
        lower_to(out, matrix[at : at + length])


@kernel
def _one_more(out, steps, horizon):
    """Write steps plus one; values beyond the horizon become FOR_EVER."""
    most = np.uint8(horizon)
    for i in range(len(out)):
        out[i] = steps[i] + np.uint8(1) if steps[i] < most else np.uint8(FOR_EVER)
