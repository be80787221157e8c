"""Why there is no timetable: which machines block one another, and where."""

from dataclasses import dataclass

import numpy as np

from .deciding import in_conflict, occupied, reach_of
from .rule import Meetings, Rule, cause_of, hold_of
from .sweep import Sweep

# Why a machine cannot go on.
CAUSES = ("crop", "order", "in the way", "no place to pass")


@dataclass(frozen=True)
class Block:
    """A machine that cannot get to the end of its path.

    Attributes:
        machine: Its number.
        station: How far it can drive [m].
        place: x, y of the middle of what it covers there [m].
        by: Number of the machine that blocks it.
        by_station: Where that one is, or, if the machine has no place to let it pass, where it
            would come by [m].
        cause: One of CAUSES.
    """

    machine: int
    station: float
    place: tuple[float, float]
    by: int
    by_station: float
    cause: str

    def __str__(self) -> str:
        x, y = self.place
        reason = {
            "crop": "needs the crop cut by",
            "order": "has to let go first",
            "in the way": "is blocked by",
            "no place to pass": "has no place to let pass",
        }[self.cause]
        return (
            f"machine {self.machine} at {self.station:.0f} m of its path ({x:.0f}, {y:.0f}) "
            f"{reason} machine {self.by} at {self.by_station:.0f} m"
        )


@dataclass(frozen=True)
class Standstill:
    """There is no safe way to drive these paths: wherever all wait, some block one another.

    Attributes:
        blocks: One of each machine that cannot arrive.
        progress: Of all machines when no more can be brought on.
    """

    blocks: tuple[Block, ...]
    progress: tuple[int, ...]

    def __str__(self) -> str:
        return "; ".join(str(block) for block in self.blocks)


def explain_standstill(
    meetings: Meetings, rule: Rule, progress: np.ndarray, sweeps: list[Sweep]
) -> Standstill:
    """Who blocks whom where the banker could bring no machine on.

    Args:
        meetings: Conflicts.
        rule: With crop precedence, and orders if they are told.
        progress: Of all machines, how far the banker brought them, shape (N,).
        sweeps: Of all machines.
    """
    blocks = [
        _block(meetings, rule, progress, sweeps, m)
        for m in range(len(progress))
        if progress[m] < meetings.cells[m]
    ]
    return Standstill(tuple(blocks), tuple(int(each) for each in progress))


def _block(meetings, rule, progress, sweeps, m) -> Block:
    reach = int(reach_of(meetings, rule, m, progress))
    station = float(sweeps[m].stations[reach + 1])
    place = (float(sweeps[m].discs[reach, 0]), float(sweeps[m].discs[reach, 1]))

    def block(by: int, cell: int, cause: str) -> Block:
        return Block(m, station, place, by, float(sweeps[by].stations[cell]), cause)

    # A machine that can drive on, but comes to no free cell, would be in somebody's way there.
    if reach > progress[m] or reach + 1 == meetings.cells[m]:
        for n in range(len(progress)):
            at = meetings.rows_at[n, m] + np.arange(meetings.cells[n] + 1)
            if n == m:
                continue
            for j in range(int(occupied(meetings, n, progress)), int(meetings.cells[n])):
                rows = meetings.rows[at[j] : at[j] + 2]
                within = (meetings.begins[rows[0] : rows[1]] <= reach) & (
                    meetings.ends[rows[0] : rows[1]] > reach
                )
                if within.any():
                    return block(n, j, "no place to pass")
    if hold_of(rule, m, progress) <= reach:
        by, crop = cause_of(rule, m, progress)
        return block(by, int(progress[by]), "crop" if crop else "order")
    for n in range(len(progress)):
        cell = int(occupied(meetings, n, progress))
        if n != m and in_conflict(meetings, m, reach + 1, n, cell):
            return block(n, cell, "in the way")
    raise AssertionError("a machine that nothing stops is not at a standstill")
