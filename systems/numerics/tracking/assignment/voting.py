"""Voting: pursuers whose risks cannot be compared agree on one ranking of the evaders.

Each pursuer ranks the evaders that it sees by risk. Ballots are partial: a pursuer says nothing
about evaders out of its sight, neither that they are riskier nor that they are not. Borda (Zhang
2014, Algorithm 1 and (2.3)) gives the evader at place j (from 1) of m evaders m - j points. An
aggregation gives every evader a score, highest for the one that the pursuers together consider
riskiest, and pursuers are matched to the evaders that they see by score: `_min` takes the least
total, as in the printed algorithm, `_max` the greatest, as the text suggests.

In the printed algorithm an extra pursuer ends with the least risky evader in its sight, because the
loop over the ranking has no break, and evaders out of sight are ranked too. `borda_printed` keeps
both, the others follow the text of 2.2.3.2.

Sources: A. H. Copeland, A reasonable social welfare function (seminar, University of Michigan,
1951); J. G. Kemeny, Mathematics without numbers, Daedalus 88 (1959), 577-591; B. Reilly, Social
choice in the South Seas, International Political Science Review 23 (2002), for Dowdall's system,
which is Nauru's.
"""

from collections.abc import Callable

import numpy as np

from ...compiled import compiled
from ...errors import require
from .matching import match_pairs, place_extra
from .team_view import UNASSIGNED, TeamView


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


# Finding Kemeny's ranking is NP-hard; for small teams the recursion over subsets of M. Held and
# R. M. Karp (SIAM J. 10, 1962) takes 2^m m^2 steps: the best order of a set puts some evader
# last, and the cost of that does not depend on the order of the others.

# With more evaders the recursion would slow down a simulation: 12 take about a millisecond.
MOST_EVADERS = 12


@compiled
def kemeny_ranking(preferred: np.ndarray) -> np.ndarray:
    """The order with the least disagreement: the number of ballots against it, over all pairs.

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
    """Algorithm 1 exactly as printed; extra pursuers are always assigned, whatever `view.extra`.

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


# Scores of the evaders, shape (m,), from risks and who is ranked by whom, shapes (n, m).
Aggregation = Callable[[np.ndarray, np.ndarray], np.ndarray]


def dowdall_scores(risk: np.ndarray, ranked: np.ndarray) -> np.ndarray:
    """Sum of 1, 1/2, 1/3 ... for first, second, third places; arguments as in `borda_scores`."""
    return np.where(ranked, 1.0 / (places(risk, ranked) + 1.0), 0.0).sum(axis=0)


def copeland_scores(risk: np.ndarray, ranked: np.ndarray) -> np.ndarray:
    """Number of duels won by majority; a tie, or a duel that nobody judges, counts one half.

    Arguments as in `borda_scores`; a duel is judged by the pursuers that rank both.
    """
    preferred = preferences(risk, ranked)
    duels = np.sign(preferred - preferred.T)
    return 0.5 * (duels.sum(axis=1) + len(duels) - 1.0)


def kemeny_scores(risk: np.ndarray, ranked: np.ndarray) -> np.ndarray:
    """Score by Kemeny's ranking: m - 1 for the first evader, 0 for the last.

    Arguments as in `borda_scores`; pairs count on the ballots that rank both.

    Raises:
        InvalidInput: There are more evaders than MOST_EVADERS.
    """
    count = risk.shape[1]
    require(count <= MOST_EVADERS, "evaders", f"be at most {MOST_EVADERS} for kemeny", count)
    scores = np.empty(count)
    scores[kemeny_ranking(preferences(risk, ranked))] = np.arange(count - 1.0, -1.0, -1.0)
    return scores


AGGREGATIONS: dict[str, Aggregation] = {
    "borda": borda_scores,
    "dowdall": dowdall_scores,
    "copeland": copeland_scores,
    "kemeny": kemeny_scores,
}


def aggregated(scores: Aggregation, *, maximise: bool) -> Callable[[TeamView], np.ndarray]:
    """The assignment rule that matches by the scores of an aggregation.

    Args:
        scores: One of AGGREGATIONS, or another.
        maximise: Seek the greatest total score instead of the least.
    """

    def rule(view: TeamView) -> np.ndarray:
        score = np.broadcast_to(scores(view.risk, view.visible), view.risk.shape)
        return place_extra(match_pairs(score, view.visible, maximise=maximise), view, score)

    return rule
