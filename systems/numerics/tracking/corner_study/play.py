"""Simulation of the corner game: one pursuer's rule against evaders that try to get out of sight.

A time step is a fixed share of the present r_p / v_p. In each step both players hold the velocity
that they chose from the state at its beginning, as sampled controllers do.
"""

import math

import numpy as np
from numba import njit

from ...errors import require, require_non_negative, require_one_of
from ..corner_policies import evader_policy
from .best_response import PURSUERS, pursuer_direction, response_value
from .moves import CornerValues, evader_move, pursuer_move, round_corner

# A play ends in the pursuer's favour when r_p has shrunk to this share of what it was.
AT_CORNER = 1e-6

# Number of directions that an evader with a grid of values tries.
DIRECTIONS = 32


def play_out(
    pursuer: str,
    states: np.ndarray,
    alpha: float,
    a: float,
    values: CornerValues | None = None,
    aim: str = "lead",
    step: float = 0.005,
    horizon: float = 20.0,
    slack: float = 0.0,
) -> np.ndarray:
    """Play the game from many states.

    Args:
        pursuer: A name out of PURSUERS.
        states: Initial (phi_p, phi_e, rho), phi_p < 0, shape (n, 3) [rad], [rad], [a r_p].
        alpha: Interior angle of the obstacle, in (0, pi) [rad].
        a: Speed ratio v_e / v_p, in (0, 1).
        values: Values that the evader descends, knowing the pursuer's next move. Without values,
            and when hidden, it plays `evader_policy`, and rounds the corner when a step away.
        aim: Which of the values, "lead" (to get out of sight at all) or "time" (to do it soon).
        step: Duration of a step, in units of the present r_p / v_p.
        horizon: Time after which the pursuer has won, in units of the initial r_p / v_p.
        slack: Depth beyond the sight ray that the evader must reach to count as lost; before that
            it may be seen again; in units of the initial a r_p.

    Returns:
        Time at which sight is lost, in units of the initial r_p / v_p, infinite where it is kept,
        shape (n,).

    Raises:
        InvalidInput: An argument is out of range.
    """
    require_one_of("pursuer", pursuer, PURSUERS)
    require_one_of("aim", aim, ("lead", "time"))
    require(0 < alpha < math.pi, "alpha", "lie in (0, pi)", alpha)
    require(0 < a < 1, "a", "lie in (0, 1)", a)
    require(0 < step < 1, "step", "lie in (0, 1)", step)
    require_non_negative("slack", slack)
    require(bool((states[:, 0] < 0).all()), "states", "have phi_p < 0", states[:, 0].max())
    timed = aim == "time"
    grid = np.zeros((0, 0, 0)) if values is None else values.time if timed else values.lead
    spacing_rho = 1.0 if values is None else float(values.grid.rho[1])
    look = step if values is None else values.grid.step
    return _play_all(
        PURSUERS[pursuer], states, alpha, a, grid, spacing_rho, look, timed, step, horizon, slack
    )


@njit(cache=True)
def _play_all(kind, states, alpha, a, grid, spacing_rho, look, timed, step, horizon, slack):
    lost = np.empty(len(states))
    for n in range(len(states)):
        lost[n] = _play(
            kind,
            states[n, 0],
            states[n, 1],
            states[n, 2],
            alpha,
            a,
            grid,
            spacing_rho,
            look,
            timed,
            step,
            horizon,
            slack,
        )
    return lost


@njit(cache=True)
def _play(kind, phi_p, phi_e, rho, alpha, a, grid, spacing_rho, look, timed, step, horizon, slack):
    """Time at which sight is lost, from (1, phi_p) and (rho, phi_e)."""
    time, scale, hidden_since = 0.0, 1.0, math.inf
    while scale > AT_CORNER and time < horizon:
        gap = math.pi + phi_p - phi_e
        if gap < 0.0:
            hidden_since = min(hidden_since, time)
            depth = rho * (math.sin(-gap) if gap > -0.5 * math.pi else 1.0)
            if scale * depth >= slack:
                return hidden_since
        else:
            hidden_since = math.inf
        ux, uy = pursuer_direction(kind, 1.0, phi_p, a * rho, phi_e, alpha, a)
        best, wx, wy, corner = math.inf, 0.0, 0.0, False
        if grid.size == 0 or gap < 0.0:
            wx, wy = evader_policy(1.0, phi_p, a * rho, phi_e, alpha, a)
            corner = rho <= step and gap >= 0.0
        else:
            for d in range(-2, DIRECTIONS):
                x = response_value(
                    grid,
                    phi_p,
                    phi_e,
                    rho,
                    ux,
                    uy,
                    d,
                    DIRECTIONS,
                    look,
                    alpha,
                    spacing_rho,
                    timed,
                )
                if x < best:
                    best = x
                    corner = d == -1
                    wx, wy = 0.0, 0.0
                    if corner:
                        wx, wy = -math.cos(phi_e), -math.sin(phi_e)
                    elif d >= 0:
                        wx = math.cos(2.0 * math.pi * d / DIRECTIONS)
                        wy = math.sin(2.0 * math.pi * d / DIRECTIONS)
        phi, r, spare = pursuer_move(phi_p, ux, uy, step, alpha)
        if corner:
            psi, q = round_corner(phi_e, rho, step)
        else:
            psi, q = evader_move(phi_e, rho, wx, wy, step, alpha)
        if spare > 0.0 or phi == 0.0 or r == 0.0:
            # In the star region; before that the evader can only have rounded the corner.
            rounded = corner and rho < step - spare and slack == 0.0
            return time + scale * rho if rounded else math.inf
        after = math.pi + phi - psi
        if after < 0.0 <= gap:
            hidden_since = time + scale * (rho if corner else step * gap / (gap - after))
        time += scale * step
        scale *= r
        phi_p, phi_e, rho = phi, psi, q / r
    return math.inf
