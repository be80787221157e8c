"""How much an evader threatens to escape: risk vectors over corners, and risk of whole pairs.

A corner counts for a pair when both see it. Distances are from the evader to the corner.

Source: Zhang 2014, 2.2.3.1 (risk vectors of (2.2)) and (2.13).
"""

import math

import numpy as np

from ..compiled import compiled
from .sight_state import split_sight

UNIFORM = 0
MAJORITY = 1
PROPORTIONAL = 2

# Risk vectors: how the fields of the corners are weighted in (2.2).
RISK_VECTORS = {"uniform": UNIFORM, "majority": MAJORITY, "proportional": PROPORTIONAL}

TOTAL = 0
NEAREST = 1
MEAN = 2

# Risk functions: one number for a pair of pursuer and evader. "total" is (2.13), the sum of
# 1/d; "nearest" the largest 1/d; "mean" their average. The thesis gives pursuers different
# risk functions without saying which; these are the scalar companions of its risk vectors.
RISK_FUNCTIONS = {"total": TOTAL, "nearest": NEAREST, "mean": MEAN}

# Distances below this count as this, so that an evader on a corner has a finite risk [m].
SHORTEST_DISTANCE = 1e-6


@compiled
def risk_weights(kind: int, distances: np.ndarray) -> np.ndarray:
    """Weights of the corners in the sum (2.2), from the evader's distances to them.

    Args:
        kind: UNIFORM (1/k each), MAJORITY (the nearest alone) or PROPORTIONAL (as 1/d).
        distances: Shape (k,) [m].

    Returns:
        Shape (k,), non-negative, summing to one.
    """
    count = len(distances)
    weights = np.zeros(count)
    if kind == MAJORITY:
        nearest = 0
        for i in range(1, count):
            if distances[i] < distances[nearest]:
                nearest = i
        if count:
            weights[nearest] = 1.0
    elif kind == PROPORTIONAL:
        for i in range(count):
            weights[i] = 1.0 / max(distances[i], SHORTEST_DISTANCE)
        weights /= weights.sum()
    else:
        weights[:] = 1.0 / max(count, 1)
    return weights


@compiled
def team_risk(
    kinds: np.ndarray,
    evaders: np.ndarray,
    sight: np.ndarray,
    corners: np.ndarray,
) -> np.ndarray:
    """Risk of every pair of pursuer and evader, each pursuer by its own risk function.

    Args:
        kinds: Each pursuer's risk function (TOTAL, NEAREST or MEAN), shape (n,).
        evaders: Positions, shape (2 m,) [m].
        sight: Who sees what, from `observe`.
        corners: Shape (k, 4), x and y first [m].

    Returns:
        Shape (n, m) [1/m]; 0 where a pair has no corner in common.
    """
    n, m, k = len(kinds), len(evaders) // 2, len(corners)
    _, pursuer_corners, evader_corners = split_sight(sight, n, m, k)
    risk = np.zeros((n, m))
    inverse = np.empty(k)
    for j in range(m):
        for c in range(k):
            inverse[c] = 0.0
            if evader_corners[j, c] > 0.5:
                distance = math.hypot(
                    evaders[2 * j] - corners[c, 0], evaders[2 * j + 1] - corners[c, 1]
                )
                inverse[c] = 1.0 / max(distance, SHORTEST_DISTANCE)
        for i in range(n):
            total, largest, count = 0.0, 0.0, 0
            for c in range(k):
                if pursuer_corners[i, c] > 0.5 and inverse[c] > 0.0:
                    total += inverse[c]
                    largest = max(largest, inverse[c])
                    count += 1
            if kinds[i] == NEAREST:
                risk[i, j] = largest
            elif kinds[i] == MEAN:
                risk[i, j] = total / max(count, 1)
            else:
                risk[i, j] = total
    return risk
