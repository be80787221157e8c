"""Rules to compare with: every pursuer for itself."""

import numpy as np

from .team_view import UNASSIGNED, TeamView

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
