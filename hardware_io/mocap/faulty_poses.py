"""A motion capture that is wrong on demand, to try what watches it."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from .pose_source import PoseReading, PoseSource

PoseFault = Callable[[PoseReading], PoseReading]


class FaultyPoses:
    """Poses of another source, as they are or with a fault.

    Args:
        source: That is right.
    """

    def __init__(self, source: PoseSource) -> None:
        self._source = source
        self._fault: PoseFault | None = None

    def spoil(self, fault: PoseFault) -> None:
        """Let every reading from now on pass through a fault.

        Args:
            fault: Makes a wrong reading of a right one.
        """
        self._fault = fault

    def mend(self) -> None:
        """Tell the truth again."""
        self._fault = None

    def read(self) -> PoseReading:
        """See `PoseSource`."""
        reading, fault = self._source.read(), self._fault
        return reading if fault is None else fault(reading)

    def close(self) -> None:
        """See `PoseSource`."""
        self._source.close()


def swapped(first: int, second: int) -> PoseFault:
    """Two bodies with one another's names.

    Args:
        first, second: Their rows.
    """

    def fault(reading: PoseReading) -> PoseReading:
        rows = np.arange(len(reading.poses))
        rows[[first, second]] = second, first
        return PoseReading(reading.poses[rows], reading.stamps[rows])

    return fault


def displaced(body: int, offset: tuple[float, float, float]) -> PoseFault:
    """A body that is seen elsewhere, or turned.

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
    """A body that is seen in time, always at one pose.

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
    """No frames any more.

    Args:
        last: The reading before.
    """
    return lambda _: last
