"""Evaders that play to escape, each round the corner that it can reach best.

For each corner in sight an evader computes the margin M1 = D_e - a D_p of the corner game against
every pursuer that sees both the evader and the corner. The largest of these, that of the best
defender, is the margin of the corner. The evader makes for the corner with the smallest margin,
by the best play of the game against its best defender. A corner hides nothing, and is left out, if
one of these pursuers is in its star region.

A robot has a width: it comes no nearer to a corner than the corner of the grown obstacle. So the
evader's position is taken relative to the grown corner, and the pursuer's relative to the true
corner, which is the one that blocks sight.

Source: Zhang 2014, Table 2.1 (policy A), extended to many corners and pursuers.
"""

import math

import numpy as np

from ..compiled import compiled, kernel
from .corner_game import escape_time, from_corner_frame, margins, to_corner_frame
from .corner_policies import evader_policy
from .sight_state import split_sight


@kernel
def corner_stance(
    x: float, y: float, heading: float, angle: float, standoff: float
) -> tuple[float, float]:
    """Offset of the grown obstacle's corner from the true one [m], at most two standoffs long.

    Args:
        x, y: The corner [m]; the offset is the same wherever it is.
        heading, angle: Of the corner [rad].
        standoff: Least distance of the evader's centre from a wall [m].
    """
    reach = standoff / max(math.sin(0.5 * angle), 0.5)
    # The obstacle's bisector lies at angle/2 - pi in the corner's frame; the offset is opposite.
    out = heading + 0.5 * angle
    return reach * math.cos(out), reach * math.sin(out)


@kernel
def escape_velocity(
    j: int,
    pursuers: np.ndarray,
    evaders: np.ndarray,
    visibility: np.ndarray,
    pursuer_corners: np.ndarray,
    evader_corners: np.ndarray,
    corners: np.ndarray,
    ratio: float,
    speed: float,
    standoff: float,
) -> tuple[float, float]:
    """Velocity of evader j (kernel), given the blocks of sight separately.

    For the other arguments see `adversarial_velocities`.
    """
    c, i, _ = _best_corner(
        j,
        pursuers,
        evaders,
        visibility,
        pursuer_corners,
        evader_corners,
        corners,
        ratio,
        standoff,
    )
    if c < 0:
        return _away_from_nearest(j, pursuers, evaders, visibility, speed)
    return _towards(i, j, c, pursuers, evaders, corners, ratio, speed, standoff)


@kernel
def _towards(i, j, c, pursuers, evaders, corners, ratio, speed, standoff):
    """Velocity of evader j to corner c, which pursuer i defends."""
    r_p, phi_p, r_e, phi_e, mirrored = _meet(i, j, c, pursuers, evaders, corners, standoff)
    heading, angle = corners[c, 2], corners[c, 3]
    ux, uy = evader_policy(r_p, phi_p, r_e, phi_e, angle, ratio)
    ux, uy = from_corner_frame(ux, uy, heading, angle, mirrored)
    return speed * ux, speed * uy


@kernel
def _best_corner(
    j: int,
    pursuers: np.ndarray,
    evaders: np.ndarray,
    visibility: np.ndarray,
    pursuer_corners: np.ndarray,
    evader_corners: np.ndarray,
    corners: np.ndarray,
    ratio: float,
    standoff: float,
) -> tuple[int, int, float]:
    """The corner that evader j reaches best, who defends it, and the margin; -1, -1 for none."""
    n, k = len(pursuers) // 2, len(corners)
    best, best_c, best_i = np.inf, -1, -1
    for c in range(k):
        if evader_corners[j, c] < 0.5:
            continue
        worst, worst_i = -np.inf, -1
        for i in range(n):
            if visibility[i, j] < 0.5 or pursuer_corners[i, c] < 0.5:
                continue
            r_p, phi_p, r_e, phi_e, _ = _meet(i, j, c, pursuers, evaders, corners, standoff)
            margin, _, to_star, _, _ = margins(r_p, phi_p, r_e, phi_e, corners[c, 3], ratio)
            if to_star == 0.0:
                worst = np.inf
                break
            if margin > worst:
                worst, worst_i = margin, i
                if worst >= best:
                    break  # this corner cannot become better than the best one so far
        if worst < best and worst_i >= 0:
            best, best_c, best_i = worst, c, worst_i
    return best_c, best_i, best


@kernel
def _meet(
    i: int,
    j: int,
    c: int,
    pursuers: np.ndarray,
    evaders: np.ndarray,
    corners: np.ndarray,
    standoff: float,
) -> tuple[float, float, float, float, bool]:
    """Pursuer i in the frame of corner c, and evader j in that of the grown corner."""
    x, y, heading, angle = corners[c, 0], corners[c, 1], corners[c, 2], corners[c, 3]
    offset_x, offset_y = corner_stance(x, y, heading, angle, standoff)
    ex, ey = evaders[2 * j] - offset_x, evaders[2 * j + 1] - offset_y
    return to_corner_frame(pursuers[2 * i], pursuers[2 * i + 1], ex, ey, x, y, heading, angle)


@kernel
def _away_from_nearest(
    j: int, pursuers: np.ndarray, evaders: np.ndarray, visibility: np.ndarray, speed: float
) -> tuple[float, float]:
    """Straight away from the nearest pursuer that sees the evader; at rest when none does."""
    nearest, vx, vy = np.inf, 0.0, 0.0
    for i in range(len(pursuers) // 2):
        dx, dy = evaders[2 * j] - pursuers[2 * i], evaders[2 * j + 1] - pursuers[2 * i + 1]
        distance = math.hypot(dx, dy)
        if visibility[i, j] > 0.5 and 0.0 < distance < nearest:
            nearest, vx, vy = distance, speed * dx / distance, speed * dy / distance
    return vx, vy


@compiled
def adversarial_velocities(
    pursuers: np.ndarray,
    evaders: np.ndarray,
    sight: np.ndarray,
    corners: np.ndarray,
    ratio: float,
    speed: float,
    standoff: float,
) -> np.ndarray:
    """Velocities of a team of evaders.

    Args:
        pursuers, evaders: Positions, shapes (2 n,), (2 m,) [m].
        sight: Who sees what, from `observe`.
        corners: Shape (k, 6), from `corner_table`.
        ratio: Speed ratio a = v_e / v_p.
        speed: Evaders' top speed [m/s].
        standoff: Least distance of an evader's centre from a wall [m].

    Returns:
        Shape (2 m,) [m/s]. An evader that nobody sees waits; one that is seen but that no corner
        can hide runs away from the nearest pursuer that sees it.
    """
    n, m, k = len(pursuers) // 2, len(evaders) // 2, len(corners)
    visibility, pursuer_corners, evader_corners = split_sight(sight, n, m, k)
    velocities = np.zeros(len(evaders))
    for j in range(m):
        velocities[2 * j], velocities[2 * j + 1] = escape_velocity(
            j,
            pursuers,
            evaders,
            visibility,
            pursuer_corners,
            evader_corners,
            corners,
            ratio,
            speed,
            standoff,
        )
    return velocities


@compiled
def escape_outlooks(
    pursuers: np.ndarray,
    evaders: np.ndarray,
    sight: np.ndarray,
    corners: np.ndarray,
    ratio: float,
    speed: float,
    standoff: float,
) -> np.ndarray:
    """Each evader's velocity by the corner game, and its prospects at the corner it makes for.

    Args:
        pursuers, evaders, sight, corners, ratio, speed, standoff: See `adversarial_velocities`.

    Returns:
        For each evader, shape (m, 4): the velocity of `adversarial_velocities` [m/s]; the time
        until sight is lost [s], infinite if the corner can be defended; and the corner's margin
        [m], negative if it cannot. Both are against the best defender of the corner, and infinite
        where no corner can hide the evader.
    """
    n, m, k = len(pursuers) // 2, len(evaders) // 2, len(corners)
    visibility, pursuer_corners, evader_corners = split_sight(sight, n, m, k)
    outlooks = np.full((m, 4), np.inf)
    for j in range(m):
        c, i, margin = _best_corner(
            j,
            pursuers,
            evaders,
            visibility,
            pursuer_corners,
            evader_corners,
            corners,
            ratio,
            standoff,
        )
        if c < 0:
            vx, vy = _away_from_nearest(j, pursuers, evaders, visibility, speed)
        else:
            vx, vy = _towards(i, j, c, pursuers, evaders, corners, ratio, speed, standoff)
            r_p, phi_p, r_e, phi_e, _ = _meet(i, j, c, pursuers, evaders, corners, standoff)
            outlooks[j, 2] = escape_time(
                r_p, phi_p, r_e, phi_e, corners[c, 3], ratio, speed / ratio
            )
            outlooks[j, 3] = margin
        outlooks[j, 0], outlooks[j, 1] = vx, vy
    return outlooks
