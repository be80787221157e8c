"""Parts of pydrake with the types that its stubs lack."""

from typing import Any

import numpy as np
from pydrake.systems import framework
from pydrake.systems.framework import BasicVector, Context, InputPort, OutputPort

# Templates are made at run time; the stubs do not list them.
LeafSystem_: Any = framework.LeafSystem_
BasicVector_: Any = framework.BasicVector_


# NumPy looks at the floating-point flags after arithmetic on objects, and Drake's symbolic scalars
# leave them set without a NaN in sight: a decorator for what computes with any scalar.
any_scalar = np.errstate(invalid="ignore")


def read(port: InputPort | OutputPort, context: Context) -> np.ndarray:
    """The value of a vector port, shape (size,), as a copy.

    Raises:
        RuntimeError: An input port is not connected.
    """
    return port.Eval(context)  # type: ignore[return-value]  # the stubs say object


def state_vector(values: np.ndarray) -> BasicVector:
    """A model vector for a state, from its initial values."""
    return BasicVector(values)  # type: ignore[call-overload]  # the stubs want a list
