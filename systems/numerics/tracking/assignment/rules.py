"""Assignment rules by name: to add one, write a function and enter it in `ASSIGNMENT_RULES`.

Besides the matchings and votes there are baseline rules, in which every pursuer chooses for itself.
Any rule may also be applied without a centre (`decentralised`).
"""

from collections.abc import Callable

import numpy as np

from ...errors import InvalidInput
from .matching import hungarian, hungarian_max
from .team_view import UNASSIGNED, TeamView, names_evaders
from .voting import AGGREGATIONS, aggregated, borda_printed

_MASK = (1 << 64) - 1


def own_riskiest(view: TeamView) -> np.ndarray:
    """The evader in sight that each pursuer itself ranks riskiest, shape (n,)."""
    return _best_visible(view.visible, view.risk)


def nearest(view: TeamView) -> np.ndarray:
    """The evader in sight that is nearest to each pursuer, shape (n,)."""
    offsets = view.pursuers[:, None, :] - view.evaders[None, :, :]
    return _best_visible(view.visible, -np.hypot(offsets[..., 0], offsets[..., 1]))


def random_visible(view: TeamView) -> np.ndarray:
    """A random evader in sight, shape (n,), redrawn when the set that the pursuer sees changes."""
    targets = np.full(len(view.visible), UNASSIGNED)
    numbers = view.numbers if len(view.numbers) else np.arange(len(targets))
    for i, row in enumerate(view.visible):
        seen = np.flatnonzero(row)
        if len(seen):
            # The draw is a function of what is seen: the rule needs no memory, and no
            # generator whose state would depend on how often the rule is called.
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

# The rules that scenarios and `Assignment` know by name; you may add your own.
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
    """Wrap a rule so that its answer is checked: an evader, or none, for each pursuer.

    Args:
        rule: Any rule, also a user's own.

    Returns:
        The checked rule. It returns shape (n,) of int, and raises InvalidInput if the answer has
        another shape or type, or an entry that is neither an evader nor -1.
    """

    def answers(view: TeamView) -> np.ndarray:
        n, m = view.visible.shape
        answer = np.asarray(rule(view))
        numbers = answer.shape == (n,) and answer.dtype.kind in "iuf"
        # Compiled code does not check its indices.
        if not (numbers and names_evaders(answer.astype(float), m)):
            who = f"return an evader from 0 to {m - 1}, or -1, for each of {n} pursuers"
            raise InvalidInput(f"`rule` must {who}; got {answer.tolist()!r:.200}")
        return answer.astype(int)

    return answers


# Assignment without a centre: each pursuer decides by what it and its neighbours see.
#
# A pursuer receives positions and sightings from the pursuers within radio range. What those
# receive from others is not passed on. It applies the team's rule to the game as it knows it, and
# keeps its own part of the result. Pursuers that know different things may choose the same evader,
# which full communication would have prevented.
#
# Source: ours; the thesis has a centre that knows all positions (2.2.1, 2.2.8).


def decentralised(rule: AssignmentRule, radio_range: float) -> AssignmentRule:
    """Make a rule that each pursuer applies to what it knows itself.

    Args:
        rule: The team's rule.
        radio_range: Range of the radio, also through obstacles [m]; infinite: `rule` itself.

    Returns:
        A rule of the whole view, in which each pursuer uses only its own part.
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
    """The view that some pursuers have together; the risk of pairs out of sight is 0.

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
