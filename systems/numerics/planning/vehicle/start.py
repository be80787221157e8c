"""Where a cart may start."""

import math
from collections.abc import Sequence

import numpy as np

from ...errors import InvalidInput, require, require_finite
from ..ranges import require_plannable_cart
from ..trailer import Trailer


def checked_start(trailer: Trailer, start: Sequence[float]) -> np.ndarray:
    """The start as an array, shape (4,), after refusing what cannot be one.

    Raises:
        InvalidInput: It is not x, y, theta and beta, finite, with beta within the jackknife limit,
            or the cart is none that planners can compute with.
    """
    try:
        entries = [float(value) for value in start]
    except (TypeError, ValueError):
        raise InvalidInput(f"`start` must be four numbers; got {start}") from None
    require(len(entries) == 4, "start", "be (x, y, theta, beta)", start)
    for value in entries:
        require_finite("start", value)
    require_plannable_cart(trailer)
    bent = abs(math.remainder(start[3], math.tau))
    require(bent <= trailer.jackknife, "start", "have |beta| within jackknife", start[3])
    return np.array(start, dtype=float)
