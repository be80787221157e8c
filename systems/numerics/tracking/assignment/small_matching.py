"""The Hungarian matching of small teams, as a kernel for games that are played ahead.

SciPy's solver cannot be called from compiled code. For a few evaders the best total over every set
of evaders is found pursuer by pursuer (Held and Karp's dynamic programme over subsets), exactly.
"""

import numpy as np

from ...compiled import compiled
from .team_view import UNASSIGNED

# How little the distance counts beside the risk.
TIE = 1e-6

# More evaders than this have too many sets.
MOST_EVADERS = 10


@compiled
def nearer_first(
    risk: np.ndarray, pursuers: np.ndarray, evaders: np.ndarray, greatest: bool
) -> np.ndarray:
    """Risks among which equal ones are told apart by the distance, the nearer being the better.

    The risk (2.13) does not know where the pursuer is: pursuers that share the same corners with
    the evaders have equal risks, and rounding or their numbers would decide.

    Args:
        risk: Shape (n, m) [1/m].
        pursuers, evaders: Positions, shapes (2 n,), (2 m,) [m].
        greatest: Whether the greatest total is sought.

    Returns:
        Shape (n, m) [1/m].
    """
    n, m = risk.shape
    distances = np.empty((n, m))
    for i in range(n):
        for j in range(m):
            dx, dy = pursuers[2 * i] - evaders[2 * j], pursuers[2 * i + 1] - evaders[2 * j + 1]
            distances[i, j] = np.sqrt(dx * dx + dy * dy)
    longest = max(distances.max(), 1e-12)
    sign = -TIE if greatest else TIE
    return risk + sign * distances / longest**2


@compiled
def match_small(risk: np.ndarray, visible: np.ndarray, greatest: bool) -> np.ndarray:
    """Match as `matching.match` does: as many pairs as possible, then the least total risk.

    Args:
        risk: Shape (n, m), m at most MOST_EVADERS.
        visible: Admissible pairs, shape (n, m), bool.
        greatest: Seek the greatest total instead.

    Returns:
        Column of each row, -1 for none, shape (n,), int.
    """
    n, m = risk.shape
    sets = 1 << m
    # A pair counts more than any saving of risk: the total is least where most are matched.
    span = 1.0
    for i in range(n):
        for j in range(m):
            span += abs(risk[i, j])
    best = np.full((n + 1, sets), np.inf)
    chosen = np.full((n, sets), UNASSIGNED)
    best[0, 0] = 0.0
    for i in range(n):
        for taken in range(sets):
            total = best[i, taken]
            if total == np.inf:
                continue
            if total < best[i + 1, taken]:
                best[i + 1, taken] = total
                chosen[i, taken] = UNASSIGNED
            for j in range(m):
                if visible[i, j] and not taken >> j & 1:
                    after = taken | 1 << j
                    cost = total - 2.0 * span + (-risk[i, j] if greatest else risk[i, j])
                    if cost < best[i + 1, after]:
                        best[i + 1, after] = cost
                        chosen[i, after] = j
    taken = int(np.argmin(best[n]))
    targets = np.full(n, UNASSIGNED)
    for i in range(n - 1, -1, -1):
        targets[i] = chosen[i, taken]
        if targets[i] != UNASSIGNED:
            taken ^= 1 << targets[i]
    return targets
