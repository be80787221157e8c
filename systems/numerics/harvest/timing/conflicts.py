"""Where two machines would be too near each other, for every pair of cells of their paths.

Cells i of one path and j of another are in conflict if what the machines cover on them may be
nearer than the gap: if their polygons are nearer than the gap plus the margins of both sweeps. So
two machines whose cells are not in conflict are never nearer than the gap, wherever on their cells
they are.

Discs round runs of cells of both paths rule most pairs out, then discs round cells and polygons;
polygons are compared only where these leave a doubt.
"""

from typing import NamedTuple

import numpy as np

from ...compiled import compiled, kernel
from ...errors import require_non_negative
from .sweep import Sweep

# Distance between outlines that plans keep [m].
GAP = 0.5

# Number of consecutive cells that are looked at together first.
RUN = 32


class CellIntervals(NamedTuple):
    """Cells of another machine that are in conflict with each cell of a machine.

    Attributes:
        rows: Index of the first interval of each cell, then their total number, shape (n + 1,).
        begins: First cell of each interval; within a row they increase and do not touch,
            shape (k,).
        ends: One after its last cell, shape (k,).
        encounters: Number of the encounter that each interval belongs to, shape (k,).
    """

    rows: np.ndarray
    begins: np.ndarray
    ends: np.ndarray
    encounters: np.ndarray


class ConflictSet(NamedTuple):
    """Conflicts of two machines, a and b, and the encounters they are parts of.

    An encounter is a connected part of the set in the plane of cells (i, j); cells that touch at a
    corner are connected. Machines only drive on, one cell at a time, so that i and j never
    decrease. Such a way through the plane cannot cross an encounter, but passes all of it on one
    side. So one of the two machines goes first at the whole encounter.

    Attributes:
        of_a: For each cell of a the cells of b.
        of_b: For each cell of b the cells of a.
        parts: Number of encounters.
    """

    of_a: CellIntervals
    of_b: CellIntervals
    parts: int


def find_conflicts(a: Sweep, b: Sweep, gap: float = GAP) -> ConflictSet:
    """All pairs of cells on which two machines may come nearer than a gap.

    Args:
        a: What one covers.
        b: What the other covers.
        gap: Distance that they keep [m].

    Raises:
        InvalidInput: The gap is negative.
    """
    require_non_negative("gap", gap)
    rows, begins, ends = _near_cells(a, b, gap)
    return conflict_set(rows, begins, ends, b.cells)


def conflict_set(rows: np.ndarray, begins: np.ndarray, ends: np.ndarray, cells: int) -> ConflictSet:
    """Conflicts and their encounters, from the intervals of each cell of the first machine.

    Args:
        rows, begins, ends: As in `CellIntervals`, shapes (n + 1,), (k,), (k,).
        cells: Of the second machine.
    """
    encounters, count = _encounters(rows, begins, ends)
    transposed = _transposed(rows, begins, ends, encounters, cells)
    of_a = CellIntervals(rows, begins, ends, encounters)
    return ConflictSet(of_a, CellIntervals(*transposed), int(count))


@compiled
def _near_cells(a, b, gap):
    runs_of_a, runs_of_b = run_discs(a), run_discs(b)
    near = np.empty(len(runs_of_b), dtype=np.int64)
    found = 0
    count = 0
    rows = np.zeros(len(a.discs) + 1, dtype=np.int64)
    begins = np.empty(len(a.discs) + 16, dtype=np.int64)
    ends = np.empty(len(a.discs) + 16, dtype=np.int64)
    for i in range(len(a.discs)):
        if i % RUN == 0:
            found = near_runs(runs_of_a[i // RUN], runs_of_b, 0, len(runs_of_b), gap, near)
        before = -2
        for r in near[:found]:
            for j in range(r * RUN, min((r + 1) * RUN, len(b.discs))):
                if not cells_are_near(a, b, i, j, gap):
                    continue
                if before == j - 1:
                    ends[count - 1] = j + 1
                else:
                    if count == len(begins):
                        begins = np.concatenate((begins, np.empty_like(begins)))
                        ends = np.concatenate((ends, np.empty_like(ends)))
                    begins[count], ends[count] = j, j + 1
                    count += 1
                before = j
        rows[i + 1] = count
    return rows, begins[:count].copy(), ends[:count].copy()


@compiled
def run_discs(sweep):
    """Discs round all that a machine covers on RUN cells each, margins included, shape (r, 3)."""
    cells = len(sweep.discs)
    runs = np.empty((-(-cells // RUN), 3))
    for r in range(len(runs)):
        own = sweep.discs[r * RUN : (r + 1) * RUN]
        x, y = own[:, 0].mean(), own[:, 1].mean()
        runs[r, 0], runs[r, 1], runs[r, 2] = x, y, 0.0
        for k in range(len(own)):
            beyond = own[k, 2] + sweep.margins[r * RUN + k]
            runs[r, 2] = max(runs[r, 2], np.hypot(own[k, 0] - x, own[k, 1] - y) + beyond)
    return runs


@kernel
def near_runs(disc, runs, first, behind, gap, near):
    """Write the numbers of runs that are nearer than a gap to a disc, rising; return how many.

    Args:
        disc: x, y and radius [m].
        runs: From `run_discs`, shape (r, 3) [m].
        first, behind: The first run that counts, and one after the last.
        gap: [m].
        near: Written, shape (at least r,).
    """
    count = 0
    for run in range(first, behind):
        if discs_are_near(disc, runs[run], gap):
            near[count] = run
            count += 1
    return count


@kernel
def discs_are_near(one, other, gap):
    """Whether two discs are nearer than a gap.

    Args:
        one, other: x, y and radius of each [m].
        gap: [m].
    """
    return np.hypot(one[0] - other[0], one[1] - other[1]) < one[2] + other[2] + gap


@kernel
def cells_are_near(a, b, i, j, gap):
    """Whether what two machines cover on a cell of each may be nearer than a gap.

    Args:
        a, b: Their sweeps.
        i, j: Numbers of the cells.
        gap: Between them [m].
    """
    distance = gap + a.margins[i] + b.margins[j]
    off = np.hypot(a.discs[i, 0] - b.discs[j, 0], a.discs[i, 1] - b.discs[j, 1])
    if off >= a.discs[i, 2] + b.discs[j, 2] + distance:
        return False
    for p in range(i * a.parts, (i + 1) * a.parts):
        for q in range(j * b.parts, (j + 1) * b.parts):
            off = np.hypot(
                a.polygon_discs[p, 0] - b.polygon_discs[q, 0],
                a.polygon_discs[p, 1] - b.polygon_discs[q, 1],
            )
            if off < a.polygon_discs[p, 2] + b.polygon_discs[q, 2] + distance and _are_near(
                a.points[a.starts[p] : a.starts[p + 1]],
                b.points[b.starts[q] : b.starts[q + 1]],
                distance,
            ):
                return True
    return False


@kernel
def _are_near(one, other, distance):
    """Whether two convex polygons, counterclockwise, are nearer than a distance.

    In most cases all of the other polygon lies beyond the line of some edge by the distance, which
    settles it. If it lies beyond no edge they overlap. Otherwise the nearest points are a corner
    and a point of an edge.
    """
    apart = max(
        _gap_beyond_edges(one, other, distance),
        _gap_beyond_edges(other, one, distance),
    )
    if apart >= distance:
        return False
    if apart <= 0:
        return distance > 0 or apart < 0
    return _corner_is_near(one, other, distance) or _corner_is_near(other, one, distance)


@kernel
def _gap_beyond_edges(one, other, enough):
    """Largest distance by which all of the other polygon lies beyond the line of an edge."""
    largest = -np.inf
    for p in range(len(one)):
        ax, ay = one[p, 0], one[p, 1]
        after = p + 1 if p + 1 < len(one) else 0
        ex, ey = one[after, 0] - ax, one[after, 1] - ay
        length = np.hypot(ex, ey)
        if length == 0:
            continue
        nx, ny = ey / length, -ex / length
        least = np.inf
        for q in range(len(other)):
            least = min(least, nx * (other[q, 0] - ax) + ny * (other[q, 1] - ay))
            if least <= largest:
                break
        largest = max(largest, least)
        if largest >= enough:
            break
    return largest


@kernel
def _corner_is_near(one, other, distance):
    square = distance * distance
    for q in range(len(other)):
        x, y = other[q, 0], other[q, 1]
        for p in range(len(one)):
            ax, ay = one[p, 0], one[p, 1]
            after = p + 1 if p + 1 < len(one) else 0
            ex, ey = one[after, 0] - ax, one[after, 1] - ay
            length = ex * ex + ey * ey
            share = 0.0
            if length > 0:
                share = min(1.0, max(0.0, ((x - ax) * ex + (y - ay) * ey) / length))
            dx, dy = ax + share * ex - x, ay + share * ey - y
            if dx * dx + dy * dy < square:
                return True
    return False


@compiled
def _encounters(rows, begins, ends):
    """Number of the encounter of each interval, in the order of first cells; how many there are."""
    parent = np.arange(len(begins))
    for i in range(1, len(rows) - 1):
        above, here = rows[i - 1], rows[i]
        while above < rows[i] and here < rows[i + 1]:
            # Cells that touch at a corner are connected, hence <= of an end and a begin.
            if begins[above] <= ends[here] and begins[here] <= ends[above]:
                p, q = _root(parent, above), _root(parent, here)
                parent[max(p, q)] = min(p, q)
            if ends[above] < ends[here]:
                above += 1
            else:
                here += 1
    numbers = np.empty(len(begins), dtype=np.int64)
    count = 0
    for k in range(len(begins)):
        root = _root(parent, k)
        if root == k:
            numbers[k] = count
            count += 1
        else:
            numbers[k] = numbers[root]
    return numbers, count


@kernel
def _root(parent, k):
    while parent[k] != k:
        parent[k] = parent[parent[k]]
        k = parent[k]
    return k


@compiled
def _transposed(rows, begins, ends, encounters, cells):
    """The same conflicts as intervals for each cell of the other machine."""
    count = np.zeros(cells, dtype=np.int64)
    last = np.full(cells, -2)
    for i in range(len(rows) - 1):
        for k in range(rows[i], rows[i + 1]):
            for j in range(begins[k], ends[k]):
                if last[j] != i - 1:
                    count[j] += 1
                last[j] = i
    turned = np.zeros(cells + 1, dtype=np.int64)
    turned[1:] = np.cumsum(count)
    at = turned[:-1] - 1
    last[:] = -2
    first = np.empty(turned[-1], dtype=np.int64)
    after = np.empty(turned[-1], dtype=np.int64)
    number = np.empty(turned[-1], dtype=np.int64)
    for i in range(len(rows) - 1):
        for k in range(rows[i], rows[i + 1]):
            for j in range(begins[k], ends[k]):
                if last[j] != i - 1:
                    at[j] += 1
                    first[at[j]] = i
                    number[at[j]] = encounters[k]
                after[at[j]] = i + 1
                last[j] = i
    return turned, first, after, number
