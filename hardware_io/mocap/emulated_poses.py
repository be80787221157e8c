"""The motion capture of an emulated laboratory."""

import time
from typing import Protocol

import numpy as np

from .pose_source import PoseReading

# A laboratory that is behind the wall clock by more is given time to catch up, so long at most [s].
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

    A pose has the stamp of the moment at which the robot was there. Real robots do not wait for a
    busy machine: a laboratory that is behind is waited for, some ticks at most.

    Args:
        laboratory: Which.
        rate: Frames a second at most [1/s].
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
        """Send no more frames, as a system does whose cable is pulled."""
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
