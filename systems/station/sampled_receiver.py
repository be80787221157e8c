"""What a station receives, as it stood at the last tick."""

import numpy as np
from numpy.typing import ArrayLike
from pydrake.systems.framework import LeafSystem

from ..drake_types import read, state_vector
from ..numerics.errors import require_positive
from ..numerics.station.freshness import freshness


class SampledReceiver(LeafSystem):
    """Samples what a channel has received, and says how old it is and whether it is still good.

    .. pydrake_system::

        name: SampledReceiver
        input_ports:
        - received
        - arrival_stamp
        output_ports:
        - value
        - valid
        - age
        - stamp

    =============  =======  ====  =====  ===========
    port           size     unit  frame  feedthrough
    =============  =======  ====  =====  ===========
    received       N width  any   any    -
    arrival_stamp  N        s     -      -
    value          N width  any   any    -
    valid          N        -     -      -
    age            N        s     -      -
    stamp          N        s     -      -
    =============  =======  ====  =====  ===========

    `valid` is 1 for a member whose sample is younger than the limit, else 0.

    Source: ours.

    Args:
        initial: Values before the first tick, shape (N, width).
        period: Between ticks [s].
        stale_after: Age up to which a sample is valid [s].

    Raises:
        InvalidInput: A number is not positive.
    """

    def __init__(self, initial: ArrayLike, *, period: float, stale_after: float):
        super().__init__()
        require_positive("period", period)
        require_positive("stale_after", stale_after)
        values = np.asarray(initial, dtype=float)
        count = len(values)
        self._limit = float(stale_after)
        self._received = self.DeclareVectorInputPort("received", values.size)
        self._arrival = self.DeclareVectorInputPort("arrival_stamp", count)
        self._value = self.DeclareDiscreteState(state_vector(values.ravel()))
        self._valid = self.DeclareDiscreteState(state_vector(np.zeros(count)))
        self._age = self.DeclareDiscreteState(state_vector(np.full(count, np.inf)))
        self._stamp = self.DeclareDiscreteState(state_vector(np.full(count, -np.inf)))
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._sample)
        self.DeclareStateOutputPort("value", self._value)
        self.DeclareStateOutputPort("valid", self._valid)
        self.DeclareStateOutputPort("age", self._age)
        self.DeclareStateOutputPort("stamp", self._stamp)

    def _sample(self, context, discrete_state):
        stamps = read(self._arrival, context)
        valid, ages = freshness(context.get_time(), stamps, self._limit)
        discrete_state.set_value(self._value, read(self._received, context))
        discrete_state.set_value(self._valid, valid)
        discrete_state.set_value(self._age, ages)
        discrete_state.set_value(self._stamp, stamps)
