"""Expected information of an agent's next picture about the evader's position.

The pursuer believes the evader to be in cell x with probability b(x). If it is there, agent i's
next picture shows it with probability v_i(x). A picture that shows the evader gives its cell; one
that does not makes the cells in view less likely. The expected loss of entropy is

    I = H(b) - P H(b | not shown),    P = sum b (1 - v),    b(x | not shown) = b (1 - v) / P.

The value of asking the agent is I times the probability that it accepts.

Source: ours (Zhang 2014, 4.4, asks for it); the entropy is Shannon's.
"""

import numpy as np

from ...errors import require
from .evolution import FRIEND, Iteration


def entropy(distribution: np.ndarray) -> float:
    """Entropy of a probability distribution [nats]; weights of any shape, summing to one."""
    positive = distribution[distribution > 0]
    return float(-(positive * np.log(positive)).sum())


def expected_information(belief: np.ndarray, view: np.ndarray) -> float:
    """I of one picture [nats], never negative.

    Args:
        belief: b(x), shape (cells,), summing to one.
        view: v_i(x), same shape, from 0 to 1.

    Raises:
        InvalidInput: The belief is no distribution, or the view has values that are not
            probabilities.
    """
    proper = bool((belief >= 0).all()) and abs(float(belief.sum()) - 1) < 1e-9
    require(proper, "belief", "be probabilities that sum to one", belief.sum())
    allowed = view.shape == belief.shape and bool(((view >= 0) & (view <= 1)).all())
    require(allowed, "view", f"be {belief.size} numbers from 0 to 1", view)
    missed = belief * (1 - view)
    total = float(missed.sum())
    left = total * entropy(missed / total) if total > 0 else 0.0
    return max(entropy(belief) - left, 0.0)


def interest(
    beliefs: np.ndarray, views: np.ndarray, accepting: np.ndarray, patience: int
) -> np.ndarray:
    """Expected information of asking each agent [nats], shape (agents,).

    Args:
        beliefs: b(x), shape (cells,).
        views: v_i(x), shape (agents, cells).
        accepting: Probability of each agent of accepting in one iteration, shape (agents,).
        patience: T_wait; an agent has T_wait + 1 chances to accept.
    """
    each = np.array([expected_information(beliefs, view) for view in views])
    return each * (1 - (1 - accepting) ** (patience + 1))


def update_tallies(tallies: np.ndarray, iteration: Iteration) -> np.ndarray:
    """Count the answers of the agents that were asked in an iteration.

    Args:
        tallies: Acceptances and everything else so far, shape (agents, 2).
        iteration: Result of the iteration.
    """
    counted = tallies.copy()
    for agent in iteration.asked:
        counted[agent, 0 if iteration.known.status[agent] == FRIEND else 1] += 1
    return counted


def estimated_acceptance(tallies: np.ndarray) -> np.ndarray:
    """Mean of each agent's probability given its tallies and no prior knowledge, shape (agents,).

    From a uniform prior: (accepted + 1) / (asked + 2), Laplace's rule.
    """
    return (tallies[:, 0] + 1) / (tallies.sum(axis=1) + 2)
