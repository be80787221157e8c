"""The numbers of a system that a Context may change: Drake's numeric parameters, by name."""

from collections import namedtuple
from typing import Any

from pydrake.systems.framework import LeafSystem

from .drake_types import BasicVector_
from .numerics.errors import require_one_of


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
