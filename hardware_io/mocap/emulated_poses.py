"""The motion capture of an emulated laboratory."""

import threading
import time
from typing import Protocol

import numpy as np

from ...systems.numerics.errors import SightfieldError
from .pose_source import PoseReading


class Laboratory(Protocol):
    """Something that knows where its robots really are."""

    def poses(self) -> np.ndarray:
        """Poses, shape (N, 3) [m], [m], [rad]."""
        ...


class EmulatedPoses:
    """A camera system over an emulated laboratory, with a rate of its own.

    Args:
        laboratory: Which.
        rate: Frames a second [1/s].
    """

    def __init__(self, laboratory: Laboratory, *, rate: float = 100.0) -> None:
        self._laboratory = laboratory
        self._frame = self._look()
        self._failure: SightfieldError | None = None
        self._frozen = threading.Event()
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, args=(1.0 / rate,), daemon=True)
        self._thread.start()

    def _look(self) -> PoseReading:
        poses = np.array(self._laboratory.poses(), dtype=float)
        return PoseReading(poses, np.full(len(poses), time.monotonic()))

    def _run(self, period: float) -> None:
        while not self._ended.wait(period):
            if not self._frozen.is_set():
                try:
                    self._frame = self._look()
                except SightfieldError as error:
                    self._failure = error
                    return

    def freeze(self) -> None:
        """Send no more frames, as a system does whose cable is pulled."""
        self._frozen.set()

    def thaw(self) -> None:
        """Send frames again."""
        self._frozen.clear()

    def read(self) -> PoseReading:
        """See `PoseSource`.

        Raises:
            SightfieldError: The laboratory has failed, at this moment or before.
        """
        if self._failure is not None:
            raise self._failure
        return self._frame

    def close(self) -> None:
        """End the thread that looks."""
        self._ended.set()
        self._thread.join()
