"""The ranking that contradicts the ballots least, exactly.

Source: J. G. Kemeny, Mathematics without numbers, Daedalus 88 (1959), 577-591. Finding it is
NP-hard; for small teams the recursion over subsets of M. Held and R. M. Karp (SIAM J. 10, 1962)
does it in 2^m m^2 steps: the best order of a set puts some evader last, and how much that costs
does not depend on the order of the others.
"""

import numpy as np

from ...compiled import compiled

# Above this the recursion would hold up a simulation: 12 evaders take a millisecond or so.
MOST_EVADERS = 12


@compiled
def kemeny_ranking(preferred: np.ndarray) -> np.ndarray:
    """The order with the least disagreement: over all pairs, ballots that say the opposite.

    Args:
        preferred: How many ballots put j above k, shape (m, m), m <= MOST_EVADERS.

    Returns:
        Evaders from the top, shape (m,), int; among equally good orders the one with the
        highest index last, and so on upwards.
    """
    m = len(preferred)
    full = (1 << m) - 1
    cost = np.zeros(full + 1)
    last = np.zeros(full + 1, dtype=np.int64)
    for chosen in range(1, full + 1):
        best = np.inf
        for k in range(m - 1, -1, -1):
            if not chosen >> k & 1:
                continue
            total = cost[chosen ^ (1 << k)]
            for j in range(m):
                if chosen >> j & 1:
                    total += preferred[k, j]
            if total < best:
                best, last[chosen] = total, k
        cost[chosen] = best
    order = np.empty(m, dtype=np.int64)
    for place in range(m - 1, -1, -1):
        order[place] = last[full]
        full ^= 1 << order[place]
    return order
