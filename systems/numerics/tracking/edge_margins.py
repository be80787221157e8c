"""The corner game's margin with edges as long as they are, on both sides, and in the star region.

M1 = D_e - a D_p takes an obstacle's edge for endless and stops counting where the pursuer stands in
the star region. Here each of a corner's two edges s has a margin of its own,

    M_s = |e - s| - a D_s(p),

with |e - s| the evader's distance from the edge [m], and D_s the pursuer's distance from the place
where it sees along it, negative beyond. The corner's margin is the lesser of the two. It changes
continuously as the pursuer enters the star region, and mirrors with the obstacle.

Source: ours, on the game of Zhang 2014, 2.2.2.
"""

import math

import numpy as np

from ..compiled import kernel


@kernel
def signed_margin(
    px: float, py: float, ex: float, ey: float, corners: np.ndarray, c: int, ratio: float
) -> float:
    """Signed margin of one corner, the lesser of its two edges' [m] (kernel).

    Args:
        px, py, ex, ey: World positions of pursuer and evader [m].
        corners: Shape (k, 6), from `corner_table`.
        c: Which corner.
        ratio: Speed ratio a = v_e / v_p.
    """
    cosine, sine = math.cos(corners[c, 2]), math.sin(corners[c, 2])
    rx, ry = px - corners[c, 0], py - corners[c, 1]
    x, y = cosine * rx + sine * ry, cosine * ry - sine * rx
    rx, ry = ex - corners[c, 0], ey - corners[c, 1]
    u, v = cosine * rx + sine * ry, cosine * ry - sine * rx
    least = _edge_margin(x, y, u, v, corners[c, 4], ratio)
    # Reflected about the obstacle's bisector, edge B is edge A.
    cosine, sine = math.cos(corners[c, 3]), math.sin(corners[c, 3])
    x, y = cosine * x + sine * y, sine * x - cosine * y
    u, v = cosine * u + sine * v, sine * u - cosine * v
    return min(least, _edge_margin(x, y, u, v, corners[c, 5], ratio))


@kernel
def _edge_margin(x: float, y: float, u: float, v: float, length: float, ratio: float) -> float:
    """Margin of an edge along the negative x axis; pursuer at (x, y), evader at (u, v)."""
    beyond = u - min(max(u, -length), 0.0)
    to_edge = math.sqrt(beyond * beyond + v * v)
    # Straight up where the pursuer is right of the corner, round the corner where it is left.
    to_star = -y if x >= 0.0 else math.copysign(math.sqrt(x * x + y * y), -y)
    return to_edge - ratio * to_star


@kernel
def least_threat(
    j: int,
    pursuers: np.ndarray,
    evaders: np.ndarray,
    visibility: np.ndarray,
    pursuer_corners: np.ndarray,
    evader_corners: np.ndarray,
    corners: np.ndarray,
    ratio: float,
) -> float:
    """Margin of the corner round which evader j comes nearest to escaping [m] (kernel).

    Args:
        j: The evader.
        pursuers, evaders: Positions, shapes (2 n,), (2 m,) [m].
        visibility, pursuer_corners, evader_corners: From `split_sight`, shapes (n, m), (n, k),
            (m, k).
        corners: Shape (k, 6), from `corner_table`.
        ratio: Speed ratio a = v_e / v_p.

    Returns:
        For each corner the best defender counts; infinite where no corner is shared.
    """
    least = np.inf
    for c in range(len(corners)):
        if evader_corners[j, c] < 0.5:
            continue
        best = -np.inf
        for i in range(len(pursuers) // 2):
            if visibility[i, j] > 0.5 and pursuer_corners[i, c] > 0.5:
                px, py = pursuers[2 * i], pursuers[2 * i + 1]
                ex, ey = evaders[2 * j], evaders[2 * j + 1]
                best = max(best, signed_margin(px, py, ex, ey, corners, c, ratio))
        if best > -np.inf:
            least = min(least, best)
    return least
