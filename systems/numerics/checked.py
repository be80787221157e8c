"""Fields whose types say what values they take, and dataclasses that are held to that when made.

    @dataclass(frozen=True, kw_only=True)
    class Lens(Checked):
        # Above the floor [m].
        height: Positive = 0.16

A rule is a function of a field's name and value that raises InvalidInput; it stands in the type,
as in `Annotated[str, one_of(MODELS)]`. Rules on several fields at once stand in `__post_init__`,
after `super().__post_init__()`.
"""

from collections.abc import Callable, Collection
from dataclasses import fields
from functools import cache
from itertools import chain
from typing import Annotated, Any

from .errors import (
    require,
    require_chance,
    require_finite,
    require_non_negative,
    require_one_of,
    require_positive,
    require_sized,
    require_whole,
)

Rule = Callable[[str, Any], object]

# No floor, field or machine has more of anything, in SI units or pixels: more is a slip.
MOST = 1e9
# Nothing drives faster [m/s], and no game is played for longer than a day [s].
FASTEST, LONGEST = 100.0, 86_400.0


def at_most(most: float, unit: str = "") -> Rule:
    """The rule that a number is not too large, whatever its sign.

    Args:
        most: The largest that is allowed [unit].
        unit: For the message.

    Raises:
        InvalidInput: By the rule, for one that is.
    """
    words = f"be at most {most:g} {unit}".rstrip()
    return lambda name, value: require(abs(value) <= most, name, words, value)


_has_measure = at_most(MOST)

Finite = Annotated[float, require_finite, _has_measure]
# Zero, or of a size whose powers and quotients a float holds.
Sized = Annotated[float, require_sized]
Positive = Annotated[float, require_positive, _has_measure]
PositiveSized = Annotated[float, require_positive, require_sized]
NonNegative = Annotated[float, require_non_negative, _has_measure]
NonNegativeSized = Annotated[float, require_non_negative, require_sized]
Chance = Annotated[float, require_chance]
# What is computed step by step, or goes so far in each.
Speed = Annotated[float, require_positive, at_most(FASTEST, "m/s")]
Duration = Annotated[float, require_positive, at_most(LONGEST, "s")]


class Checked:
    """Base of dataclasses that refuse values against the rules in their fields' types.

    Raises:
        InvalidInput: A value is out of its range.
    """

    def __post_init__(self) -> None:
        for name, rule in _rules(type(self)):
            rule(name, getattr(self, name))


# Some are made in every run of a study.
@cache
def _rules(kind: Any) -> list[tuple[str, Rule]]:
    """The rules of a dataclass in the order of its fields, each with its field's name."""
    return [
        (each.name, rule)
        for each in fields(kind)
        for rule in getattr(each.type, "__metadata__", ())
        if callable(rule)
    ]


def one_of(*allowed: Collection[object]) -> Rule:
    """The rule that a value stands in a list, as the list is when the rule is asked.

    Args:
        allowed: The list, or several. What is added to one later, as a rule of one's own to the
            rules of assignment, may be chosen too.

    Raises:
        InvalidInput: By the rule, for a value that does not.
    """
    return lambda name, value: require_one_of(name, value, chain(*allowed))


def at_least(least: int) -> Rule:
    """The rule that a number is large enough.

    Args:
        least: The smallest that is allowed.

    Raises:
        InvalidInput: By the rule, for one that is not.
    """
    return lambda name, value: require(value >= least, name, f"be at least {least}", value)


def whole(least: int) -> Rule:
    """The rule that a number is whole, and large enough.

    Args:
        least: The smallest that is allowed.

    Raises:
        InvalidInput: By the rule, for one that is not.
    """
    return lambda name, value: require_whole(name, value, least)


def _not_below_zero(name: str, value: int) -> None:
    require(value >= 0, name, "be zero or positive", value)


# Of seeds and numbers of things, which NumPy may have drawn.
Count = Annotated[int, _not_below_zero]
