"""Dead ends of two machines: states from which one of them never arrives, whatever they do.

For two machines alone, all that matters is how far each has come. From the ends backwards a state
is a dead end if the two are in conflict in it, or if neither may drive on to one that is none: all
of them are found, exactly. Machines that keep out of the dead ends of every pair may still block
one another in a ring of three or more.
"""

from typing import NamedTuple

import numpy as np

from ...compiled import compiled, kernel
from .rule import Meetings, Rule


class DeadEnds(NamedTuple):
    """Dead ends of all pairs of machines, by progress.

    Attributes:
        rows_at: Where the rows of machines a < b begin, one for each progress of a from 0 to its
            number of cells, shape (N, N).
        rows: Where the intervals of each row begin; that of the next row is their end, shape (r,).
        begins, ends: First progress of b in each interval, and first one behind it, shape (k,).
    """

    rows_at: np.ndarray
    rows: np.ndarray
    begins: np.ndarray
    ends: np.ndarray


def find_dead_ends(meetings: Meetings, rule: Rule) -> DeadEnds:
    """Dead ends of all pairs.

    Args:
        meetings: Conflicts.
        rule: Crop precedence; orders are not asked.
    """
    count = len(meetings.cells)
    rows_at = np.zeros((count, count), dtype=np.int64)
    rows, begins, ends = [], [np.zeros(0, np.int64)], [np.zeros(0, np.int64)]
    row_count, interval_count = 0, 0
    for a in range(count):
        for b in range(a + 1, count):
            sizes, first, behind = _dead_ends_of(meetings, rule, a, b)
            rows_at[a, b] = row_count
            rows.append(interval_count + np.append(0, np.cumsum(sizes)))
            begins.append(first)
            ends.append(behind)
            row_count += len(sizes) + 1
            interval_count += len(first)
    none = np.zeros(0, dtype=np.int64)
    return DeadEnds(
        rows_at, np.concatenate([*rows, none]), np.concatenate(begins), np.concatenate(ends)
    )


@kernel
def is_dead_end(dead_ends, m, k, n, j):
    """Whether machines m and n, with the progress k and j, are in a dead end.

    Args:
        dead_ends: Of all pairs.
        m: Number of a machine.
        k: Its progress.
        n: Number of another one.
        j: Its progress.
    """
    if m > n:
        m, k, n, j = n, j, m, k
    at = dead_ends.rows_at[m, n] + k
    for q in range(dead_ends.rows[at], dead_ends.rows[at + 1]):
        if dead_ends.begins[q] > j:
            return False
        if dead_ends.ends[q] > j:
            return True
    return False


@compiled
def _dead_ends_of(meetings, rule, a, b):
    """Number of intervals of each row of a pair, and the intervals, row by row."""
    last_a, last_b = meetings.cells[a], meetings.cells[b]
    # Rows from the last to the first; with what is behind the last it is as if it were all dead.
    dead, behind = np.ones(last_b + 1, dtype=np.bool_), np.ones(last_b + 1, dtype=np.bool_)
    sizes = np.zeros(last_a + 1, dtype=np.int64)
    begins, ends = np.empty(1024, dtype=np.int64), np.empty(1024, dtype=np.int64)
    count = 0
    for i in range(last_a, -1, -1):
        dead, behind = behind, dead
        conflict = _conflicts_of(meetings, a, b, min(i, last_a - 1), last_b)
        for j in range(last_b, -1, -1):
            stuck = not (i == last_a and j == last_b)
            if stuck and i < last_a and not behind[j]:
                stuck = i + 1 < last_a and rule.by_crop[rule.places[a, b] + j] < i + 1
            if stuck and j < last_b and not dead[j + 1]:
                stuck = j + 1 < last_b and rule.by_crop[rule.places[b, a] + i] < j + 1
            dead[j] = stuck or conflict[min(j, last_b - 1)]
        # From the last one to the first, as the rows are: both are turned round in the end.
        for j in range(last_b, -1, -1):
            if dead[j] and (j == last_b or not dead[j + 1]):
                if count == len(begins):
                    begins = np.concatenate((begins, np.empty_like(begins)))
                    ends = np.concatenate((ends, np.empty_like(ends)))
                ends[count] = j + 1
                sizes[i] += 1
                count += 1
            if dead[j]:
                begins[count - 1] = j
    return sizes, begins[:count][::-1].copy(), ends[:count][::-1].copy()


@compiled
def _conflicts_of(meetings, a, b, i, cells):
    """Which cells of machine b are in conflict with cell i of machine a, shape (cells,)."""
    conflict = np.zeros(cells, dtype=np.bool_)
    at = meetings.rows_at[a, b] + i
    for q in range(meetings.rows[at], meetings.rows[at + 1]):
        conflict[meetings.begins[q] : meetings.ends[q]] = True
    return conflict
