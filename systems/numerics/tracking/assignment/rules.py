"""The rules by which pursuers are assigned, by name: to add one, write a function and enter it.

Beside the matchings and votes there are rules to compare with, every pursuer for itself, and any
rule may be applied without a centre (`decentralised`).
"""

from collections.abc import Callable

import numpy as np

from ...errors import InvalidInput
from .matching import hungarian, hungarian_max
from .team_view import UNASSIGNED, TeamView, names_evaders
from .voting import AGGREGATIONS, aggregated, borda_printed

_MASK = (1 << 64) - 1


def own_riskiest(view: TeamView) -> np.ndarray:
    """The evader that this pursuer itself ranks riskiest, shape (n,)."""
    return _best_visible(view.visible, view.risk)


def nearest(view: TeamView) -> np.ndarray:
    """The nearest evader in sight, shape (n,)."""
    offsets = view.pursuers[:, None, :] - view.evaders[None, :, :]
    return _best_visible(view.visible, -np.hypot(offsets[..., 0], offsets[..., 1]))


def random_visible(view: TeamView) -> np.ndarray:
    """An evader in sight by lot, shape (n,), drawn anew when what the pursuer sees changes."""
    targets = np.full(len(view.visible), UNASSIGNED)
    numbers = view.numbers if len(view.numbers) else np.arange(len(targets))
    for i, row in enumerate(view.visible):
        seen = np.flatnonzero(row)
        if len(seen):
            # The lot is a function of what is seen: the rule needs no memory, and no
            # generator whose state would depend on how often it was asked.
            ticket = _mix(_mix(_mix(view.seed) ^ int(numbers[i])) ^ sum(1 << int(j) for j in seen))
            targets[i] = seen[ticket % len(seen)]
    return targets


def stay(view: TeamView) -> np.ndarray:
    """Nobody pursues: -1, shape (n,)."""
    return np.full(len(view.visible), UNASSIGNED)


def _best_visible(visible: np.ndarray, score: np.ndarray) -> np.ndarray:
    best = np.argmax(np.where(visible, score, -np.inf), axis=1)
    return np.where(visible.any(axis=1), best, UNASSIGNED)


def _mix(value: int) -> int:
    """Finaliser of the SplitMix64 generator (Steele, Lea and Flood, OOPSLA 2014)."""
    value = (value + 0x9E3779B97F4A7C15) & _MASK
    value = ((value ^ (value >> 30)) * 0xBF58476D1CE4E5B9) & _MASK
    value = ((value ^ (value >> 27)) * 0x94D049BB133111EB) & _MASK
    return value ^ (value >> 31)


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


def checked(rule: AssignmentRule) -> AssignmentRule:
    """A rule that refuses to answer anything else than an evader, or none, for each pursuer.

    Args:
        rule: Anybody's.

    Returns:
        The rule; it answers whole numbers, shape (n,) of int, and raises InvalidInput where the
        answer has another shape, is of another type, or names nobody.
    """

    def answers(view: TeamView) -> np.ndarray:
        n, m = view.visible.shape
        answer = np.asarray(rule(view))
        numbers = answer.shape == (n,) and answer.dtype.kind in "iuf"
        # Compiled code does not look where it reads.
        if not (numbers and names_evaders(answer.astype(float), m)):
            who = f"return an evader from 0 to {m - 1}, or -1, for each of {n} pursuers"
            raise InvalidInput(f"`rule` must {who}; got {answer.tolist()!r:.200}")
        return answer.astype(int)

    return answers


# Assignment without a centre: each pursuer decides on what it and its neighbours see.
#
# A pursuer hears the pursuers within radio range tell where they are and what they see, and no
# more: what those hear from others is not passed on. It applies the team's rule to the game as it
# knows it, and keeps its own part of the result. Pursuers that know different things may well
# choose the same evader, which is what communication would have prevented.
#
# Source: ours; the thesis has a centre that knows all positions (2.2.1, 2.2.8).


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
