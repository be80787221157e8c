"""When a team changes its assignment: it is held until there is a reason to change it.

A rule applied at every step reacts to every small change of the risks, and pursuers would turn
back and forth at every step. So the rule says which assignment it would choose, and a hold says
when to follow it.

Source: ours; the thesis (2.2.3.2) applies its rule at every step, which is the hold "none".
"""

import numpy as np

from ...compiled import compiled
from .rules import AssignmentRule
from .team_view import UNASSIGNED, TeamView

# When a team follows its rule: at every step; when the held assignment is broken; or also when
# the rule's choice changes the total risk by more than COST.
HOLDS = ("none", "until_lost", "cost")

# The assignment changes when that changes the total risk by more than this share.
COST = 0.25


def hold_or_choose(
    view: TeamView, held: np.ndarray | None, rule: AssignmentRule, hold: str
) -> np.ndarray:
    """Keep the held assignment, or choose one by the rule.

    Args:
        view: The game.
        held: The last assignment, shape (n,); None at the start.
        rule: Chooses an assignment.
        hold: One of HOLDS.

    Returns:
        Each pursuer's evader, -1 for none, shape (n,).
    """
    if held is None or hold == "none" or is_broken(view.visible, held):
        return rule(view)
    if hold == "cost":
        chosen = rule(view)
        before, after = _total_risk(view, held), _total_risk(view, chosen)
        if abs(after - before) > COST * max(before, after):
            return chosen
    return held


@compiled
def is_broken(visible: np.ndarray, held: np.ndarray) -> bool:
    """Whether a pursuer has lost its evader, or a spare one sees an evader that nobody has.

    A pursuer is spare if it has no evader or shares its evader with others.

    Args:
        visible: Whether pursuer i sees evader j, shape (n, m), bool.
        held: Each pursuer's evader, -1 for none, shape (n,), int.
    """
    n, m = visible.shape
    holders = np.zeros(m)
    for i in range(n):
        if held[i] != UNASSIGNED:
            if not visible[i, held[i]]:
                return True
            holders[held[i]] += 1
    for i in range(n):
        if held[i] == UNASSIGNED or holders[held[i]] > 1:
            for j in range(m):
                if visible[i, j] and holders[j] == 0:
                    return True
    return False


def _total_risk(view: TeamView, targets: np.ndarray) -> float:
    pairs = np.flatnonzero(targets != UNASSIGNED)
    return float(view.risk[pairs, targets[pairs]].sum())
