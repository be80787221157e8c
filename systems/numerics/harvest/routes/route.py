"""Routes, and what they lead to."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .way import Way

# Where the tractor is to be at times, shape (n,) [s]: x, y, theta, shape (n, 3); NaN: nowhere.
Meeting = Callable[[np.ndarray], np.ndarray]


def staying_at(pose: np.ndarray) -> Meeting:
    """A meeting at one pose, shape (3,), at any time."""
    return lambda times: np.tile(pose, (len(times), 1))


@dataclass(frozen=True)
class Route:
    """A way, and when to set out.

    Attributes:
        way: To drive.
        depart: When [s].
        arrive: When it is driven [s].
    """

    way: Way
    depart: float
    arrive: float
