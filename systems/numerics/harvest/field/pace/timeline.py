"""When everybody is where, if all drive at one speed and wait as they have to."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ....compiled import compiled
from .holds import Holds, limits_of, pack_holds


@dataclass(frozen=True, eq=False)
class Timeline:
    """When everybody is where, if all drive at one speed and wait as they have to.

    Attributes:
        clock: Way that a combine without any waiting would have driven, shape (k,) [m].
        progress: Stations of all combines, shape (k, combines) [m].
        waits: Way that each would have driven while it waited, without its start delay,
            shape (combines,) [m].
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


def run_timeline(
    lengths: Sequence[float],
    delays: np.ndarray,
    holds: Sequence[Holds],
    step: float,
) -> Timeline:
    """Let all combines drive, one step of the clock at a time.

    Args:
        lengths: Of their paths [m].
        delays: Way that the first one drives before each starts, shape (combines,) [m].
        holds: Who waits for whom; there has to be one that can go on, always.
        step: Of the clock [m].
    """
    ends = np.asarray(lengths, dtype=float)
    begins = np.asarray(delays, dtype=float)
    # If they worked one after the other they would need as long.
    most = int((ends.sum() + begins.max() + 2 * step * len(ends)) / step) + 2
    progress, waits = _drive(ends, begins, pack_holds(holds), float(step), most)
    assert (progress[-1] >= ends).all(), "one can always go on"
    return Timeline(step * np.arange(len(progress)), progress, waits)


@compiled
def _drive(ends, delays, holds, step, most):
    """Stations before each step, and how long each waited."""
    count = len(ends)
    progress = np.zeros((most + 1, count))
    waits = np.zeros(count)
    for k in range(most):
        now = progress[k]
        limits = limits_of(holds, now)
        left = False
        for n in range(count):
            able = min(max((k + 1) * step - delays[n], 0.0), step)
            free = min(limits[n], ends[n])
            after = max(now[n], min(now[n] + able, free))
            if now[n] < ends[n] and free < ends[n]:
                waits[n] += able - (after - now[n])
            progress[k + 1, n] = after
            left = left or after < ends[n]
        if not left:
            return progress[: k + 2], waits
    return progress, waits
