"""Recorded samples of a port, in place of the device that gave them."""

import numpy as np
from numpy.typing import ArrayLike
from pydrake.systems.framework import LeafSystem

from ..drake_types import state_vector
from ..numerics.errors import require, require_positive


class SamplePlayer(LeafSystem):
    """Shows one sample after another, a tick each, and the last one ever after.

    As the receivers do, it changes in the update at the tick: what looks at the moment of the
    tick itself still sees the sample before, as it did when the samples were recorded.

    .. pydrake_system::

        name: SamplePlayer
        input_ports: []
        output_ports:
        - sample

    ======  ====  ====  =====  ===========
    port    size  unit  frame  feedthrough
    ======  ====  ====  =====  ===========
    sample  n     any   any    -
    ======  ====  ====  =====  ===========

    Source: ours.

    Args:
        samples: One row for each tick, shape (T, n).
        initial: What is shown before the first tick, shape (n,).
        period: Between ticks [s].

    Raises:
        InvalidInput: There are no samples, or the period is not positive.
    """

    def __init__(self, samples: ArrayLike, initial: ArrayLike, *, period: float):
        super().__init__()
        self._samples = np.asarray(samples, dtype=float)
        shape = self._samples.shape
        require(len(shape) == 2 and shape[0] > 0, "samples", "have shape (T, n), T > 0", shape)
        require_positive("period", period)
        self._period = float(period)
        self._shown = self.DeclareDiscreteState(state_vector(np.asarray(initial, dtype=float)))
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._advance)
        self.DeclareStateOutputPort("sample", self._shown)

    def _advance(self, context, discrete_state):
        tick = round(context.get_time() / self._period)
        row = self._samples[min(tick, len(self._samples) - 1)]
        discrete_state.set_value(self._shown, row)
