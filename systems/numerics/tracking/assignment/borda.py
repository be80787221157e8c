"""Ranking and aggregation: pursuers with incomparable risk functions vote by Borda count.

Source: Zhang 2014, Algorithm 1 and (2.3). Each pursuer ranks the evaders from the riskiest down;
the one at place j (from 1) of m gets m - j points. The sum of an evader's points is its score,
and the Hungarian method assigns pursuers by score.

In print the method minimises a score that is highest for the riskiest evader: that is the rule
`borda_min`; `borda_max` does what the words suggest (`aggregation.py` makes both). In print an
extra pursuer ends with the least risky evader in its sight, because the loop over the ranking has
no break, and evaders out of sight are ranked too: `borda_printed` keeps both, the others follow
the text of 2.2.3.2.
"""

import numpy as np

from .ballots import places
from .matching import match_pairs
from .team_view import UNASSIGNED, TeamView


def borda_scores(risk: np.ndarray, ranked: np.ndarray) -> np.ndarray:
    """Sum of the points that each evader gets.

    Args:
        risk: Shape (n, m); ties go to the lower index.
        ranked: Which evaders each pursuer ranks, shape (n, m), bool; the others get no points.

    Returns:
        Shape (m,).
    """
    points = risk.shape[1] - 1.0 - places(risk, ranked)
    return np.where(ranked, points, 0.0).sum(axis=0)


def borda_printed(view: TeamView) -> np.ndarray:
    """Algorithm 1 to the letter; extra pursuers are always assigned, whatever `view.extra`.

    Returns:
        Each pursuer's evader, shape (n,).
    """
    scores = borda_scores(view.risk, np.ones_like(view.visible))
    targets = match_pairs(np.broadcast_to(scores, view.risk.shape), view.visible)
    rank = np.argsort(-scores, kind="stable")
    if len(view.risk) > len(scores):
        for i in np.flatnonzero(targets == UNASSIGNED):
            for j in rank:
                if view.visible[i, j]:
                    targets[i] = j
    return targets
