"""Requirements that several parts of the network share."""

from collections.abc import Sequence

from ...errors import require, require_finite


def require_whole(name: str, value: int, least: int) -> None:
    """Refuse what is not a whole number, or below the least."""
    whole = isinstance(value, int) and not isinstance(value, bool) and value >= least
    require(whole, name, f"be a whole number of at least {least}", value)


def require_chance(name: str, value: float) -> None:
    """Refuse what is not a probability."""
    require_finite(name, value)
    require(0 <= value <= 1, name, "be from 0 to 1", value)


def require_chances(name: str, values: Sequence[float]) -> None:
    """Refuse lists of probabilities with one that is none."""
    for i, value in enumerate(values):
        require_chance(f"{name}[{i}]", value)
