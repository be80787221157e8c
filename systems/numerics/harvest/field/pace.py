"""Who has to wait for whom, so that the left of every combine stays open."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .combine_path import CombinePath
from .swept_cells import CropCells

# Places looked at in each header's width of way.
SAMPLES = 4

# Half the width of a combine's body, in headers' widths.
BODY = 0.2


@dataclass(frozen=True, eq=False)
class Holds:
    """Stations beyond which one combine drives only when another has got far enough.

    Attributes:
        waiting: Number of the one.
        other: Number of the other.
        beside: Whether the crop is on the one's left; else it is in its way.
        stations: Of the one, never decreasing, shape (k,) [m].
        passed: Station at which the other cuts the crop there, shape (k,) [m].
        needs: Station that the other has to have reached, never decreasing, shape (k,) [m].
    """

    waiting: int
    other: int
    beside: bool
    stations: np.ndarray
    passed: np.ndarray
    needs: np.ndarray

    def limit(self, progress: float) -> float:
        """How far the one may drive when the other is at a station [m]."""
        index = int(np.searchsorted(self.needs, progress + 1e-9, side="right"))
        return float(self.stations[index]) if index < len(self.stations) else np.inf


def find_holds(
    paths: Sequence[CombinePath], cells: CropCells, header: float, gap: float
) -> tuple[Holds, ...]:
    """What each combine waits for: the crop on its left cut, and its cutter a gap ahead.

    On its way to a loop, and in reverse, it waits for the crop in its way instead. Nobody waits
    for a loop that is begun after its own, nor for what another does after the loop that it waits
    for; so there is always one that can go on.

    Args:
        paths: Of the combines.
        cells: As they are cut, if every loop waits for all those before it.
        header: Width of the header [m].
        gap: Way by which the combine on the left is to be ahead [m].
    """
    found = []
    for n, path in enumerate(paths):
        at = np.arange(0.0, path.length, header / SAMPLES)
        working = (path.loop_at(at) >= 0) & (path.gear_at(at) > 0)
        for beside, places in ((True, at[working]), (False, at[~working])):
            # On the way to a loop, what the body is about to drive over has to be cut.
            sides = [header] if beside else [-BODY * header, 0.0, BODY * header]
            where = np.repeat(places, len(sides))
            offsets = np.tile(sides, len(places))
            points = path.alongside(offsets, where)[:, :2]
            row, column, on = cells.cell_of(points)
            by = np.where(on, cells.cut_by[row, column], -1)
            when = cells.cut_at[row, column]
            turn = path.turn_at(where)
            for m, other in enumerate(paths):
                theirs = np.flatnonzero(by == m)
                theirs = theirs[other.turn_at(when[theirs]) < turn[theirs]]
                if m != n and len(theirs):
                    passed = when[theirs]
                    needs = np.minimum(passed + gap, other.end_of_turn(passed))
                    found.append(
                        Holds(n, m, beside, where[theirs], passed, np.maximum.accumulate(needs))
                    )
    return tuple(found)


def least_delays(holds: Sequence[Holds], combines: int, most: float) -> np.ndarray:
    """Ways that the first combine drives before each other starts, so that they rarely wait.

    Args:
        holds: Who waits for whom.
        combines: Number of combines.
        most: Longest delay of one after the one before [m].

    Returns:
        Shape (combines,) [m].
    """
    delays = np.zeros(combines)
    for n in range(1, combines):
        wanted = [
            delays[hold.other] + float((hold.needs - hold.stations).max())
            for hold in holds
            if hold.waiting == n and hold.other < n
        ]
        delays[n] = np.clip(max(wanted, default=0.0), delays[n - 1], delays[n - 1] + most)
    return delays


@dataclass(frozen=True, eq=False)
class Timeline:
    """When everybody is where, if all drive at one speed and wait as they have to.

    Attributes:
        clock: Way that a combine without any waiting would have driven, shape (k,) [m].
        progress: Stations of all combines, shape (k, combines) [m].
        waits: Way that each would have driven while it waited, without its start delay [m].
    """

    clock: np.ndarray
    progress: np.ndarray
    waits: np.ndarray

    def clock_at(self, combine: int, stations: np.ndarray) -> np.ndarray:
        """When a combine goes on from stations, after what waiting it does there [m]."""
        progress = self.progress[:, combine]
        index = np.searchsorted(progress, stations + 1e-9, side="right") - 1
        index = np.clip(index, 0, len(self.clock) - 1)
        return self.clock[index] + np.maximum(stations - progress[index], 0.0)

    def stops(self, combine: int) -> np.ndarray:
        """Stations at which a combine waits [m]."""
        progress = self.progress[:, combine]
        slow = np.diff(progress) < 0.5 * np.diff(self.clock)
        return np.unique(progress[1:][slow])

    def station_at(self, combine: int, clock: np.ndarray) -> np.ndarray:
        """Stations of a combine at given times [m]."""
        return np.interp(clock, self.clock, self.progress[:, combine])


def station_limits(holds: Sequence[Holds], progress: np.ndarray) -> np.ndarray:
    """How far each combine may drive for now, shape (combines,) -> (combines,) [m]."""
    limits = np.full(len(progress), np.inf)
    for hold in holds:
        limit = hold.limit(progress[hold.other])
        limits[hold.waiting] = min(limits[hold.waiting], limit)
    return limits


def run_timeline(
    lengths: Sequence[float],
    delays: np.ndarray,
    holds: Sequence[Holds],
    step: float,
) -> Timeline:
    """Let all combines drive, one step of the clock at a time [m]."""
    ends = np.asarray(lengths, dtype=float)
    now, clock = np.zeros(len(ends)), 0.0
    waits = np.zeros(len(ends))
    clocks, rows = [0.0], [now]
    while (now < ends).any():
        free = np.minimum(station_limits(holds, now), ends)
        able = np.clip(clock + step - delays, 0.0, step)
        after = np.maximum(now, np.minimum(now + able, free))
        waits += np.where(now < ends, able - (after - now), 0.0) * (free < ends)
        clock += step
        assert (after > now).any() or clock <= delays.max() + step, "one can always go on"
        now = after
        clocks.append(clock)
        rows.append(now)
    return Timeline(np.array(clocks), np.array(rows), waits)
