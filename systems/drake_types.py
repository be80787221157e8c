"""Parts of pydrake with the types that its stubs lack."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

import numpy as np

# Part of a compiled module: checkers of types find only its stub.
from pydrake.common.value import AbstractValue as AbstractValue  # pyright: ignore[reportMissingModuleSource]
from pydrake.systems import framework
from pydrake.systems.framework import BasicVector, Context, DiagramBuilder, InputPort, System

from .numerics.errors import require

Named = TypeVar("Named", bound=System)

# Templates are made at run time; the stubs do not list them.
LeafSystem_: Any = framework.LeafSystem_
BasicVector_: Any = framework.BasicVector_


def any_scalar(scalar: type) -> Callable[[Callable], Callable]:
    """A decorator for methods of a template that compute with its scalar.

    NumPy looks at the floating-point flags after arithmetic on objects, and Drake's symbolic
    scalars leave them set without a NaN in sight: that is no reason for a warning.
    """
    return (lambda method: method) if scalar is float else np.errstate(invalid="ignore")


def add_named(builder: DiagramBuilder, name: str, system: Named) -> Named:
    """Add a system to a diagram by a name that no other one in it has, and return it.

    Two of one name break the diagram off when it is built, with all of Python.

    Args:
        builder: Of the diagram.
        name: For the system.
        system: What is added.

    Raises:
        InvalidInput: The diagram has a system of that name.
    """
    require(not builder.HasSubsystemNamed(name), "builder", f"have no system {name} yet", "one")
    builder.AddNamedSystem(name, system)
    return system


def default_instance(template: Any) -> Any:
    """The instance of a template for float, `template[None]`.

    pydrake looks at every frame of the stack when it makes one, and at every module for each frame
    of an import; within nested imports that takes as long as importing all else. So a thread makes
    it, whose stack is short.

    Args:
        template: Of systems, by `TemplateSystem.define`.
    """
    with ThreadPoolExecutor(1) as thread:
        return thread.submit(template.__getitem__, None).result()


# read(port, context): the value of an input port of a float system, shape (size,), as a copy.
# Bound here without a wrapper, because a team reads some thirty ports in each step.
read: Callable[[InputPort, Context], np.ndarray]
read = InputPort.Eval  # type: ignore[assignment]  # the stubs say object


def state_vector(values: np.ndarray) -> BasicVector:
    """A model vector for a state, from its initial values, shape (size,)."""
    return BasicVector(values)  # type: ignore[call-overload]  # the stubs want a list
