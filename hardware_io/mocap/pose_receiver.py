"""Poses of robots, from a motion capture system into a diagram."""

import time
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike
from pydrake.systems.framework import LeafSystem

from ...systems.drake_types import state_vector
from ...systems.numerics.errors import require, require_positive
from ...systems.numerics.station.freshness import freshness
from .pose_source import PoseSource


class PoseReceiver(LeafSystem):
    """Samples a pose source at its ticks, and says which poses are still good.

    A pose older than the limit is invalid; it stays where it was last seen, or at the start if it
    never was. Ages are by the clock of the wall, and so are what the diagram's time cannot know.

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

    `stamp` is the time at which a pose was seen, by the source's clock, from the diagram's time at
    the first tick on: ticks that come late do not change it. Minus infinity if never.

    Source: the Vicon system of Zhang 2014, 2.2.8.

    Args:
        source: Where poses come from.
        starts: Poses to go on with until a robot is seen, shape (N, 3).
        period: Between ticks [s].
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
        # What the clock says at the diagram's time zero [s], from the first tick on.
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
