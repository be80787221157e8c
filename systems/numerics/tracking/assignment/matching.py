"""One-to-one matching of pursuers and the evaders that they see.

As many pairs as possible, then the least (or greatest) total: the Hungarian problem, solved by
SciPy on a matrix in which pairs out of sight have a large finite cost and are dropped afterwards.
SciPy's solver cannot be called from compiled code. For rollouts the exact best total over every
set of a few evaders is therefore found pursuer by pursuer (Held and Karp's dynamic programme over
subsets).
"""

import numpy as np
from scipy.optimize import linear_sum_assignment

from ...compiled import compiled
from ...errors import require
from .team_view import UNASSIGNED, TeamView

# Weight of the distance relative to the risk: small, so that it only breaks ties.
TIE = 1e-6

# Most evaders for `match_small`: it looks at every set of them.
MOST_EVADERS = 10


@compiled
def nearer_first(
    risk: np.ndarray, pursuers: np.ndarray, evaders: np.ndarray, greatest: bool
) -> np.ndarray:
    """Break ties between equal risks by distance: the nearer pair is the better one.

    The risk (2.13) does not depend on the pursuer's position: pursuers that share the same corners
    with the evaders have equal risks, and rounding or their numbers would decide.

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
    """Match as `match_pairs` does: as many pairs as possible, then the least total risk.

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


def match_pairs(cost: np.ndarray, visible: np.ndarray, *, maximise: bool = False) -> np.ndarray:
    """Match rows to columns.

    Args:
        cost: Finite, shape (n, m).
        visible: Admissible pairs, shape (n, m), bool.
        maximise: Seek the greatest total instead of the least.

    Returns:
        Column of each row, -1 for none, shape (n,).

    Raises:
        InvalidInput: `cost` and `visible` differ in shape, or a cost is not finite.
    """
    # Compiled code below would read beyond the end of the smaller one.
    require(cost.ndim == 2, "cost", "be a table of rows and columns", cost.shape)
    same = visible.shape == cost.shape
    require(same, "visible", f"have the shape of cost, {cost.shape}", visible.shape)
    require(bool(np.isfinite(cost).all()), "cost", "be finite", cost.tolist())
    rows, columns = linear_sum_assignment(_padded(cost, visible, maximise))
    return _kept(rows, columns, visible)


@compiled
def _padded(cost: np.ndarray, visible: np.ndarray, maximise: bool) -> np.ndarray:
    """The cost to minimise, with a large finite one for pairs out of sight."""
    n, m = cost.shape
    # Larger than any saving that a pair out of sight could bring to the others.
    span = 1.0
    for i in range(n):
        for j in range(m):
            span = max(span, abs(cost[i, j]) + 1.0)
    padded = np.empty((n, m))
    for i in range(n):
        for j in range(m):
            signed = -cost[i, j] if maximise else cost[i, j]
            padded[i, j] = signed if visible[i, j] else 2.0 * span * min(n, m)
    return padded


@compiled
def _kept(rows: np.ndarray, columns: np.ndarray, visible: np.ndarray) -> np.ndarray:
    """Column of each row where the pair is in sight, else -1."""
    targets = np.full(len(visible), UNASSIGNED)
    for k in range(len(rows)):
        if visible[rows[k], columns[k]]:
            targets[rows[k]] = columns[k]
    return targets


def place_extra(targets: np.ndarray, view: TeamView, score: np.ndarray) -> np.ndarray:
    """Give unmatched pursuers the highest-scored evader that they see, if `view.extra` says so.

    Args:
        targets: From `match_pairs`, shape (n,).
        view: The game; nothing is done when `view.extra` is "stay".
        score: Score of each evader for each pursuer, shape (n, m).
    """
    if view.extra == "stay":
        return targets
    for i in np.flatnonzero((targets == UNASSIGNED) & view.visible.any(axis=1)):
        targets[i] = np.argmax(np.where(view.visible[i], score[i], -np.inf))
    return targets


def hungarian(view: TeamView) -> np.ndarray:
    """Least total risk, all pursuers sharing one risk function (Zhang 2014, 2.2.3.2).

    Returns:
        Each pursuer's evader, -1 for none, shape (n,).
    """
    cost = nearer_first(view.risk, view.pursuers.ravel(), view.evaders.ravel(), False)
    return place_extra(match_pairs(cost, view.visible), view, view.risk)


def hungarian_max(view: TeamView) -> np.ndarray:
    """Greatest total risk, so that pairs with a high risk are preferred.

    Returns:
        Each pursuer's evader, -1 for none, shape (n,).
    """
    gain = nearer_first(view.risk, view.pursuers.ravel(), view.evaders.ravel(), True)
    return place_extra(match_pairs(gain, view.visible, maximise=True), view, view.risk)
