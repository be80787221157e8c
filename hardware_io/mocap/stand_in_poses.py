"""Poses without cameras: from an emulated laboratory, from a recording, and with faults."""

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Protocol

import numpy as np

from ...systems.numerics.errors import require
from ..recording.run_log import RunLog
from .pose_receiver import PoseReading, PoseSource

# A laboratory that lags the wall clock by more than this is waited for, and how long at most [s].
_BEHIND, _PATIENCE = 0.02, 0.1


class Seen(Protocol):
    """What a camera sees."""

    @property
    def moment(self) -> float:
        """When, by time.monotonic [s]."""
        ...

    @property
    def poses(self) -> np.ndarray:
        """Where robots are then, shape (N, 3) [m], [m], [rad]."""
        ...


class Laboratory(Protocol):
    """Something that knows where its robots really are."""

    def snapshot(self) -> Seen:
        """The newest that it knows."""
        ...


class EmulatedPoses:
    """A camera system over an emulated laboratory, with a rate of its own.

    A pose is stamped with the time at which the robot was there. Real robots do not lag on a busy
    machine; so a laboratory that lags is waited for, up to a limit.

    Args:
        laboratory: Laboratory whose robots are seen.
        rate: Greatest frame rate [1/s].
    """

    def __init__(self, laboratory: Laboratory, *, rate: float = 100.0) -> None:
        self._laboratory, self._period = laboratory, 1.0 / rate
        self._frozen = False
        self._frame = self._look()

    def _look(self) -> PoseReading:
        end = time.monotonic() + _PATIENCE
        while True:
            seen, now = self._laboratory.snapshot(), time.monotonic()
            if now - seen.moment < _BEHIND or now > end:
                poses = np.array(seen.poses, dtype=float)
                return PoseReading(poses, np.full(len(poses), seen.moment))
            time.sleep(0.001)

    def freeze(self) -> None:
        """Send no more frames, like a system whose cable is pulled."""
        self._frozen = True

    def thaw(self) -> None:
        """Send frames again."""
        self._frozen = False

    def read(self) -> PoseReading:
        """See `PoseSource`.

        Raises:
            SightfieldError: The laboratory has failed.
        """
        if not self._frozen:
            frame = self._look()
            if frame.stamps.max() >= self._frame.stamps.max() + self._period:
                self._frame = frame
        return self._frame

    def close(self) -> None:
        """Nothing is held."""


class RecordedPoses:
    """The poses of a log, as if they came now; after its end they grow old.

    Args:
        log: Log with poses and ages of the robots.
        teams: Prefixes of its ports, in the order of the rows.
        clock: Clock that times the replay, starting now [s].

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


PoseFault = Callable[[PoseReading], PoseReading]


class FaultyPoses:
    """Poses of another source, as they are or with a fault.

    Args:
        source: Source of the true poses.
    """

    def __init__(self, source: PoseSource) -> None:
        self._source = source
        self._fault: PoseFault | None = None

    def spoil(self, fault: PoseFault) -> None:
        """Apply a fault to every reading from now on.

        Args:
            fault: Maps a right reading to a wrong one.
        """
        self._fault = fault

    def mend(self) -> None:
        """Remove the fault."""
        self._fault = None

    def read(self) -> PoseReading:
        """See `PoseSource`."""
        reading, fault = self._source.read(), self._fault
        return reading if fault is None else fault(reading)

    def close(self) -> None:
        """See `PoseSource`."""
        self._source.close()


def swapped(first: int, second: int) -> PoseFault:
    """Fault by which two bodies are confused with each other.

    Args:
        first, second: Their rows.
    """

    def fault(reading: PoseReading) -> PoseReading:
        rows = np.arange(len(reading.poses))
        rows[[first, second]] = second, first
        return PoseReading(reading.poses[rows], reading.stamps[rows])

    return fault


def displaced(body: int, offset: tuple[float, float, float]) -> PoseFault:
    """Fault by which a body is seen displaced or turned.

    Args:
        body: Its row.
        offset: Added to its pose [m], [m], [rad].
    """

    def fault(reading: PoseReading) -> PoseReading:
        poses = reading.poses.copy()
        poses[body] += offset
        return replace(reading, poses=poses)

    return fault


def stuck(body: int, pose: np.ndarray) -> PoseFault:
    """Fault by which a body is always seen at one pose, with fresh stamps.

    Args:
        body: Its row.
        pose: x, y, heading, shape (3,) [m], [m], [rad].
    """

    def fault(reading: PoseReading) -> PoseReading:
        poses = reading.poses.copy()
        poses[body] = pose
        return replace(reading, poses=poses)

    return fault


def frozen(last: PoseReading) -> PoseFault:
    """Fault by which no new frames come.

    Args:
        last: The reading before.
    """
    return lambda _: last
