"""A pursuer that looks a moment ahead: it goes where the least margin of all corners is greatest.

Threats are measured by the signed margins of the corners, with the edges' true lengths. A pursuer
tries a ring of steps and takes the one after which the soft minimum of the margins,
-b log(sum exp(-M / b)), is greatest: over the corners that it shares with its assigned evader, and
with other evaders that it sees, unless a teammate guards those better.

Source: ours, on the game of Zhang 2014, 2.2.2.
"""

import math

import numpy as np

from ..compiled import compiled, kernel
from ..geometry.edge_index import EdgeIndex
from ..geometry.wall_sliding import slide
from .sight_state import split_sight

# The corner game's margin extended: to edges of finite length, both sides, and the star region.
#
# M1 = D_e - a D_p takes an obstacle's edge to be infinite, and does not vary with the pursuer's
# position in the star region. Here each of a corner's two edges s has a margin of its own,
#
#     M_s = |e - s| - a D_s(p),
#
# with |e - s| the evader's distance from the edge [m], and D_s the pursuer's distance from where
# it sees along that edge, negative beyond. The corner's margin is the lesser of the two. It changes
# continuously as the pursuer enters the star region, and mirrors with the obstacle.
#
# Source: ours, on the game of Zhang 2014, 2.2.2.


@kernel
def signed_margin(
    px: float, py: float, ex: float, ey: float, corners: np.ndarray, c: int, ratio: float
) -> float:
    """Signed margin of one corner: the lesser of its two edges' margins [m] (kernel).

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
    # Right of the corner the shortest way is straight up; left of it, to the corner.
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
    """Least margin over all corners round which evader j could escape [m] (kernel).

    Args:
        j: The evader.
        pursuers, evaders: Positions, shapes (2 n,), (2 m,) [m].
        visibility, pursuer_corners, evader_corners: From `split_sight`, shapes (n, m), (n, k),
            (m, k).
        corners: Shape (k, 6), from `corner_table`.
        ratio: Speed ratio a = v_e / v_p.

    Returns:
        The least margin, with the best defender of each corner; infinite if no corner is shared.
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


# Number of step directions that are tried, besides staying.
DIRECTIONS = 32

# Duration of a tried step [s].
AHEAD = 0.1

# Width b of the soft minimum, given as the time that a pursuer needs to run it [s].
SOFTNESS = 0.17


@kernel
def _soft_minimum(
    px: float,
    py: float,
    ex: float,
    ey: float,
    i: int,
    j: int,
    pursuer_corners: np.ndarray,
    evader_corners: np.ndarray,
    corners: np.ndarray,
    ratio: float,
    width: float,
) -> float:
    """Soft minimum over the corners that pursuer i, moved to (px, py), and evader j share."""
    least, total = np.inf, 0.0
    for c in range(len(corners)):
        if pursuer_corners[i, c] < 0.5 or evader_corners[j, c] < 0.5:
            continue
        margin = signed_margin(px, py, ex, ey, corners, c, ratio)
        if margin < least:
            total = 1.0 + (total * math.exp((margin - least) / width) if total > 0.0 else 0.0)
            least = margin
        else:
            total += math.exp((least - margin) / width)
    return least - width * math.log(total) if total > 0.0 else np.inf


@compiled
def lookahead_velocities(
    region: EdgeIndex,
    pursuers: np.ndarray,
    evaders: np.ndarray,
    sight: np.ndarray,
    assignment: np.ndarray,
    corners: np.ndarray,
    ratio: float,
    speed: float,
) -> np.ndarray:
    """Velocities of a team that looks ahead.

    Args:
        region: Edges of where pursuers' centres may be.
        pursuers, evaders: Positions, shapes (2 n,), (2 m,) [m].
        sight: Who sees what, from `observe`.
        assignment: Each pursuer's evader, -1 for none, shape (n,).
        corners: Shape (k, 6), from `corner_table`.
        ratio: Speed ratio a = v_e / v_p.
        speed: Pursuers' top speed [m/s].

    Returns:
        Shape (2 n,) [m/s]; zero where no step is better than staying.
    """
    n, m, k = len(pursuers) // 2, len(evaders) // 2, len(corners)
    visibility, pursuer_corners, evader_corners = split_sight(sight, n, m, k)
    width = SOFTNESS * speed
    # How well each pursuer guards each evader from its present position.
    hold = np.full((n, m), -np.inf)
    for i in range(n):
        for j in range(m):
            if visibility[i, j] > 0.5:
                hold[i, j] = _soft_minimum(
                    pursuers[2 * i],
                    pursuers[2 * i + 1],
                    evaders[2 * j],
                    evaders[2 * j + 1],
                    i,
                    j,
                    pursuer_corners,
                    evader_corners,
                    corners,
                    ratio,
                    width,
                )
    velocities = np.zeros(len(pursuers))
    for i in range(n):
        x, y = pursuers[2 * i], pursuers[2 * i + 1]
        forward = _direction_to_evader(i, int(assignment[i]), pursuers, evaders, visibility)
        best = -np.inf
        for direction in range(-1, DIRECTIONS):
            dx, dy = 0.0, 0.0
            if direction >= 0:
                angle = forward + 2.0 * math.pi * direction / DIRECTIONS
                reach = speed * AHEAD
                dx, dy = slide(region, x, y, reach * math.cos(angle), reach * math.sin(angle))
            least, total = np.inf, 0.0
            for j in range(m):
                if visibility[i, j] < 0.5:
                    continue
                value = _soft_minimum(
                    x + dx,
                    y + dy,
                    evaders[2 * j],
                    evaders[2 * j + 1],
                    i,
                    j,
                    pursuer_corners,
                    evader_corners,
                    corners,
                    ratio,
                    width,
                )
                if j != int(assignment[i]):
                    for other in range(n):
                        if other != i:
                            value = max(value, hold[other, j])
                if value == np.inf:
                    continue
                if value < least:
                    total = 1.0 + (total * math.exp((value - least) / width) if total > 0 else 0.0)
                    least = value
                else:
                    total += math.exp((least - value) / width)
            score = least - width * math.log(total) if total > 0.0 else np.inf
            if score > best + 1e-12:
                best = score
                velocities[2 * i], velocities[2 * i + 1] = dx / AHEAD, dy / AHEAD
    return velocities


@kernel
def _direction_to_evader(
    i: int, target: int, pursuers: np.ndarray, evaders: np.ndarray, visibility: np.ndarray
) -> float:
    """Reference direction of the ring of steps [rad], which is rotated with the game."""
    nearest, x, y = np.inf, 1.0, 0.0
    for j in range(len(evaders) // 2):
        dx, dy = evaders[2 * j] - pursuers[2 * i], evaders[2 * j + 1] - pursuers[2 * i + 1]
        distance = -1.0 if j == target else math.sqrt(dx * dx + dy * dy)
        if visibility[i, j] > 0.5 and distance < nearest:
            nearest, x, y = distance, dx, dy
    return math.atan2(y, x)
