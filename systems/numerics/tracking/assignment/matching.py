"""One-to-one matching of pursuers and the evaders that they see.

As many pairs as possible, then the least (or greatest) total: the Hungarian problem, solved by
SciPy on a matrix in which pairs out of sight have a large finite cost and are dropped afterwards.
"""

import numpy as np
from scipy.optimize import linear_sum_assignment

from ...compiled import compiled
from .small_matching import nearer_first
from .team_view import UNASSIGNED, TeamView


def match_pairs(cost: np.ndarray, visible: np.ndarray, *, maximise: bool = False) -> np.ndarray:
    """Match rows to columns.

    Args:
        cost: Finite, shape (n, m).
        visible: Admissible pairs, shape (n, m), bool.
        maximise: Seek the greatest total instead of the least.

    Returns:
        Column of each row, -1 for none, shape (n,).
    """
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
    """Give pursuers that were left over the highest-scored evader in their sight, if asked to.

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
    """Greatest total risk: the pursuers on whom most depends are kept on their evaders.

    Returns:
        Each pursuer's evader, -1 for none, shape (n,).
    """
    gain = nearer_first(view.risk, view.pursuers.ravel(), view.evaders.ravel(), True)
    return place_extra(match_pairs(gain, view.visible, maximise=True), view, view.risk)
