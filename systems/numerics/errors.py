"""What every bad input raises, and what is missing: one root exception, one form of message.

A message names the parameter, the requirement and what came:
"`speed` must be positive; got -1.0".
"""

import math
from collections.abc import Iterable, Sequence
from importlib.util import find_spec
from numbers import Integral


class SightfieldError(Exception):
    """Root of every error that this package raises on purpose."""


class InvalidInput(SightfieldError, ValueError):
    """An argument, a scenario or a file does not meet a stated requirement."""


def require(condition: bool, name: str, requirement: str, got: object) -> None:
    """Raise InvalidInput "`name` must requirement; got ..." unless the condition holds."""
    if not condition:
        raise InvalidInput(f"`{name}` must {requirement}; got {got}")


def require_type(name: str, value: object, *kinds: type) -> None:
    """Refuse what is of another kind than a parameter is for, before it is asked what it has not.

    Args:
        name: Of the parameter, for the message.
        value: What came.
        kinds: Its class, or those of which one does.

    Raises:
        InvalidInput: The value is no instance of any.
    """
    # What came is put in words only where it is refused: those of a world take milliseconds.
    if not isinstance(value, kinds):
        got = f"{type(value).__name__}: {' '.join(repr(value).split()):.80}"
        wanted = " or ".join(each.__name__ for each in kinds)
        raise InvalidInput(f"`{name}` must be of type {wanted}; got {got}")


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


# Sizes of numbers in SI units or pixels that anything can come of.
LEAST_SIZE, MOST_SIZE = 1e-18, 1e18


def require_sized(name: str, value: float) -> None:
    """Refuse finite numbers, too, whose powers and quotients a float does not hold.

    Args:
        name: Of the parameter, for the message.
        value: What came: to be zero, or of a size between LEAST_SIZE and MOST_SIZE [-].
    """
    require_finite(name, value)
    words = f"be of a size from {LEAST_SIZE:g} to {MOST_SIZE:g}"
    require(value == 0 or LEAST_SIZE <= abs(value) <= MOST_SIZE, name, words, value)


def require_one_of(name: str, value: object, allowed: Iterable[object]) -> None:
    """Refuse values outside a stated list, and print the list.

    Args:
        name: Of the parameter, for the message.
        value: What came.
        allowed: The list.
    """
    choices = list(allowed)
    require(value in choices, name, f"be one of {', '.join(map(str, choices))}", value)


def require_whole(name: str, value: int, least: int) -> None:
    """Refuse what is not a whole number, or below the least.

    Args:
        name: Of the parameter, for the message.
        value: What came, a whole number at best.
        least: The smallest that is allowed.
    """
    # NumPy's whole numbers are no int.
    whole = isinstance(value, Integral) and not isinstance(value, bool) and value >= least
    require(whole, name, f"be a whole number of at least {least}", value)


def require_chance(name: str, value: float) -> None:
    """Refuse what is not a probability.

    Args:
        name: Of the parameter, for the message.
        value: What came, a probability at best.
    """
    require_finite(name, value)
    require(0 <= value <= 1, name, "be from 0 to 1", value)


def require_chances(name: str, values: Sequence[float]) -> None:
    """Refuse lists of probabilities with one that is none.

    Args:
        name: Of the parameter, for the message.
        values: What came.
    """
    for i, value in enumerate(values):
        require_chance(f"{name}[{i}]", value)


class NoPlan(InvalidInput):
    """Every value is in its range, yet no plan was found for such machines on such a field."""


def install_line(extra: str) -> str:
    """What to type to install an extra.

    Args:
        extra: Its name in `pyproject.toml`.
    """
    return f"pip install '.[{extra}]' in the checkout"


def missing_modules(modules: Iterable[str]) -> list[str]:
    """Those of several modules that are not installed.

    Args:
        modules: Their names, dotted too.
    """
    return [name for name in modules if not _is_installed(name)]


def require_extra(what: str, extra: str, modules: Iterable[str]) -> None:
    """Refuse what needs an extra that is not installed.

    Args:
        what: Needs it, as the message names it.
        extra: Its name in `pyproject.toml`.
        modules: By which it is imported.

    Raises:
        InvalidInput: One of them is not installed.
    """
    missing = missing_modules(modules)
    if missing:
        raise InvalidInput(
            f"{what} must come with the extra [{extra}]: {install_line(extra)}; "
            f"not installed: {', '.join(missing)}"
        )


def _is_installed(module: str) -> bool:
    try:
        return find_spec(module) is not None
    except ModuleNotFoundError:
        # Not even the package around it.
        return False
