"""The one interface behind which every motion capture stands."""

import threading
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ...systems.numerics.errors import require


@dataclass(frozen=True, eq=False)
class PoseReading:
    """The newest that is known.

    Attributes:
        poses: x, y [m], heading [rad] of each body, shape (N, 3); zeros before it is seen.
        stamps: When each was last seen, by `time.monotonic()`, shape (N,) [s]; minus infinity if
            never.
    """

    poses: np.ndarray
    stamps: np.ndarray


class PoseSource(Protocol):
    """Something that knows where bodies are."""

    def read(self) -> PoseReading:
        """The newest poses, at once; bodies that are not seen keep their last."""
        ...

    def close(self) -> None:
        """Let go of the device."""
        ...


class NewestPoses:
    """The newest pose of each body, written by one thread and read by another.

    Args:
        bodies: Their names, in the order of the rows.

    Raises:
        InvalidInput: There is none, or two have one name.
    """

    def __init__(self, bodies: Sequence[str]):
        require(len(bodies) > 0, "bodies", "name at least one body", "none")
        require(len(set(bodies)) == len(bodies), "bodies", "differ in name", list(bodies))
        self._row = {name: row for row, name in enumerate(bodies)}
        self._poses = np.zeros((len(bodies), 3))
        self._stamps = np.full(len(bodies), -np.inf)
        self._lock = threading.Lock()

    def see(self, body: str, pose: Sequence[float], stamp: float) -> None:
        """Take note of a body; other bodies, and poses that are no numbers, do not count.

        Args:
            body: Its name.
            pose: x, y [m], heading [rad].
            stamp: When, by `time.monotonic()` [s].
        """
        row = self._row.get(body)
        if row is None or len(pose) != 3 or not np.isfinite(pose).all():
            return
        with self._lock:
            self._poses[row], self._stamps[row] = pose, stamp

    def read(self) -> PoseReading:
        """A copy of what is known."""
        with self._lock:
            return PoseReading(self._poses.copy(), self._stamps.copy())
