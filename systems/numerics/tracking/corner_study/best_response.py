"""The evader's best response to a pursuer whose rule is fixed, by dynamic programming on a grid.

The same two values as in `game_solution`, but only the evader chooses. Both players move at once,
and the evader knows the pursuer's next move.
"""

import math

import numpy as np
from numba import njit

from ...errors import require, require_one_of
from ..corner_policies import (
    FIELDS,
    MARGIN,
    TABLE,
    TABLE_UP,
    margin_field,
    table_field,
    table_field_up,
)
from .moves import (
    CornerGrid,
    CornerValues,
    Landings,
    corner_grid,
    edge_distance,
    evader_landings,
    evader_move,
    look_up,
    pursuer_move,
    round_corner,
)

TO_STAR = 3
TURN = 4
CHASE = 5
STAND = 6

# Names of the pursuers: the fields, always towards the star region, always turning the sight ray,
# straight at the evader, standing still.
PURSUERS = {**FIELDS, "to_star": TO_STAR, "turn": TURN, "chase": CHASE, "stand": STAND}


@njit(cache=True)
def pursuer_direction(
    kind: int, r_p: float, phi_p: float, r_e: float, phi_e: float, alpha: float, a: float
) -> tuple[float, float]:
    """Velocity of a pursuer short of the star region, in the corner's frame, at most one long.

    Args:
        kind: A code out of PURSUERS.
        r_p, phi_p, r_e, phi_e, alpha, a: As in `margin_field`; phi_p < 0.
    """
    if kind == MARGIN:
        ux, uy, _ = margin_field(r_p, phi_p, r_e, phi_e, alpha, a)
        return ux, uy
    if kind == TABLE:
        ux, uy, _ = table_field(r_p, phi_p, r_e, phi_e, alpha, a)
        return ux, uy
    if kind == TABLE_UP:
        ux, uy, _ = table_field_up(r_p, phi_p, r_e, phi_e, alpha, a)
        return ux, uy
    cosine = math.cos(phi_p)
    sine = math.sin(phi_p)
    if kind == TURN:
        return -sine, cosine
    if kind == TO_STAR:
        return (0.0, 1.0) if cosine >= 0.0 else (-cosine, -sine)
    if kind == CHASE:
        x = r_e * math.cos(phi_e) - r_p * cosine
        y = r_e * math.sin(phi_e) - r_p * sine
        length = math.hypot(x, y)
        return x / length, y / length
    return 0.0, 0.0


# Value of `time` where the evader never gets out of sight [r_p / v_p].
NEVER = 4.0


def solve_best_response(
    pursuer: str,
    alpha: float,
    a: float = 0.5,
    nodes: int = 21,
    directions: int = 32,
    tolerance: float = 1e-3,
) -> CornerValues:
    """Solve for the evader that plays best against one pursuer.

    Args:
        pursuer: A name out of PURSUERS.
        alpha: Interior angle of the obstacle, in (0, pi) [rad].
        a: Speed ratio v_e / v_p, in (0, 1).
        nodes: Number of pursuer angles, odd.
        directions: Number of directions the evader may take.
        tolerance: Largest change of a value in the last sweep, in units of the step.

    Returns:
        The values: `lead` is negative where the evader gets out of sight, `time` is how long that
        takes, or NEVER.

    Raises:
        InvalidInput: An argument is out of range.
    """
    require_one_of("pursuer", pursuer, PURSUERS)
    require(0 < a < 1, "a", "lie in (0, 1)", a)
    grid = corner_grid(alpha, nodes)
    evader = evader_landings(grid, 2 * math.pi * np.arange(directions) / directions)
    moved = _pursuer_steps(PURSUERS[pursuer], a, alpha, grid.phi_p, grid.phi_e, grid.rho, grid.step)
    gap = grid.gap[:, :, None]
    limit = np.broadcast_to(gap, grid.shape).copy()
    limit[:, :, 0] = grid.phi_p[:, None]
    star = np.array([[edge_distance(phi, rho) for rho in grid.rho] for phi in grid.phi_e])
    lead, n_lead, r_lead = _iterate(grid, moved, evader, limit, star, False, tolerance)
    limit = np.where(gap > 0, NEVER, 0.0) * np.ones(grid.shape)
    limit[:, :, 0] = 0.0
    never = np.full_like(star, NEVER)
    time, n_time, r_time = _iterate(grid, moved, evader, limit, never, True, tolerance)
    residual = max(r_lead, r_time)
    return CornerValues(grid, lead, time, (n_lead, n_time), residual, residual < tolerance)


def _iterate(
    grid: CornerGrid,
    moved: tuple[np.ndarray, np.ndarray, np.ndarray],
    evader: Landings,
    limit: np.ndarray,
    star: np.ndarray,
    timed: bool,
    tolerance: float,
) -> tuple[np.ndarray, int, float]:
    """Sweep until nothing changes; returns the value, the number of sweeps, the last change."""
    value = limit.copy()
    value[-1] = star
    sweeps, change = 0, math.inf
    # A path takes a time of order one; twenty times that is never needed.
    while change >= tolerance and sweeps < 20 / grid.step:
        change = _sweep(
            value,
            limit,
            *moved,
            evader.cell,
            evader.share,
            evader.distance,
            grid.phi_p,
            grid.phi_e,
            grid.rho,
            grid.step,
            timed,
        )
        change /= grid.step
        sweeps += 1
    return value, sweeps, change


@njit(cache=True)
def _pursuer_steps(kind, a, alpha, phi_p, phi_e, rho, step):
    """(phi, r, spare) after the pursuer's step from every node, shapes (p, e, r)."""
    shape = (len(phi_p), len(phi_e), len(rho))
    phi, r, spare = np.zeros(shape), np.ones(shape), np.zeros(shape)
    for i in range(shape[0] - 1):
        for j in range(shape[1]):
            psi = max(phi_e[j], alpha - math.pi)
            for k in range(shape[2]):
                ux, uy = pursuer_direction(kind, 1.0, phi_p[i], a * rho[k], psi, alpha, a)
                phi[i, j, k], r[i, j, k], spare[i, j, k] = pursuer_move(
                    phi_p[i], ux, uy, step, alpha
                )
    return phi, r, spare


@njit(cache=True)
def _sweep(value, limit, phi, r, spare, cell, share, distance, phi_p, phi_e, rho, step, timed):
    """Give each node the least value after one evader's step; return the largest change.

    Pursuers run towards the star region, evaders to the corner and edge A. Nodes are visited in
    such an order that the nodes they run to are updated first.
    """
    n_p, n_e, n_r = value.shape
    n = cell.shape[2]
    spacing = phi_p[1] - phi_p[0]
    change = 0.0
    for i in range(n_p - 2, -1, -1):
        for j in range(n_e - 1, -1, -1):
            gap = math.pi + phi_p[i] - phi_e[j]
            for k in range(1, n_r):
                best = limit[i, j, k]
                scale = r[i, j, k]
                ray = math.pi + phi[i, j, k]
                arrived = phi[i, j, k] == 0.0
                for d in range(n):
                    psi = phi_e[0] + spacing * (cell[j, k, d] + share[j, k, d])
                    q = distance[j, k, d] * rho[1]
                    if timed and ray < psi and gap > 0.0:
                        x = rho[k] if d == n - 1 else step * gap / (gap + psi - ray)
                    elif arrived:
                        x = NEVER if timed else edge_distance(psi, q) + spare[i, j, k]
                    else:
                        x = scale * look_up(value, phi[i, j, k], psi, q / scale, spacing, rho[1])
                        if timed:
                            x = min(x + step, NEVER)
                    best = min(best, x)
                change = max(change, abs(best - value[i, j, k]))
                value[i, j, k] = best
    return change


@njit(cache=True)
def response_value(
    value, phi_p, phi_e, rho, ux, uy, d, directions, step, alpha, spacing_rho, timed
):
    """Value after one step: the pursuer's along (ux, uy), the evader's in direction d.

    d = -1 is the way round the corner, d = -2 standing still.

    Args:
        value: Values at the grid's nodes, shape (p, e, r).
        phi_p, phi_e, rho: The state [rad], [rad], [r_p].
        ux, uy: The pursuer's velocity, at most one long.
        d: Number of the evader's direction, from 0.
        directions: How many the evader has, evenly round the circle.
        step: Duration [r_p / v_p].
        alpha: Interior angle of the obstacle [rad].
        spacing_rho: Distance of the grid's nodes in rho.
        timed: Whether the value is a time.
    """
    phi, r, spare = pursuer_move(phi_p, ux, uy, step, alpha)
    if d == -2:
        psi, q = phi_e, rho
    elif d == -1:
        psi, q = round_corner(phi_e, rho, step)
    else:
        angle = 2.0 * math.pi * d / directions
        psi, q = evader_move(phi_e, rho, math.cos(angle), math.sin(angle), step, alpha)
    if timed:
        before = math.pi + phi_p - phi_e
        after = math.pi + phi - psi
        if after < 0.0 <= before:
            return rho if d == -1 else step * before / (before - after)
    if r == 0.0 or phi == 0.0:
        return NEVER if timed else edge_distance(psi, q) + spare
    spacing = (math.pi - alpha) / (value.shape[0] - 1)
    x = r * look_up(value, phi, psi, q / r, spacing, spacing_rho)
    return min(x + step, NEVER) if timed else x
