"""Requirements that several parts of the network share."""

from collections.abc import Sequence

from ...errors import require, require_finite


def require_whole(name: str, value: int, least: int) -> None:
    """Refuse what is not a whole number, or below the least.

    Args:
        name: Of the parameter, for the message.
        value: What came, a whole number at best.
        least: The smallest that is allowed.
    """
    whole = isinstance(value, int) and not isinstance(value, bool) and value >= least
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
