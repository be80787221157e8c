"""Many tests at once: p-values that keep the chance of any false alarm below the level."""

import numpy as np
from numpy.typing import ArrayLike

from ..errors import require


def holm(p_values: ArrayLike) -> np.ndarray:
    """Holm's step-down adjustment.

    The i-th smallest of m p-values becomes the largest of (m - k + 1) p_(k) for k up to i, at
    most 1. Rejecting where the result is at most alpha keeps the family-wise error below alpha,
    whatever the tests have to do with each other.

    Args:
        p_values: Shape (m,), in [0, 1].

    Returns:
        Adjusted p-values in the order given, shape (m,).

    Raises:
        InvalidInput: A value is no probability.

    Source: Holm, Scandinavian Journal of Statistics 6 (1979).
    """
    raw = np.asarray(p_values, dtype=float)
    fine = raw.ndim == 1 and bool(((raw >= 0.0) & (raw <= 1.0)).all())
    require(fine, "p_values", "be probabilities", raw)
    order = np.argsort(raw, kind="stable")
    factors = len(raw) - np.arange(len(raw))
    adjusted = np.empty_like(raw)
    adjusted[order] = np.minimum(np.maximum.accumulate(factors * raw[order]), 1.0)
    return adjusted
