"""Where a condition that holds up to some factor ceases to hold."""

import math
from collections.abc import Callable


def last_factor(
    holds: Callable[[float], bool], low: float, high: float, accuracy: float, most: float
) -> tuple[float, float]:
    """Two factors close together, of which the condition holds at the first alone.

    Both are infinite if it still holds beyond `most`.

    Args:
        holds: The condition; it holds at `low`, and nowhere beyond where it first does not.
        low: Where the search begins [-].
        high: The first factor that is tried; it is doubled while the condition holds [-].
        accuracy: By which part of the second the two may differ at the end [-].
        most: A factor beyond which nobody asks [-].
    """
    while holds(high):
        if high > most:
            return math.inf, math.inf
        low, high = high, 2.0 * high
    while high - low > accuracy * high:
        middle = (low + high) / 2
        low, high = (middle, high) if holds(middle) else (low, middle)
    return low, high
