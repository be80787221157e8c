"""Parts of pydrake with the types that its stubs lack, and numeric parameters by name."""

from collections import namedtuple
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

import numpy as np

# Part of a compiled module: checkers of types find only its stub.
from pydrake.common.value import AbstractValue as AbstractValue  # pyright: ignore[reportMissingModuleSource]
from pydrake.systems import framework
from pydrake.systems.framework import (
    BasicVector,
    Context,
    DiagramBuilder,
    InputPort,
    LeafSystem,
    System,
)

from .numerics.errors import require, require_one_of

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


class NumericParameters:
    """One numeric parameter of a system, a vector whose entries have names.

    A Context begins with the values that the system was made with. Studies change them there, and
    derivatives by them come from a Context of AutoDiffXd:

        cart = TractorTrailer(Trailer())
        context = cart.CreateDefaultContext()
        cart.parameters.set(context, length=1.2)
        cart.parameters(context).length

    What is set is not checked again.

    Attributes:
        names: Of the entries, in order.
        index: Of the numeric parameter in the Context.
    """

    def __init__(self, system: LeafSystem, scalar: type = float, /, **values: float):
        """Declares the parameter; called while a system is made, at most once.

        Args:
            system: Whose parameter it is.
            scalar: The system's scalar type, T of a template.
            values: The entries' names and default values [in the units that the system says].
        """
        self.names = tuple(values)
        self.index = system.DeclareNumericParameter(
            BasicVector_[scalar]([float(value) for value in values.values()])
        )
        # A tuple with the entries' names, which differ from system to system.
        self._tuple = namedtuple("Parameters", self.names)._make

    def __call__(self, context: Any) -> Any:
        """The values in a Context, as a tuple with names; floats, or the system's scalars."""
        return self._tuple(context.get_numeric_parameter(self.index).CopyToVector().tolist())

    def set(self, context: Any, **values: Any) -> None:
        """Set entries in a Context.

        Args:
            context: The system's own, by `GetMyMutableContextFromRoot` in a diagram.
            values: By name; the others stay.

        Raises:
            InvalidInput: The system has no parameter of that name.
        """
        vector = context.get_mutable_numeric_parameter(self.index)
        for name, value in values.items():
            require_one_of("parameter", name, self.names)
            vector.SetAtIndex(self.names.index(name), value)


def with_scalars(record: Any, **values: Any) -> Any:
    """A copy of a frozen dataclass with other numbers, of any scalar type.

    Its methods then compute with them; its checks, which compare numbers, are not made.

    Args:
        record: Of the dataclass.
        values: Of fields, by name; the others stay.
    """
    found = object.__new__(type(record))
    vars(found).update(vars(record), **values)
    return found
