"""The corner game solved on a grid by dynamic programming, from the motion model alone.

Two values are iterated. `lead` decides who wins: the evader minimises, over its path, the gap
pi + phi_p - phi_e while the pursuer is short of the star region and its distance to edge A when
the pursuer gets there. `time` is how long it takes the evader to get out of sight; once the
pursuer is in the star region the clock runs on until the evader is at edge A, which changes
nothing where the evader wins and keeps the value continuous.

The players take turns, first the evader, then the pursuer, each for one step. A turn of one player
does not change the other's coordinates, so that each interpolates in two dimensions only.

Source: the motion model (2.1) of Zhang 2014; Isaacs 1965 for games of kind and of degree.
"""

import math

import numpy as np

from .moves import (
    CornerGrid,
    CornerValues,
    Landings,
    corner_grid,
    edge_distance,
    evader_landings,
    evader_turn,
    pursuer_landings,
    pursuer_turn,
)


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
    star = np.array([[edge_distance(phi, rho) for phi in grid.phi_e] for rho in grid.rho])
    # Rounding leaves sin(pi) positive.
    star[:, -1] = 0.0

    # From the corner itself the evader steps onto edge A.
    limit = np.repeat(grid.gap[:, None, :], len(grid.rho), axis=1)
    limit[:, 0, :] = grid.phi_p[:, None]
    lead, n_lead, r_lead = _iterate(grid, limit, star, pursuer, evader, angles, False, tolerance)
    limit = np.where(limit > 0, math.inf, 0.0)
    time, n_time, r_time = _iterate(grid, limit, star, pursuer, evader, angles, True, tolerance)
    # The evader moved first in every round; half a step for the pursuer makes up for that.
    half = pursuer_landings(grid, angles, 0.5 * grid.step)
    balanced = np.empty_like(time)
    pursuer_turn(time, balanced, half.cell, half.share, half.distance)
    residual = max(r_lead, r_time)
    return CornerValues(
        grid,
        lead.transpose(0, 2, 1).copy(),
        np.minimum(balanced, limit).transpose(0, 2, 1).copy(),
        (n_lead, n_time),
        residual,
        residual < tolerance,
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
    """Sweep until nothing changes; returns the value, the number of sweeps, the last change.

    Arrays are of shape (p, r, e) here, and (e, r, p) in the evader's turn, so that both inner
    loops run along contiguous memory.
    """
    value = np.zeros_like(limit) if timed else limit.copy()
    value[-1] = star
    answered = np.empty_like(value)
    begun = np.empty(value.shape[::-1])
    sweeps, change = 0, math.inf
    # A path takes a time of order one; ten times that is never needed.
    while change >= tolerance and sweeps < 10 / grid.step:
        pursuer_turn(value, answered, pursuer.cell, pursuer.share, pursuer.distance)
        evader_turn(
            answered.T.copy(),
            begun,
            evader.cell,
            evader.share,
            evader.distance,
            angles,
            grid.phi_e,
            grid.rho,
            grid.step,
            timed,
        )
        new = np.minimum(begun.T, limit)
        new[-1] = star
        change = float(np.abs(new - value).max()) / grid.step
        value = new
        sweeps += 1
    return value, sweeps, change
