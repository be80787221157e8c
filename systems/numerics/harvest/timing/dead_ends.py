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
    """Number of intervals of each row of a pair, and the intervals, row by row.

    Rows are told from the last to the first, and each from its end backwards in stretches of b on
    which nothing changes: conflicts, whether a may drive on, and whether b may.
    """
    last_a, last_b = meetings.cells[a], meetings.cells[b]
    crop_of_a = rule.by_crop[rule.places[a, b] : rule.places[a, b] + last_b + 1]
    sizes = np.zeros(last_a + 1, dtype=np.int64)
    begins, ends = np.empty(1024, dtype=np.int64), np.empty(1024, dtype=np.int64)
    count = 0
    for i in range(last_a, -1, -1):
        # The row behind, whose intervals stand before these, and the conflicts of this one.
        behind, own = count - (sizes[i + 1] if i < last_a else 0), count
        at = meetings.rows_at[a, b] + min(i, last_a - 1)
        first, near = meetings.rows[at], meetings.rows[at + 1] - 1
        # Below this progress of b machine a may not drive on; it may always arrive.
        held = last_b if i == last_a else 0
        if i + 1 < last_a:
            held = np.searchsorted(crop_of_a, i + 1)
        hold = rule.by_crop[rule.places[b, a] + i]
        dead = False
        upto = last_b + 1
        while upto > 0:
            j, begin = upto - 1, 0
            while near >= first and meetings.begins[near] > j:
                near -= 1
            conflict = False
            if near >= first:
                # Who has arrived stays on the last cell.
                beyond = meetings.ends[near] + (1 if meetings.ends[near] == last_b else 0)
                conflict = j < beyond
                begin = max(begin, meetings.begins[near] if conflict else beyond)
            while behind < own and begins[behind] > j:
                behind += 1
            a_stands = j < held
            if not a_stands:
                begin = max(begin, held)
            if behind < own:
                within = j < ends[behind]
                a_stands = a_stands or within
                begin = max(begin, begins[behind] if within else ends[behind])
            b_stands = j == last_b
            if j >= last_b - 1:
                begin = j
            elif j >= hold:
                b_stands = True
                begin = max(begin, hold)
            before, dead = dead, conflict or (a_stands and (dead or b_stands))
            if dead and not before:
                if count == len(begins):
                    begins = np.concatenate((begins, np.empty_like(begins)))
                    ends = np.concatenate((ends, np.empty_like(ends)))
                ends[count] = upto
                sizes[i] += 1
                count += 1
            if dead:
                begins[count - 1] = begin
            upto = begin
    # Rows and their intervals were told from the last one to the first.
    return sizes, begins[:count][::-1].copy(), ends[:count][::-1].copy()
