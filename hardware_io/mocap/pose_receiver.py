"""Robots' poses: the interface common to all motion capture, and the input to a diagram."""

import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike
from pydrake.systems.framework import LeafSystem

from ...systems.drake_parts import state_vector
from ...systems.numerics.errors import require, require_positive
from ...systems.numerics.station.channel import freshness


@dataclass(frozen=True, eq=False)
class PoseReading:
    """The newest known poses.

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
        """Return the newest poses without waiting; a body not seen now keeps its last pose."""
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
        """Store the pose of a body; unknown bodies, and poses that are not finite, are ignored.

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


class PoseReceiver(LeafSystem):
    """Samples a pose source periodically, and outputs which poses are still valid.

    A pose older than the limit is invalid; it stays where it was last seen, or at the start if it
    never was. Ages are measured by `clock`, not by the diagram's time.

    .. pydrake_system::

        name: PoseReceiver
        input_ports: []
        output_ports:
        - poses
        - valid
        - age
        - stamp

    =====  ====  =========  =====  ===========
    port   size  unit       frame  feedthrough
    =====  ====  =========  =====  ===========
    poses  3 N   m, m, rad  world  -
    valid  N     -          -      -
    age    N     s          -      -
    stamp  N     s          -      -
    =====  ====  =========  =====  ===========

    `stamp` is the time at which a pose was seen, minus infinity if never. It is the source's stamp
    shifted by an offset to diagram time, fixed at the first tick, so that late ticks do not
    change it.

    Source: the Vicon system of Zhang 2014, 2.2.8.

    Args:
        source: Where poses come from.
        starts: Poses to output until a robot is first seen, shape (N, 3).
        period: Time between samples [s].
        stale_after: Age up to which a pose is valid [s].
        clock: The clock of the source's stamps [s].

    Raises:
        InvalidInput: A number is not positive, or the source has other bodies than `starts`.
    """

    def __init__(
        self,
        source: PoseSource,
        starts: ArrayLike,
        *,
        period: float,
        stale_after: float,
        clock: Callable[[], float] = time.monotonic,
    ):
        super().__init__()
        require_positive("period", period)
        require_positive("stale_after", stale_after)
        initial = np.asarray(starts, dtype=float)
        bodies = len(source.read().stamps)
        require(initial.shape == (bodies, 3), "starts", f"have shape ({bodies}, 3)", initial.shape)
        self._source, self._clock, self._limit = source, clock, float(stale_after)
        # Reading of the clock at the diagram's time zero [s]; set at the first tick.
        self._zero: float | None = None
        self._poses = self.DeclareDiscreteState(state_vector(initial.ravel()))
        self._valid = self.DeclareDiscreteState(state_vector(np.zeros(bodies)))
        self._age = self.DeclareDiscreteState(state_vector(np.full(bodies, np.inf)))
        self._stamp = self.DeclareDiscreteState(state_vector(np.full(bodies, -np.inf)))
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._sample)
        self.DeclareStateOutputPort("poses", self._poses)
        self.DeclareStateOutputPort("valid", self._valid)
        self.DeclareStateOutputPort("age", self._age)
        self.DeclareStateOutputPort("stamp", self._stamp)

    def _sample(self, context, discrete_state):
        reading, now = self._source.read(), self._clock()
        if self._zero is None:
            self._zero = now - context.get_time()
        valid, ages = freshness(now, reading.stamps, self._limit)
        last = context.get_discrete_state(self._poses).value().reshape(-1, 3)
        seen = np.isfinite(reading.stamps)[:, None]
        discrete_state.set_value(self._poses, np.where(seen, reading.poses, last).ravel())
        discrete_state.set_value(self._valid, valid)
        discrete_state.set_value(self._age, ages)
        discrete_state.set_value(self._stamp, reading.stamps - self._zero)
