"""Poses out of a recorded run, played at the pace at which they were recorded."""

import time
from collections.abc import Callable

import numpy as np

from ...systems.numerics.errors import require
from ..recording.run_log import RunLog
from .pose_source import PoseReading


class RecordedPoses:
    """The poses of a log, as if they came now; after its end they grow old.

    Args:
        log: With poses and ages of the robots.
        teams: Prefixes of its ports, in the order of the rows.
        clock: By which it is played, from this moment on [s].

    Raises:
        InvalidInput: The log has no poses of these teams.
    """

    def __init__(
        self,
        log: RunLog,
        teams: tuple[str, ...] = ("pursuer", "evader"),
        *,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        for team in teams:
            known = len(log.times) > 0 and f"{team}.poses" in log.samples
            require(known, "log", f"have {team}.poses", sorted(log.samples))
            poses, ages = log.samples[f"{team}.poses"], log.samples.get(f"{team}.age")
            good = ages is not None and poses.shape[1] == 3 * ages.shape[1]
            require(good, "log", f"have {team}.age of each robot", sorted(log.samples))
        self._poses = np.concatenate([log.samples[f"{team}.poses"] for team in teams], axis=1)
        self._ages = np.concatenate([log.samples[f"{team}.age"] for team in teams], axis=1)
        self._times = log.times - log.times[0]
        self._clock, self._start = clock, clock()

    def read(self) -> PoseReading:
        """See `PoseSource`."""
        elapsed = self._clock() - self._start
        row = max(int(np.searchsorted(self._times, elapsed + 1e-9, side="right")) - 1, 0)
        stamps = self._start + self._times[row] - self._ages[row]
        return PoseReading(self._poses[row].reshape(-1, 3), stamps)

    def close(self) -> None:
        """Nothing is held."""
