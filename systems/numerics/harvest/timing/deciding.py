"""Who goes first at each encounter: machines drive by nominal times, first come, first served.

A machine enters its next cell as soon as the `rule` allows it, no other machine is on a cell in
conflict with it, and the state after it is *safe*: all can be brought to their ends by running
machines on, one after another, without harm to the others. This is Dijkstra's banker's algorithm
(EWD 623); the loans are cells in conflict with what is left of others' ways.

**Steps without harm.** On a cell a machine is *in the way of* those cells in conflict with it which
others are on or will come to. There is no harm in running a machine on

- to a *free* cell, where it is in the way of nothing, if the way there is clear, or
- to its next cell, if it is in the way of nothing there that it was not in the way of before.

If there was a way for all to their ends before such a step, there is one after it: the others move
as they did, and the machine waits on the cell it was run on to until it would have got there
anyway. Meanwhile it is in the way of nothing new, and its greater progress meets what others need
of it no less. So the order of such steps does not matter: if any order of them leads to the ends,
the test finds that it does.

**Some machine may always enter its next cell.** In a safe state with a machine that has not
arrived, the banker's first step runs some machine m on without harm. From each cell on that way the
rest of the step leads to the same state, from which the banker goes on. So all these states are
safe, and the rule and the conflicts allow them, or the step would not have been possible. Hence m
may enter its next cell. All machines move one cell at a time and cells are finite, so that all
arrive. These events, in this order, are those that the proof of the `rule` asks for.

**Convoys.** Machines that follow one another round a field are all in the way of one another: none
of their states is safe in that sense, and yet they arrive. So before the first safe state it is
enough that no two of them are in a dead end. They may still block one another for ever, which shows
in the end; if they do not, their order is as good as any.

**Where steps without harm do not lead to the ends**, machines are run on without harm, and then one
of them to a cell where it may wait: the last one that it can drive to, or one whose next cell would
put it in the way of more. No other cell needs to be tried, as driving on from it is without harm.
All such ways are searched, depth first, the longest steps first. If the search ends before its
budget is used up, it is certain that there is no way.
"""

from typing import NamedTuple

import numpy as np

from ...compiled import compiled, kernel
from .rule import DeadEnds, Meetings, Rule, first_nodes, hold_of, is_dead_end, is_within

# Number of cells entered between two checks whether a convoy's state is safe.
BETWEEN = 8

# States that are looked at before the search is given up.
BUDGET = 20_000


class Course(NamedTuple):
    """The order in which machines entered cells.

    Attributes:
        entered: Number of the event at which each machine reached each progress, machine by
            machine, shape (sum of cells + N,); -1 if it never did.
        progress: Of each machine in the end, shape (N,).
        arrived: Whether all have arrived; if not, no way was found from the beginning, and
            `progress` is how far they were brought.
    """

    entered: np.ndarray
    progress: np.ndarray
    arrived: bool


@kernel
def occupied(meetings: Meetings, n, progress):
    """The cell that machine n is on."""
    return min(progress[n], meetings.cells[n] - 1)


@kernel
def in_conflict(meetings: Meetings, m, k, n, j):
    """Whether cell k of machine m is in conflict with cell j of machine n."""
    return is_within(meetings, meetings.rows_at[m, n] + k, j)


@kernel
def is_free(meetings: Meetings, m, k, progress):
    """Whether cell k of machine m is in conflict with no cell where others are or will come to."""
    row = meetings.cells_at[m] + k
    for n in range(len(progress)):
        if meetings.farthest[row, n] > occupied(meetings, n, progress):
            return False
    return True


@kernel
def gets_in_the_way(meetings: Meetings, m, k, progress):
    """Whether machine m is in the way of more on cell k than on the cell before."""
    for n in range(len(progress)):
        if n == m:
            continue
        other = occupied(meetings, n, progress)
        at = meetings.rows_at[m, n] + k
        before, stop = meetings.rows[at - 1], meetings.rows[at]
        for q in range(meetings.rows[at], meetings.rows[at + 1]):
            if meetings.ends[q] <= other:
                continue
            while before < stop and meetings.ends[before] < meetings.ends[q]:
                before += 1
            if before == stop or meetings.begins[before] > max(other, meetings.begins[q]):
                return True
    return False


@kernel
def reach_of(meetings: Meetings, rule: Rule, m, progress):
    """The last cell to which machine m can drive while all others stand."""
    own = occupied(meetings, m, progress)
    reach = max(own, hold_of(rule, m, progress))
    for n in range(len(progress)):
        if n != m:
            at = meetings.rows_at[n, m] + occupied(meetings, n, progress)
            for q in range(meetings.rows[at], meetings.rows[at + 1]):
                if meetings.ends[q] > own:
                    reach = min(reach, max(own, meetings.begins[q] - 1))
                    break
    return reach


@kernel
def run_on(meetings, rule, m, progress):
    """Run a machine on as far as is possible without harm; return whether it has moved.

    Args:
        meetings: Conflicts.
        rule: What cells need.
        m: Number of the machine.
        progress: Of all machines; that of m is written, shape (N,).
    """
    begun, last = progress[m], meetings.cells[m] - 1
    reach = reach_of(meetings, rule, m, progress)
    while progress[m] < reach and not gets_in_the_way(meetings, m, progress[m] + 1, progress):
        progress[m] += 1
    for k in range(reach, progress[m], -1):
        if is_free(meetings, m, k, progress):
            progress[m] = k
            break
    if progress[m] == last:
        progress[m] = last + 1
    return progress[m] > begun


@kernel
def bring_on(meetings, rule, progress):
    """Run machines on without harm until none can go on; return whether all arrive.

    Args:
        meetings: Conflicts.
        rule: What cells need.
        progress: Of all machines; it is written, shape (N,).
    """
    moved = True
    while moved:
        moved = False
        for m in range(len(progress)):
            if progress[m] < meetings.cells[m] and run_on(meetings, rule, m, progress):
                moved = True
    arrived = True
    for m in range(len(progress)):
        arrived = arrived and progress[m] == meetings.cells[m]
    return arrived


@kernel
def _may_enter(meetings, rule, dead_ends, m, progress, trial, refused, is_safe):
    """Whether machine m may enter its next cell: a safe state stays safe, others avoid dead ends.

    The banker is not asked at all if the step is without harm, or if the machine could be run on
    from there to a free cell. He is not asked again if he refused the cell before, and no other
    machine has got beyond where it could have been brought then.
    """
    k = progress[m] + 1
    if hold_of(rule, m, progress) < k:
        return False
    for n in range(len(progress)):
        if n != m and in_conflict(meetings, m, k, n, occupied(meetings, n, progress)):
            return False
    if not is_safe:
        for n in range(len(progress)):
            if n != m and is_dead_end(dead_ends, m, k, n, progress[n]):
                return False
        return True
    # The state is safe if the step is without harm, or leads on to a free cell: the machine could
    # have been run on to that from the state before.
    if not gets_in_the_way(meetings, m, k, progress):
        return True
    again = refused[m, m] == k
    for n in range(len(progress)):
        again = again and (n == m or progress[n] <= refused[m, n])
    progress[m] = k
    reach = reach_of(meetings, rule, m, progress)
    safe = False
    for ahead in range(k, reach + 1):
        if is_free(meetings, m, ahead, progress):
            safe = True
            break
    if not safe and not again:
        for n in range(len(progress)):
            trial[n] = progress[n]
        safe = bring_on(meetings, rule, trial)
        for n in range(len(progress)):
            refused[m, n] = trial[n]
        refused[m, m] = k
    progress[m] = k - 1
    return safe


@compiled
def drive_first_come(
    meetings: Meetings,
    rule: Rule,
    dead_ends: DeadEnds,
    durations: np.ndarray,
    priority: np.ndarray,
) -> Course:
    """Let all machines drive from the beginnings of their paths, and see who goes first.

    Args:
        meetings: Conflicts.
        rule: Crop precedence, and orders that are told beforehand.
        dead_ends: Of pairs of machines.
        durations: Of each cell if nothing is in the way, machine by machine, shape
            (sum of cells,) [s].
        priority: Order in which waiting machines are asked whether they may go on, shape (N,).
    """
    count = len(meetings.cells)
    nodes = first_nodes(meetings.cells)
    entered = np.full(meetings.cells.sum() + count, -1)
    progress = np.zeros(count, dtype=np.int64)
    trial = progress.copy()
    # The cell that each machine was refused last, and how far the others could be brought then.
    refused = np.full((count, count), -1)
    is_safe = bring_on(meetings, rule, trial)
    event = asked = 0
    # When each machine is at the end of its cell; the times of those that wait are not used.
    due = np.empty(count)
    for m in range(count):
        entered[nodes[m]] = event
        due[m] = durations[nodes[m] - m]
    waits = np.zeros(count, dtype=np.bool_)
    while True:
        m, now = -1, np.inf
        for n in range(count):
            if not waits[n] and progress[n] < meetings.cells[n] and due[n] < now:
                m, now = n, due[n]
        if m < 0:
            break
        waits[m] = True
        if not is_safe and event >= asked + BETWEEN:
            asked = event
            trial[:] = progress
            is_safe = bring_on(meetings, rule, trial)
        moved = True
        while moved:
            moved = False
            for n in priority:
                if not waits[n]:
                    continue
                arrives = progress[n] + 1 == meetings.cells[n]
                if arrives or _may_enter(
                    meetings, rule, dead_ends, n, progress, trial, refused, is_safe
                ):
                    progress[n] += 1
                    event += 1
                    entered[nodes[n] + progress[n]] = event
                    waits[n] = False
                    moved = True
                    if not arrives:
                        due[n] = now + durations[nodes[n] - n + progress[n]]
    return Course(entered, progress, (progress == meetings.cells).all())


def orders_of(meetings: Meetings, course: Course) -> np.ndarray:
    """The machine that went first at each encounter, shape (E,).

    Args:
        meetings: Conflicts.
        course: In which all arrived.
    """
    cells = meetings.cells
    nodes = first_nodes(cells)
    a, b = meetings.pairs.T
    i, j = meetings.examples.T
    left = course.entered[nodes[a] + i + 1]
    # A machine stays on the last cell of its path, so the other one went first.
    a_first = (left < course.entered[nodes[b] + j]) & (i + 1 < cells[a])
    return np.where(a_first, a, b)


def search_course(meetings: Meetings, rule: Rule, budget: int = BUDGET) -> Course:
    """Search a way for all machines to their ends, where first come, first served finds none.

    Args:
        meetings: Conflicts.
        rule: Crop precedence, and orders that are told beforehand.
        budget: How many states are looked at before the search is given up.

    Returns:
        The way that was found, one machine after the other; without one, how far machines can be
        brought without harm.
    """
    count = len(meetings.cells)
    start = np.zeros(count, dtype=np.int64)
    least = start.copy()
    _close(meetings, rule, least)
    # States after running machines on without harm, and states as the search first comes to them.
    seen: set[bytes] = set()
    met: set[bytes] = set()
    # Each state with the moves that led to it: who went, and the moves before.
    stack: list[tuple[np.ndarray, tuple | None]] = [(start, None)]
    while stack and len(met) < budget:
        progress, moves = stack.pop()
        if progress.tobytes() in met:
            continue
        met.add(progress.tobytes())
        for m, there in _close(meetings, rule, progress):
            moves = (int(m), int(there), moves)
        if (progress == meetings.cells).all():
            return _course(meetings, moves)
        if progress.tobytes() in seen:
            continue
        seen.add(progress.tobytes())
        for m in range(count):
            for there in _stops(meetings, rule, m, progress):
                after = progress.copy()
                after[m] = there
                stack.append((after, (m, int(there), moves)))
    never = np.full(int(meetings.cells.sum()) + count, -1)
    return Course(never, least, False)


def _course(meetings: Meetings, moves: tuple | None) -> Course:
    """Events in the order of moves, which are linked from the last to the first."""
    listed = []
    while moves is not None:
        m, there, moves = moves
        listed.append((m, there))
    nodes = first_nodes(meetings.cells)
    entered = np.full(int(meetings.cells.sum()) + len(nodes), -1)
    entered[nodes] = 0
    progress = np.zeros(len(nodes), dtype=np.int64)
    event = 0
    for m, there in reversed(listed):
        steps = there - progress[m]
        at = nodes[m] + progress[m]
        entered[at + 1 : at + 1 + steps] = event + 1 + np.arange(steps)
        progress[m], event = there, event + steps
    return Course(entered, progress, True)


@compiled
def _close(meetings, rule, progress):
    """Run machines on without harm, and list who went where, shape (k, 2)."""
    moves = np.empty((16, 2), dtype=np.int64)
    count = 0
    moved = True
    while moved:
        moved = False
        for m in range(len(progress)):
            if progress[m] < meetings.cells[m] and run_on(meetings, rule, m, progress):
                moved = True
                if count == len(moves):
                    moves = np.concatenate((moves, np.empty_like(moves)))
                moves[count, 0], moves[count, 1] = m, progress[m]
                count += 1
    return moves[:count].copy()


@compiled
def _stops(meetings, rule, m, progress):
    """The cells where a machine may wait next, the farthest last."""
    if progress[m] == meetings.cells[m]:
        return np.empty(0, dtype=np.int64)
    reach = reach_of(meetings, rule, m, progress)
    stops = np.empty(reach - progress[m], dtype=np.int64)
    count = 0
    for k in range(progress[m] + 1, reach + 1):
        if k == reach or gets_in_the_way(meetings, m, k + 1, progress):
            stops[count] = k
            count += 1
    return stops[:count].copy()
