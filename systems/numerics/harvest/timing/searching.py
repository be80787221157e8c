"""A way for all to their ends, where steps without harm do not lead there.

Machines are run on without harm, and then one of them to somewhere it may wait: as far as it can
drive, or to a cell from which it would get in the way of more; nothing else needs to be tried, as
driving on from any other cell is without harm. All such ways are searched, depth first, the longest
steps first. That there is none is known for sure if the search ends before its budget does.
"""

import numpy as np

from ...compiled import compiled
from .deciding import Course, gets_in_the_way, reach_of, run_on
from .rule import Meetings, Rule

# States that are looked at before the search is given up.
BUDGET = 20_000


def search_course(meetings: Meetings, rule: Rule, budget: int = BUDGET) -> Course:
    """Search a way for all machines to their ends, where the quick one of first come finds none.

    Args:
        meetings: Conflicts.
        rule: Crop precedence, and orders that are told beforehand.
        budget: Number of states to look at, at most.

    Returns:
        The way that was found, one machine after the other; without one, how far machines can be
        brought without harm.
    """
    count = len(meetings.cells)
    start = np.zeros(count, dtype=np.int64)
    least = start.copy()
    _close(meetings, rule, least)
    # States as machines were brought on from, and as the search comes to them before that.
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
    nodes = np.cumsum(meetings.cells + 1) - (meetings.cells + 1)
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
    """Where a machine may wait next, the farthest last."""
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
