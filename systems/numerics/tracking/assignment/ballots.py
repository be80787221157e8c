"""What pursuers vote: each ranks the evaders that it sees, from the riskiest down.

Ranks can be compared where risks cannot. Ballots are partial: a pursuer says nothing of evaders
out of its sight, neither that they are riskier nor that they are not.
"""

import numpy as np


def places(risk: np.ndarray, ranked: np.ndarray) -> np.ndarray:
    """The place of each evader on each pursuer's ballot.

    Args:
        risk: Shape (n, m); ties go to the lower index.
        ranked: Which evaders each pursuer ranks, shape (n, m), bool.

    Returns:
        Shape (n, m), int: 0 for the riskiest; evaders that are not ranked come last.
    """
    order = np.argsort(np.where(ranked, -risk, np.inf), axis=1, kind="stable")
    found = np.empty_like(order)
    np.put_along_axis(found, order, np.arange(risk.shape[1])[None, :], axis=1)
    return found


def preferences(risk: np.ndarray, ranked: np.ndarray) -> np.ndarray:
    """How many pursuers rank evader j above evader k, of those that rank both.

    Args:
        risk: Shape (n, m); ties go to the lower index.
        ranked: Which evaders each pursuer ranks, shape (n, m), bool.

    Returns:
        Shape (m, m), int; zero on the diagonal.
    """
    place = places(risk, ranked)
    both = ranked[:, :, None] & ranked[:, None, :]
    return (both & (place[:, :, None] < place[:, None, :])).sum(axis=0)
