"""Who should watch whom, so that the team's guarantee is as long as it can be.

If each pursuer plays the game of one against one with its own evader, then all evaders stay in
sight for as long as the least of the pairs' guaranteed times, whatever they do: the certificate of
the matching. The best matching is therefore that whose least time is greatest (a bottleneck
matching), and there is a reason to change it only where that makes the certificate longer.

Source: ours.
"""

import numpy as np

from ..assignment.matching import match_pairs
from ..assignment.team_view import UNASSIGNED
from .certificates import team_certificate

# When a team changes its matching: at every step, when what it holds is broken, or also when its
# certificate grows.
SWITCHES = ("none", "until_lost", "certificate")

# A new matching has to make the certificate longer by this share, and by a step.
GAIN = 0.1


def bottleneck(worth: np.ndarray) -> np.ndarray:
    """The matching whose least worth is greatest; of several that with the greatest total.

    As many evaders as possible are watched.

    Args:
        worth: Of each pair, 0 where the pursuer does not see the evader, shape (n, m).

    Returns:
        Each pursuer's evader, -1 for none, shape (n,).
    """
    values = np.unique(worth[worth > 0.0])
    if len(values) == 0:
        return np.full(len(worth), UNASSIGNED)
    targets = match_pairs(worth, worth > 0.0, maximise=True)
    most = np.count_nonzero(targets != UNASSIGNED)
    # The greatest bound that allows as many pairs, by bisection; it holds for the first.
    low, high = 0, len(values)
    while high - low > 1:
        middle = (low + high) // 2
        above = match_pairs(worth, worth >= values[middle], maximise=True)
        if np.count_nonzero(above != UNASSIGNED) == most:
            low, targets = middle, above
        else:
            high = middle
    return targets


def with_helpers(targets: np.ndarray, worth: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """Give pursuers without an evader one to help with: first those that nobody watches, then the
    weakest pairs.

    An evader that nobody is assigned to is in sight by luck: of a pursuer that watches another.

    Args:
        targets: Each pursuer's evader, -1 for none, shape (n,).
        worth: Of each pair, 0 where the pursuer does not see the evader, shape (n, m).
        steps: How soon a pursuer could guard an evader that it does not see, infinite where there
            is no way, shape (n, m).
    """
    # Whoever sees an evader is before all that do not, and of those the soonest is first.
    help_worth = np.where(worth > 0.0, 1.0 + worth, 1.0 / (1.0 + steps))
    targets = targets.copy()
    while True:
        free = np.flatnonzero((targets == UNASSIGNED) & (help_worth > 0.0).any(axis=1))
        if len(free) == 0:
            return targets
        watchers = np.bincount(targets[targets != UNASSIGNED], minlength=worth.shape[1])
        held = best_worths(targets, worth)
        helped = np.flatnonzero((help_worth[free] > 0.0).any(axis=0))
        j = min(helped, key=lambda each: (watchers[each], held[each]))
        targets[free[np.argmax(help_worth[free, j])]] = j


def best_worths(targets: np.ndarray, worth: np.ndarray) -> np.ndarray:
    """What the best of its watchers is worth, for each evader; 0 without one; shape (m,).

    Args:
        targets: Each pursuer's evader, -1 for none, shape (n,).
        worth: Of each pair, shape (n, m).
    """
    watched = targets[:, None] == np.arange(worth.shape[1])
    return np.where(watched, worth, 0.0).max(axis=0)


def certificate(targets: np.ndarray, times: np.ndarray) -> float:
    """How long all evaders stay in sight if each pursuer plays with its own [s].

    Args:
        targets: Each pursuer's evader, -1 for none, shape (n,).
        times: Guaranteed time of each pair, shape (n, m) [s].
    """
    own = np.where(targets == UNASSIGNED, 0.0, times[np.arange(len(times)), targets])
    return team_certificate(own, targets, times.shape[1])


def covered(targets: np.ndarray, visible: np.ndarray) -> int:
    """How many evaders are seen by a pursuer of theirs.

    Args:
        targets: Each pursuer's evader, -1 for none, shape (n,).
        visible: Who sees whom, shape (n, m), bool.
    """
    return int(np.count_nonzero(best_worths(targets, visible)))


def is_longer(time: float, held: float, step: float) -> bool:
    """Whether a certificate is so much longer than the one held that a change is worth it.

    Args:
        time, held: Certificates [s].
        step: Of the game [s].
    """
    return time > (1.0 + GAIN) * held + step
