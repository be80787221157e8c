"""Parts of pydrake with the types that its stubs lack."""

from collections.abc import Callable
from typing import Any

import numpy as np

# Part of a compiled module: checkers of types find only its stub.
from pydrake.common.value import AbstractValue as AbstractValue  # pyright: ignore[reportMissingModuleSource]
from pydrake.systems import framework
from pydrake.systems.framework import BasicVector, Context, InputPort

# Templates are made at run time; the stubs do not list them.
LeafSystem_: Any = framework.LeafSystem_
BasicVector_: Any = framework.BasicVector_


def any_scalar(scalar: type) -> Callable[[Callable], Callable]:
    """A decorator for methods of a template that compute with its scalar.

    NumPy looks at the floating-point flags after arithmetic on objects, and Drake's symbolic
    scalars leave them set without a NaN in sight: that is no reason for a warning.
    """
    return (lambda method: method) if scalar is float else np.errstate(invalid="ignore")


# read(port, context): the value of an input port of a float system, shape (size,), as a copy.
# Bound here without a wrapper, because a team reads some thirty ports in each step.
read: Callable[[InputPort, Context], np.ndarray]
read = InputPort.Eval  # type: ignore[assignment]  # the stubs say object


def state_vector(values: np.ndarray) -> BasicVector:
    """A model vector for a state, from its initial values, shape (size,)."""
    return BasicVector(values)  # type: ignore[call-overload]  # the stubs want a list
