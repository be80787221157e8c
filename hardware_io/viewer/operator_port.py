"""What the operator wants, as a port."""

from typing import Protocol

import numpy as np
from pydrake.systems.framework import LeafSystem

from ...systems.drake_types import state_vector
from ...systems.numerics.errors import require_positive


class HasMode(Protocol):
    """Something that knows the operator's mode."""

    @property
    def mode(self) -> float:
        """Number of the mode: 1 to run, 0 for a pause, -1 for an emergency stop."""
        ...


class OperatorPort(LeafSystem):
    """Samples the operator's mode at its ticks.

    .. pydrake_system::

        name: OperatorPort
        input_ports: []
        output_ports:
        - mode

    ====  ====  ====  =====
    port  size  unit  frame
    ====  ====  ====  =====
    mode  1     -     -
    ====  ====  ====  =====

    `mode` is 1 to run, 0 for a pause, -1 for an emergency stop.

    Source: the user interface of Zhang 2014, 2.2.8, Figure 2.24.

    Args:
        operator: Whose.
        period: Between ticks [s].

    Raises:
        InvalidInput: The period is not positive.
    """

    def __init__(self, operator: HasMode, *, period: float):
        super().__init__()
        require_positive("period", period)
        self._operator = operator
        self._mode = self.DeclareDiscreteState(state_vector(np.zeros(1)))
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._sample)
        self.DeclareStateOutputPort("mode", self._mode)

    def _sample(self, context, discrete_state):
        discrete_state.set_value(self._mode, np.array([self._operator.mode]))
