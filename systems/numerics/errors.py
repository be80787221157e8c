"""What every bad input raises: one root exception, one form of message.

A message names the parameter, the requirement and what came:
"`speed` must be positive; got -1.0".
"""

import math
from collections.abc import Iterable


class SightfieldError(Exception):
    """Root of every error that this package raises on purpose."""


class InvalidInput(SightfieldError, ValueError):
    """An argument, a scenario or a file does not meet a stated requirement."""


def require(condition: bool, name: str, requirement: str, got: object) -> None:
    """Raise InvalidInput "`name` must requirement; got ..." unless the condition holds."""
    if not condition:
        raise InvalidInput(f"`{name}` must {requirement}; got {got}")


def require_finite(name: str, value: float) -> None:
    """Refuse NaN, infinities and things that are not numbers.

    Args:
        name: Of the parameter, for the message.
        value: What came, of any type and unit [-].
    """
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    require(number and math.isfinite(value), name, "be a finite number", value)


def require_positive(name: str, value: float) -> None:
    """Refuse zero, negative and non-finite values.

    Args:
        name: Of the parameter, for the message.
        value: What came, in any unit [-].
    """
    require_finite(name, value)
    require(value > 0, name, "be positive", value)


def require_non_negative(name: str, value: float) -> None:
    """Refuse negative and non-finite values.

    Args:
        name: Of the parameter, for the message.
        value: What came, in any unit [-].
    """
    require_finite(name, value)
    require(value >= 0, name, "be zero or positive", value)


def require_one_of(name: str, value: object, allowed: Iterable[object]) -> None:
    """Refuse values outside a stated list, and print the list.

    Args:
        name: Of the parameter, for the message.
        value: What came.
        allowed: The list.
    """
    choices = list(allowed)
    require(value in choices, name, f"be one of {', '.join(map(str, choices))}", value)
