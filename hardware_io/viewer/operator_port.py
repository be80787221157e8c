"""What the operator wants, as a port."""

from typing import Protocol

import numpy as np
from pydrake.systems.framework import LeafSystem

from ...systems.drake_types import state_vector
from ...systems.numerics.errors import require_positive


class Attends(Protocol):
    """Something that knows what the operator wants."""

    starts_said: int

    @property
    def mode(self) -> float:
        """Number of the mode: 1 to run, 0 for a pause, -1 for an emergency stop."""
        ...

    @property
    def view_age(self) -> float:
        """Since the operator's view was last heard [s]; 0 without one."""
        ...


class OperatorPort(LeafSystem):
    """Samples what the operator wants at its ticks.

    .. pydrake_system::

        name: OperatorPort
        input_ports: []
        output_ports:
        - mode
        - starts_said
        - view_age

    ===========  ====  ====  =====  ===========
    port         size  unit  frame  feedthrough
    ===========  ====  ====  =====  ===========
    mode         1     -     -      -
    starts_said  1     -     -      -
    view_age     1     s     -      -
    ===========  ====  ====  =====  ===========

    `mode` is 1 to run, 0 for a pause, -1 for an emergency stop; `starts_said` is how often the
    operator has said start, and `view_age` how long the operator's view has been silent, 0 without
    one.

    Source: the user interface of Zhang 2014, 2.2.8, Figure 2.24.

    Args:
        operator: Whose.
        period: Between ticks [s].

    Raises:
        InvalidInput: The period is not positive.
    """

    def __init__(self, operator: Attends, *, period: float):
        super().__init__()
        require_positive("period", period)
        self._operator = operator
        self._states = [self.DeclareDiscreteState(state_vector(np.zeros(1))) for _ in range(3)]
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._sample)
        for name, state in zip(("mode", "starts_said", "view_age"), self._states, strict=True):
            self.DeclareStateOutputPort(name, state)

    def _sample(self, context, discrete_state):
        operator = self._operator
        values = (operator.mode, operator.starts_said, operator.view_age)
        for state, value in zip(self._states, values, strict=True):
            discrete_state.set_value(state, np.array([float(value)]))
