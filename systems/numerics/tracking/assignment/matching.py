"""One-to-one matching of pursuers and the evaders that they see.

As many pairs as possible, then the least (or greatest) total: the Hungarian problem, solved by
SciPy on a matrix in which pairs out of sight have a large finite cost and are dropped afterwards.
"""

import numpy as np
from scipy.optimize import linear_sum_assignment

from .team_view import UNASSIGNED, TeamView


def match(cost: np.ndarray, visible: np.ndarray, *, maximise: bool = False) -> np.ndarray:
    """Match rows to columns.

    Args:
        cost: Finite, shape (n, m).
        visible: Admissible pairs, shape (n, m), bool.
        maximise: Seek the greatest total instead of the least.

    Returns:
        Column of each row, -1 for none, shape (n,).
    """
    signed = -cost if maximise else cost
    # Larger than any saving that a pair out of sight could bring to the others.
    span = float(np.abs(signed).max(initial=0.0)) + 1.0
    padded = np.where(visible, signed, 2.0 * span * min(cost.shape))
    rows, columns = linear_sum_assignment(padded)
    targets = np.full(len(cost), UNASSIGNED)
    kept = visible[rows, columns]
    targets[rows[kept]] = columns[kept]
    return targets


def place_extra(targets: np.ndarray, view: TeamView, score: np.ndarray) -> np.ndarray:
    """Give pursuers that were left over the highest-scored evader in their sight, if asked to.

    Args:
        targets: From `match`, shape (n,).
        view: The game; nothing is done when `view.extra` is "stay".
        score: Score of each evader for each pursuer, shape (n, m).
    """
    if view.extra == "stay":
        return targets
    for i in np.flatnonzero((targets == UNASSIGNED) & view.visible.any(axis=1)):
        targets[i] = np.argmax(np.where(view.visible[i], score[i], -np.inf))
    return targets


def hungarian(view: TeamView) -> np.ndarray:
    """Least total risk, all pursuers sharing one risk function (Zhang 2014, 2.2.3.2)."""
    return place_extra(match(view.risk, view.visible), view, view.risk)


def hungarian_max(view: TeamView) -> np.ndarray:
    """Greatest total risk: the pursuers on whom most depends are kept on their evaders."""
    return place_extra(match(view.risk, view.visible, maximise=True), view, view.risk)
