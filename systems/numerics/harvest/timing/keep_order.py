"""How far each machine may drive now, on the field, whatever the others were late by.

It is the rule of the plan, applied from where the machines are.
"""

import numpy as np

from ...compiled import compiled
from .rule import Rule, hold_of
from .timetable import Timetable

# Less than this beyond the end of a cell a machine is still on it, as it is where it stands at the
# end of it [m].
TOLERANCE = 0.02


def progress_at(timetable: Timetable, stations: np.ndarray) -> np.ndarray:
    """Progress of machines, shape (N,).

    Args:
        timetable: Whose paths they drive.
        stations: Where they are, shape (N,) [m].
    """
    found = np.empty(len(stations), dtype=np.int64)
    for m, grid in enumerate(timetable.stations):
        on = int(np.searchsorted(grid, stations[m] - TOLERANCE)) - 1
        arrived = stations[m] >= grid[-1] - TOLERANCE
        found[m] = len(grid) - 1 if arrived else max(on, 0)
    return found


def holds_now(timetable: Timetable, stations: np.ndarray) -> np.ndarray:
    """The station up to which each machine may drive on, and where it stands until more is met.

    Holds never move back as machines drive on.

    Args:
        timetable: Whose orders they keep.
        stations: Where they are, shape (N,) [m].

    Returns:
        Shape (N,) [m].
    """
    cells = _holds(timetable.rule, progress_at(timetable, stations))
    return np.array([grid[k + 1] for grid, k in zip(timetable.stations, cells, strict=True)])


@compiled
def _holds(rule: Rule, progress):
    holds = np.empty(len(progress), dtype=np.int64)
    for m in range(len(progress)):
        holds[m] = hold_of(rule, m, progress)
    return holds
