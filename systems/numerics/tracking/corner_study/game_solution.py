"""The corner game solved on a grid by dynamic programming, from the motion model alone.

Two values are iterated. `lead` decides who wins: the evader minimises, over its path, the gap
pi + phi_p - phi_e while the pursuer is short of the star region and its distance to edge A when
the pursuer gets there. `time` is how long it takes the evader to get out of sight; once the
pursuer is in the star region the clock runs on until the evader is at edge A, which changes
nothing where the evader wins and keeps the value continuous.

The players take turns, first the evader, then the pursuer, each for one step; a turn of one leaves
the other's coordinates alone, so that each looks up its own two dimensions only.

Source: the motion model (2.1) of Zhang 2014; Isaacs 1965 for games of kind and of degree.
"""

import math

import numpy as np
from numba import njit

from .grid import CornerGrid, CornerValues, corner_grid
from .landings import Landings, evader_landings, pursuer_landings
from .moves import edge_distance, growth


def solve_corner_game(
    alpha: float, nodes: int = 21, directions: int = 48, tolerance: float = 1e-3
) -> CornerValues:
    """Solve the corner game on a grid.

    Args:
        alpha: Interior angle of the obstacle, in (0, pi) [rad].
        nodes: Number of pursuer angles, odd; the error falls in proportion to 1 / nodes.
        directions: Number of directions each player may take.
        tolerance: Largest change of a value in the last sweep, in units of the step.

    Returns:
        The values. Outside a strip |M1| < step about the barrier the sign of `lead` is right.

    Raises:
        InvalidInput: `alpha` or `nodes` is out of range.
    """
    grid = corner_grid(alpha, nodes)
    angles = 2 * math.pi * np.arange(directions) / directions
    pursuer = pursuer_landings(grid, angles, grid.step)
    evader = evader_landings(grid, angles)
    gap = grid.gap[:, :, None]
    star = np.array([[edge_distance(phi, rho) for rho in grid.rho] for phi in grid.phi_e])
    # Rounding leaves sin(pi) positive.
    star[-1] = 0.0

    limit = np.broadcast_to(gap, grid.shape).copy()
    # From the corner itself the evader steps onto edge A.
    limit[:, :, 0] = grid.phi_p[:, None]
    lead, n_lead, r_lead = _iterate(grid, limit, star, pursuer, evader, angles, False, tolerance)
    limit = np.where(gap > 0, math.inf, 0.0) * np.ones(grid.shape)
    limit[:, :, 0] = 0.0
    time, n_time, r_time = _iterate(grid, limit, star, pursuer, evader, angles, True, tolerance)
    # The evader moved first in every round; half a step for the pursuer puts the turns in the
    # middle of each other.
    half = pursuer_landings(grid, angles, 0.5 * grid.step)
    balanced = np.empty_like(time)
    _pursuer_turn(time, balanced, half.cell, half.share, half.distance, half.spare, 0.0)
    return CornerValues(
        grid,
        lead,
        np.minimum(balanced, limit),
        (n_lead, n_time),
        max(r_lead, r_time),
        max(r_lead, r_time) < tolerance,
    )


def _iterate(
    grid: CornerGrid,
    limit: np.ndarray,
    star: np.ndarray,
    pursuer: Landings,
    evader: Landings,
    angles: np.ndarray,
    timed: bool,
    tolerance: float,
) -> tuple[np.ndarray, int, float]:
    """Sweep until nothing changes; returns the value, the number of sweeps, the last change."""
    value = np.zeros(grid.shape) if timed else limit.copy()
    value[-1] = star
    after, before = np.empty(grid.shape), np.empty(grid.shape)
    sweeps, change = 0, math.inf
    # A path takes a time of order one; ten times that is never needed.
    while change >= tolerance and sweeps < 10 / grid.step:
        credit = 0.0 if timed else 1.0
        _pursuer_turn(
            value, after, pursuer.cell, pursuer.share, pursuer.distance, pursuer.spare, credit
        )
        _evader_turn(
            after,
            before,
            evader.cell,
            evader.share,
            evader.distance,
            angles,
            grid.phi_e,
            grid.rho,
            grid.step,
            timed,
        )
        np.minimum(before, limit, out=before)
        before[-1] = star
        change = float(np.abs(before - value).max()) / grid.step
        value[:] = before
        sweeps += 1
    return value, sweeps, change


@njit(cache=True)
def _pursuer_turn(value, out, cell, share, distance, spare, credit):
    """out = the largest value that one pursuer's step leads to.

    Time that is spare in the star region counts `credit` each: the evader has had it already.
    """
    n_p, n_e, n_r = value.shape
    out[:] = value
    for i in range(n_p - 1):
        for d in range(cell.shape[1]):
            c, s, r = cell[i, d], share[i, d], distance[i, d]
            if r == 0.0:
                continue
            bonus = credit * spare[i, d]
            for k in range(1, n_r):
                place = min(k / r, n_r - 1.0)
                ratio = k / (r * place)
                m = min(int(place), n_r - 2)
                f = place - m
                w = (1.0 - s) * (1.0 - f), (1.0 - s) * f, s * (1.0 - f), s * f
                for j in range(n_e):
                    x = w[0] * value[c, j, m] + w[1] * value[c, j, m + 1]
                    x += w[2] * value[c + 1, j, m] + w[3] * value[c + 1, j, m + 1]
                    out[i, j, k] = max(out[i, j, k], r * growth(x, ratio) + bonus)


@njit(cache=True)
def _evader_turn(value, out, cell, share, distance, angles, phi_e, rho, step, timed):
    """out = the smallest value, after a step's time if `timed`, that one evader's step leads to.

    A timed step into the shadow ends on the sight ray.
    """
    n_p, n_e, n_r = value.shape
    n = len(angles)
    cost = step if timed else 0.0
    for i in range(n_p - 1):
        ray = n_e - n_p + i
        for j in range(n_e):
            for k in range(n_r):
                best = value[i, j, k] + cost
                for d in range(n + 1):
                    c, s = cell[j, k, d], share[j, k, d]
                    if timed and j < ray < c + s:
                        x = rho[k]
                        if d < n:
                            away = math.sin(angles[d] - phi_e[ray])
                            depth = rho[k] * math.sin(phi_e[ray] - phi_e[j])
                            x = min(depth / away, step) if away > 0.0 else step
                    else:
                        place = min(distance[j, k, d], n_r - 1.0)
                        ratio = distance[j, k, d] / place if place > 0.0 else 1.0
                        m = min(int(place), n_r - 2)
                        f = place - m
                        x = (1.0 - s) * ((1.0 - f) * value[i, c, m] + f * value[i, c, m + 1])
                        x += s * ((1.0 - f) * value[i, c + 1, m] + f * value[i, c + 1, m + 1])
                        x = cost + growth(x, ratio)
                    best = min(best, x)
                out[i, j, k] = best
    out[-1] = value[-1]
