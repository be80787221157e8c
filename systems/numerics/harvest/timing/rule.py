"""The one rule by which machines drive, in plans and on the field.

The *progress* of a machine is the number of the cell that it is on: k while it drives on cell k and
while it stands at its end; the number of cells once it has arrived at the end of its path, where it
stays on the last cell. Each cell of machine m may need progress of machine n: for crop precedence,
so that the ground is cut before a body is on it, and for the order of an encounter at which n goes
first, so that n has left all cells in conflict with it.

**Rule.** The *hold* of a machine is the last cell of its path up to which every cell has what it
needs. A machine drives on to its hold, and stands at the end of that until more needs are met.

**No two machines are nearer than the gap.** Let cells i of a and j of b be in conflict. They belong
to one encounter, at which one goes first, say a. Then j needs the progress i + 1 of a, and b is not
on j before a has left i. This does not depend on speeds.

**No deadlock.** Orders come with the plan's own events: in order of time, each machine enters each
of its cells once, and never before what the cell needs has happened. On the field, let some machine
not have arrived, and take of all cells that have not been entered the one that the plan enters
first, cell k of machine m. What k needs happened earlier in the plan, so it has happened on the
field as well, and m has entered all cells before k. Hence m may drive on to k. So while any machine
has not arrived, one may drive on, in whatever way the others are late.

The progress that each cell needs is stored the other way round, as the hold of m for every progress
of n, so that the rule takes one look at a table for each of the other machines.

**Dead ends of two machines** are states from which one of them never arrives, whatever they do. For
two machines alone, all that matters is how far each has come. Going backwards from the ends, a
state is a dead end if the two are in conflict in it, or if neither may drive on to a state that is
no dead end. This finds exactly all of them. Machines that keep out of the dead ends of every pair
may still block one another in a ring of three or more.
"""

from typing import NamedTuple

import numpy as np

from ...compiled import compiled, kernel
from .conflicts import CellIntervals, ConflictSet

# Stands for the first machine at an encounter whose order is not decided.
UNDECIDED = -1


class Meetings(NamedTuple):
    """Conflicts of all pairs of machines, in one piece for compiled functions.

    Attributes:
        cells: Of each machine's path, shape (N,).
        rows_at: Where the rows of machine m with regard to machine n begin, shape (N, N).
        rows: Where the intervals of each row begin; that of the next row is their end, shape (r,).
        begins, ends: As in `CellIntervals`, shape (k,).
        encounters: Number of the encounter of each interval, among all pairs, shape (k,).
        pairs: The two machines of each encounter, shape (E, 2).
        examples: A pair of cells of each encounter, shape (E, 2).
        cells_at: Number of the first cell of each machine, if cells are numbered machine by
            machine, shape (N,).
        farthest: For each cell and each other machine, one after the last cell of that machine in
            conflict with it, 0 where there is none, shape (sum of cells, N).
    """

    cells: np.ndarray
    rows_at: np.ndarray
    rows: np.ndarray
    begins: np.ndarray
    ends: np.ndarray
    encounters: np.ndarray
    pairs: np.ndarray
    examples: np.ndarray
    cells_at: np.ndarray
    farthest: np.ndarray


class Rule(NamedTuple):
    """Holds of all machines for every progress of every other one.

    Attributes:
        cells: Of each machine's path, shape (N,).
        places: Where the table of machine m with regard to machine n begins, shape (N, N); it has
            an entry for each progress of n, from 0 to its number of cells.
        by_crop: Last cell that m may enter by crop precedence, shape (t,).
        by_order: Last cell that m may enter by the orders of encounters, shape (t,).
    """

    cells: np.ndarray
    places: np.ndarray
    by_crop: np.ndarray
    by_order: np.ndarray


def gather_meetings(cells: np.ndarray, conflicts: dict[tuple[int, int], ConflictSet]) -> Meetings:
    """All conflicts in one piece.

    Args:
        cells: Of each machine's path, shape (N,).
        conflicts: Of machines a < b; a pair that is missing has none.
    """
    count = len(cells)
    rows_at = np.zeros((count, count), dtype=np.int64)
    none = np.zeros(0, dtype=np.int64)
    rows, begins, ends, encounters = [], [none], [none], [none]
    pairs, examples = [np.zeros((0, 2), dtype=np.int64)], [np.zeros((0, 2), dtype=np.int64)]
    row_count, interval_count, encounter_count = 0, 0, 0
    begun: dict[tuple[int, int], int] = {}
    cells_at = np.cumsum(cells) - cells
    farthest = np.zeros((int(np.sum(cells)), count), dtype=np.int64)
    for m in range(count):
        for n in range(count):
            if m == n:
                continue
            found = conflicts.get((min(m, n), max(m, n)))
            if found is None:
                zeros = np.zeros(int(cells[m]) + 1, dtype=np.int64)
                part, number = CellIntervals(zeros, none, none, none), 0
            else:
                part, number = (found.of_a if m < n else found.of_b), found.parts
            rows_at[m, n] = row_count
            rows.append(part.rows + interval_count)
            begins.append(part.begins)
            ends.append(part.ends)
            some = np.flatnonzero(np.diff(part.rows))
            farthest[cells_at[m] + some, n] = part.ends[part.rows[some + 1] - 1]
            row_count += len(part.rows)
            interval_count += len(part.begins)
            if m < n:
                begun[m, n] = encounter_count
                encounters.append(part.encounters + encounter_count)
                first = np.unique(part.encounters, return_index=True)[1]
                row = np.searchsorted(part.rows, first, side="right") - 1
                pairs.append(np.broadcast_to([m, n], (number, 2)))
                examples.append(np.column_stack([row, part.begins[first]]))
                encounter_count += number
            else:
                # The pair (n, m) came before, with the same numbers.
                encounters.append(part.encounters + begun[n, m])
    return Meetings(
        np.asarray(cells, dtype=np.int64),
        rows_at,
        np.concatenate([*rows, none]),
        np.concatenate(begins),
        np.concatenate(ends),
        np.concatenate(encounters),
        np.concatenate(pairs),
        np.concatenate(examples).astype(np.int64),
        cells_at,
        farthest,
    )


def free_rule(cells: np.ndarray) -> Rule:
    """The rule of machines that need nothing of one another.

    Args:
        cells: Of each machine's path, shape (N,).
    """
    count = len(cells)
    sizes = np.broadcast_to(np.asarray(cells) + 1, (count, count)).copy()
    np.fill_diagonal(sizes, 0)
    places = (np.cumsum(sizes.ravel()) - sizes.ravel()).reshape(count, count)
    last = np.repeat(np.repeat(np.asarray(cells) - 1, count), sizes.ravel())
    return Rule(np.asarray(cells, dtype=np.int64), places, last.copy(), last.copy())


@compiled
def set_precedence(rule, m, n, needed):
    """Tell the rule what progress of machine n each cell of machine m needs for its crop.

    Args:
        rule: Whose table of crop precedence is written.
        m, n: Numbers of machines.
        needed: Shape (cells of m,); the first cell is not asked, as the machine stands there.
    """
    needed = needed.copy()
    needed[0] = 0
    _write_holds(needed, rule.by_crop, rule.places[m, n], rule.cells[n])


@compiled
def set_orders(rule, meetings, first, m, n):
    """Tell the rule who goes first at the encounters of machines m and n; undecided ones are free.

    Args:
        rule: Whose table of orders is written.
        meetings: Conflicts of all machines.
        first: The machine that goes first at each encounter, or UNDECIDED, shape (E,).
        m, n: Numbers of machines.
    """
    for one, other in ((m, n), (n, m)):
        needed = np.zeros(rule.cells[one], dtype=np.int64)
        at = meetings.rows_at[one, other]
        for k in range(rule.cells[one]):
            for q in range(meetings.rows[at + k], meetings.rows[at + k + 1]):
                if first[meetings.encounters[q]] == other:
                    # A machine never leaves the last cell of its path.
                    never = meetings.ends[q] == rule.cells[other]
                    needed[k] = max(needed[k], meetings.ends[q] + (1 if never else 0))
        _write_holds(needed, rule.by_order, rule.places[one, other], rule.cells[other])


@kernel
def _write_holds(needed, table, place, progress_of_other):
    """Turn the progress that each cell needs into the last cell that each progress allows."""
    k = 0
    for progress in range(progress_of_other + 1):
        while k < len(needed) and needed[k] <= progress:
            k += 1
        table[place + progress] = k - 1


@kernel
def hold_of(rule, m, progress):
    """The rule: the last cell that a machine may enter.

    Args:
        rule: Tables.
        m: Number of the machine.
        progress: Of all machines, shape (N,).
    """
    hold = rule.cells[m] - 1
    for n in range(len(progress)):
        if n != m:
            at = rule.places[m, n] + progress[n]
            hold = min(hold, rule.by_crop[at], rule.by_order[at])
    return hold


@kernel
def cause_of(rule, m, progress):
    """Which other machine sets the hold of machine m, or -1, and whether by crop precedence.

    Args:
        rule: Tables.
        m: Number of the machine.
        progress: Of all machines, shape (N,).
    """
    hold, by, crop = rule.cells[m] - 1, -1, False
    for n in range(len(progress)):
        if n != m:
            at = rule.places[m, n] + progress[n]
            if rule.by_crop[at] < hold:
                hold, by, crop = rule.by_crop[at], n, True
            if rule.by_order[at] < hold:
                hold, by, crop = rule.by_order[at], n, False
    return by, crop


class DeadEnds(NamedTuple):
    """Dead ends of all pairs of machines, by progress.

    Attributes:
        rows_at: Where the rows of machines a < b begin, one for each progress of a from 0 to its
            number of cells, shape (N, N).
        rows: Where the intervals of each row begin; that of the next row is their end, shape (r,).
        begins, ends: First progress of b in each interval, and one after its last, shape (k,).
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
    return is_within(dead_ends, dead_ends.rows_at[m, n] + k, j)


@compiled
def first_nodes(cells):
    """Numbers of the machines' first nodes, which lie before, between and after cells, shape (N,).

    Args:
        cells: Of each machine's path, shape (N,).
    """
    return np.cumsum(cells + 1) - (cells + 1)


@kernel
def is_within(intervals, row, j):
    """Whether a number is in one of the intervals of a row.

    Args:
        intervals: Meetings, or dead ends.
        row: Number of the row.
        j: The number.
    """
    for q in range(intervals.rows[row], intervals.rows[row + 1]):
        if intervals.begins[q] > j:
            return False
        if intervals.ends[q] > j:
            return True
    return False


@compiled
def _dead_ends_of(meetings, rule, a, b):
    """Number of intervals of each row of a pair, and the intervals, row by row.

    Rows are worked out from the last to the first, each from its end backwards in stretches of b on
    which nothing changes: neither conflicts, nor whether a may drive on, nor whether b may.
    """
    last_a, last_b = meetings.cells[a], meetings.cells[b]
    crop_of_a = rule.by_crop[rule.places[a, b] : rule.places[a, b] + last_b + 1]
    sizes = np.zeros(last_a + 1, dtype=np.int64)
    begins, ends = np.empty(1024, dtype=np.int64), np.empty(1024, dtype=np.int64)
    count = 0
    for i in range(last_a, -1, -1):
        # The first intervals of row i + 1 and of this row, and the conflicts of this row.
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
                # A machine that has arrived stays on the last cell.
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
    # Rows and their intervals were worked out from the last one to the first.
    return sizes, begins[:count][::-1].copy(), ends[:count][::-1].copy()
