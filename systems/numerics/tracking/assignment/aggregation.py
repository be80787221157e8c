"""Other ways than Borda's to make one ranking of many, for the same assignment.

Each gives every evader a score, highest for the one that the pursuers together hold riskiest, and
takes the place of the Borda count in (2.3). As there, pursuers are matched to the evaders that
they see by score; `_min` takes the least total, as in print, `_max` the greatest, as the words
suggest.

Sources: A. H. Copeland, A reasonable social welfare function (seminar, University of Michigan,
1951); J. G. Kemeny 1959 (`kemeny.py`); B. Reilly, Social choice in the South Seas, International
Political Science Review 23 (2002), for Dowdall's system, which is Nauru's.
"""

from collections.abc import Callable

import numpy as np

from ...errors import require
from .ballots import places, preferences
from .borda import borda_scores
from .kemeny import MOST_EVADERS, kemeny_ranking
from .matching import match_pairs, place_extra
from .team_view import TeamView

# Scores of the evaders, shape (m,), from risks and who is ranked by whom, shapes (n, m).
Aggregation = Callable[[np.ndarray, np.ndarray], np.ndarray]


def dowdall_scores(risk: np.ndarray, ranked: np.ndarray) -> np.ndarray:
    """Sum of 1, 1/2, 1/3 ... for first, second, third places; arguments as in `borda_scores`."""
    return np.where(ranked, 1.0 / (places(risk, ranked) + 1.0), 0.0).sum(axis=0)


def copeland_scores(risk: np.ndarray, ranked: np.ndarray) -> np.ndarray:
    """Duels won by majority, a tie or a duel that nobody judged being half of one.

    Arguments as in `borda_scores`; a duel is judged by the pursuers that rank both.
    """
    preferred = preferences(risk, ranked)
    duels = np.sign(preferred - preferred.T)
    return 0.5 * (duels.sum(axis=1) + len(duels) - 1.0)


def kemeny_scores(risk: np.ndarray, ranked: np.ndarray) -> np.ndarray:
    """Places from the end of Kemeny's ranking: m - 1 for the first, 0 for the last.

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
