"""Assignment without a centre: each pursuer decides on what it and its neighbours see.

A pursuer hears the pursuers within radio range tell where they are and what they see, and no more:
what those hear from others is not passed on. It applies the team's rule to the game as it knows
it, and keeps its own part of the result. Pursuers that know different things may well choose the
same evader, which is what communication would have prevented.

Source: ours; the thesis has a centre that knows all positions (2.2.1, 2.2.8).
"""

import numpy as np

from .rules import AssignmentRule
from .team_view import UNASSIGNED, TeamView


def decentralised(rule: AssignmentRule, radio_range: float) -> AssignmentRule:
    """A rule applied by each pursuer to what it knows.

    Args:
        rule: Of the team.
        radio_range: How far a pursuer is heard, obstacles or not [m]; infinite: the rule itself.

    Returns:
        A rule of the whole view, of which each pursuer uses its own part only.
    """
    if np.isinf(radio_range):
        return rule

    def local(view: TeamView) -> np.ndarray:
        gaps = view.pursuers[:, None, :] - view.pursuers[None, :, :]
        heard = np.hypot(gaps[..., 0], gaps[..., 1]) <= radio_range
        targets = np.full(len(view.visible), UNASSIGNED)
        for i in range(len(targets)):
            members = np.flatnonzero(heard[i])
            targets[i] = rule(known_view(view, members))[np.searchsorted(members, i)]
        return targets

    return local


def known_view(view: TeamView, members: np.ndarray) -> TeamView:
    """What some pursuers know together: of evaders out of the sight of one it reports no risk.

    Args:
        view: The whole game.
        members: Numbers of the pursuers in it, ascending, shape (k,).
    """
    visible = view.visible[members]
    return view._replace(
        visible=visible,
        risk=np.where(visible, view.risk[members], 0.0),
        pursuers=view.pursuers[members],
        numbers=members,
    )
