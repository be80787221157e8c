"""The registry of assignment rules: to add one, write a function and add a line here."""

from collections.abc import Callable

import numpy as np

from .aggregation import AGGREGATIONS, aggregated
from .baselines import nearest, own_riskiest, random_visible, stay
from .borda import borda_printed
from .matching import hungarian, hungarian_max
from .team_view import TeamView

# A rule gives each pursuer an evader that it sees, or -1: shape (n,) of int.
AssignmentRule = Callable[[TeamView], np.ndarray]

# The rules that scenarios and `Assignment` know by name; one of yours may be entered.
ASSIGNMENT_RULES: dict[str, AssignmentRule] = {
    "hungarian": hungarian,
    "hungarian_max": hungarian_max,
    **{f"{name}_min": aggregated(scores, maximise=False) for name, scores in AGGREGATIONS.items()},
    **{f"{name}_max": aggregated(scores, maximise=True) for name, scores in AGGREGATIONS.items()},
    "borda_printed": borda_printed,
    "random_visible": random_visible,
    "own_riskiest": own_riskiest,
    "nearest": nearest,
    "stay": stay,
}
