"""A record of arrays that a system keeps from tick to tick, as discrete states of its Context."""

from typing import Any, Generic, TypeVar

import numpy as np
from pydrake.systems.framework import LeafSystem

from ..drake_types import state_vector

Record = TypeVar("Record", bound=tuple)


class KeptRecord(Generic[Record]):
    """One discrete state for each array of a record.

    Args:
        system: Whose states they are; they are declared at once.
        initial: The record before the first tick, a NamedTuple of arrays of any shape.
    """

    def __init__(self, system: LeafSystem, initial: Record) -> None:
        self._make: Any = type(initial)
        self._shapes = [part.shape for part in initial]
        self._states = [system.DeclareDiscreteState(state_vector(part.ravel())) for part in initial]

    def read(self, context: Any) -> Record:
        """The record as it was left at the last tick.

        Args:
            context: Of the system.
        """
        return self._make(
            *(
                context.get_discrete_state(state).value().reshape(shape)
                for state, shape in zip(self._states, self._shapes, strict=True)
            )
        )

    def write(self, discrete_state: Any, record: Record) -> None:
        """Leave a record for the next tick.

        Args:
            discrete_state: That an update is given.
            record: Arrays of the same shapes.
        """
        for state, value in zip(self._states, record, strict=True):
            discrete_state.set_value(state, np.asarray(value).ravel())
