"""How much an evader threatens to escape: risk vectors over corners, and risks of pairs.

A corner counts for a pair when both see it. Distances are from the evader to the corner.

A risk vector weights corners by how remote the threat of each is [m]. In the thesis that is the
evader's distance d, regardless of the pursuer's position. Two more measures come from the corner
game: the margin M1, by which the pursuer is in time, and the distance that the evader lacks,

    v_e T* + max(M1, 0),

its dash out of sight, plus the margin by which that comes too late.

Source: Zhang 2014, 2.2.3.1 (risk vectors of (2.2)) and (2.13); game's margins: ours.
"""

import math

import numpy as np

from ..compiled import compiled
from .corner_game import dash, margins, to_corner_frame
from .sight_state import split_sight

UNIFORM = 0
MAJORITY = 1
PROPORTIONAL = 2
LEAST_MARGIN = 3
URGENCY = 4

# Risk vectors: how the fields of the corners are weighted in (2.2). "least_margin" uses only the
# corner with the least M1, for which the game's best evader makes; "urgency" weights each corner
# by the inverse of v_e T* + max(M1, 0).
RISK_VECTORS = {
    "uniform": UNIFORM,
    "majority": MAJORITY,
    "proportional": PROPORTIONAL,
    "least_margin": LEAST_MARGIN,
    "urgency": URGENCY,
}

# Codes of the risk functions, for `team_risk`.
# The sum of 1/d over the corners.
TOTAL = 0
# The largest 1/d.
NEAREST = 1
# The mean of 1/d.
MEAN = 2

# Risk functions: one number for a pair of pursuer and evader. "total" is (2.13), the sum of
# 1/d; "nearest" the largest 1/d; "mean" their average. The thesis gives pursuers different
# risk functions without saying which; these are the scalar companions of its risk vectors.
RISK_FUNCTIONS = {"total": TOTAL, "nearest": NEAREST, "mean": MEAN}

# Lower limit of distances, so that an evader on a corner has a finite risk [m].
SHORTEST_DISTANCE = 1e-6


@compiled
def remoteness(
    kind: int,
    px: float,
    py: float,
    ex: float,
    ey: float,
    cx: float,
    cy: float,
    heading: float,
    alpha: float,
    a: float,
) -> float:
    """How remote the threat of a corner is, by the measure of a risk vector [m] (kernel).

    Args:
        kind: Code of the risk vector (`RISK_VECTORS`).
        px, py, ex, ey: World positions of pursuer and evader [m].
        cx, cy, heading, alpha: The corner, as in `Corners` [m], [rad].
        a: Speed ratio v_e / v_p, in (0, 1).

    Returns:
        The evader's distance for the thesis's vectors; M1 for LEAST_MARGIN, negative where the
        evader wins; v_e T* + max(M1, 0) for URGENCY.
    """
    if kind not in (LEAST_MARGIN, URGENCY):
        return math.hypot(ex - cx, ey - cy)
    r_p, phi_p, r_e, phi_e, _ = to_corner_frame(px, py, ex, ey, cx, cy, heading, alpha)
    m1 = margins(r_p, phi_p, r_e, phi_e, alpha, a)[0]
    if kind == LEAST_MARGIN:
        return m1
    return dash(r_p, phi_p, r_e, phi_e, a) + max(m1, 0.0)


@compiled
def risk_weights(kind: int, remote: np.ndarray) -> np.ndarray:
    """Weights of the corners in the sum (2.2), from how remote the threats are.

    Args:
        kind: UNIFORM (1/k each), MAJORITY or LEAST_MARGIN (the nearest threat alone),
            PROPORTIONAL or URGENCY (as the inverse).
        remote: From `remoteness`, shape (k,) [m].

    Returns:
        Shape (k,), non-negative, summing to one.
    """
    count = len(remote)
    weights = np.zeros(count)
    if kind in (MAJORITY, LEAST_MARGIN):
        nearest = 0
        for i in range(1, count):
            if remote[i] < remote[nearest]:
                nearest = i
        if count:
            weights[nearest] = 1.0
    elif kind in (PROPORTIONAL, URGENCY):
        for i in range(count):
            weights[i] = 1.0 / max(remote[i], SHORTEST_DISTANCE)
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
        corners: Shape (k, 6), x and y first [m].

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
