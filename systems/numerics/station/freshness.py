"""How old what is known of each member is, and whether that is still good for anything."""

import numpy as np


def freshness(now: float, stamps: np.ndarray, limit: float) -> tuple[np.ndarray, np.ndarray]:
    """Validity and ages.

    Args:
        now: Time [s].
        stamps: When each member was last seen, shape (N,) [s]; minus infinity if never.
        limit: Age beyond which nothing is valid [s].

    Returns:
        valid: 1 up to the limit, else 0, shape (N,).
        ages: Shape (N,) [s]; infinite if never seen.
    """
    ages = np.maximum(now - stamps, 0.0)
    return (ages <= limit + 1e-9).astype(float), ages
