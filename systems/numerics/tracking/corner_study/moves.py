"""How the players move round a corner, and how a value is read off a grid of their positions.

The numerical solutions of the corner game forget scale: lengths are in units of r_p, the
evader's also divided by the speed ratio, so that both players have speed one and the state is
(phi_p, phi_e, rho) with rho = r_e / (a r_p). A value is in units of r_p as well.
"""

import math

import numpy as np
from numba import njit


@njit(cache=True)
def pursuer_move(
    phi_p: float, ux: float, uy: float, step: float, alpha: float
) -> tuple[float, float, float]:
    """Move the pursuer from (1, phi_p), phi_p < 0, along (ux, uy), stopping in the star region.

    Args:
        phi_p: Polar angle in [alpha - pi, 0) [rad].
        ux, uy: Velocity, at most one long [v_p].
        step: Duration [r_p / v_p].
        alpha: Interior angle of the obstacle [rad].

    Returns:
        (phi, r, spare): where it gets to, sliding along edge B, and how much of the step was
        left when it reached the star region. phi = 0 there.
    """
    x = math.cos(phi_p) + step * ux
    y = math.sin(phi_p) + step * uy
    # Not free is what lies clockwise of edge B: move on along the edge instead.
    bx = -math.cos(alpha)
    by = -math.sin(alpha)
    if bx * y - by * x < 0.0:
        along = max(bx * x + by * y, 0.0)
        x, y = along * bx, along * by
    if y < 0.0:
        return max(math.atan2(y, x), alpha - math.pi), math.hypot(x, y), 0.0
    if y > 0.0:
        share = -math.sin(phi_p) / (step * uy)
        x = math.cos(phi_p) + share * step * ux
        return 0.0, abs(x), (1.0 - share) * step
    return 0.0, abs(x), 0.0


@njit(cache=True)
def evader_move(
    phi_e: float, rho: float, wx: float, wy: float, step: float, alpha: float
) -> tuple[float, float]:
    """Move the evader from (rho, phi_e) along (wx, wy), sliding along the obstacle's edges.

    A straight line that would pass through the obstacle from one edge to the other is refused;
    `round_corner` is the way round.

    Args:
        phi_e, rho: The evader's polar coordinates [rad], [r_p].
        wx, wy: Its velocity [v_p].
        step: Duration [r_p / v_p].
        alpha: Interior angle of the obstacle [rad].

    Returns:
        (phi, rho) after the step.
    """
    x = rho * math.cos(phi_e) + step * wx
    y = rho * math.sin(phi_e) + step * wy
    phi = math.atan2(y, x)
    if phi < 0.5 * alpha - math.pi:
        phi += 2.0 * math.pi
    if phi > math.pi:
        phi = math.pi
        r = max(-x, 0.0)
    elif phi < alpha - math.pi:
        phi = alpha - math.pi
        r = max(-x * math.cos(alpha) - y * math.sin(alpha), 0.0)
    else:
        r = math.hypot(x, y)
    if abs(phi - phi_e) > math.pi:
        return phi_e, rho
    return phi, r


@njit(cache=True)
def round_corner(phi_e: float, rho: float, step: float) -> tuple[float, float]:
    """Move the evader straight to the corner, and with what is left along edge A.

    Args:
        phi_e, rho: The evader's polar coordinates [rad], [r_p].
        step: Duration [r_p / v_p].
    """
    if rho >= step:
        return phi_e, rho - step
    return math.pi, step - rho


@njit(cache=True)
def edge_distance(phi_e: float, rho: float) -> float:
    """Distance from (rho, phi_e) to edge A, the half-line at polar angle pi."""
    return rho if phi_e <= 0.5 * math.pi else rho * math.sin(phi_e)


@njit(cache=True)
def growth(value: float, ratio: float) -> float:
    """Value at a state that is `ratio` >= 1 times as far out as the end of the grid.

    There the evader's distance is the only scale left, and times and distances grow with it. A
    negative lead is an angle, which does not.
    """
    return value * ratio if value > 0.0 else value


@njit(cache=True)
def look_up(
    values: np.ndarray,
    phi_p: float,
    phi_e: float,
    rho: float,
    spacing: float,
    spacing_rho: float,
) -> float:
    """Interpolate trilinearly in values of shape (phi_p, phi_e, rho), r_p = 1.

    The grid ends at phi_p = 0 and at phi_e = pi and begins at rho = 0. Beyond the largest rho a
    value is that at the largest rho, grown by `growth`.

    Args:
        values: At the grid's nodes, shape (p, e, r).
        phi_p, phi_e, rho: Where [rad], [rad], [r_p].
        spacing: Of the angles' nodes [rad].
        spacing_rho: Of the nodes in rho [r_e / (a r_p)].
    """
    n_p, n_e, n_r = values.shape
    f = n_p - 1 + phi_p / spacing
    g = n_e - 1 + (phi_e - math.pi) / spacing
    k = rho / spacing_rho
    scale = 1.0
    if k > n_r - 1:
        scale = k / (n_r - 1)
        k = n_r - 1.0
    i = min(max(int(f), 0), n_p - 2)
    j = min(max(int(g), 0), n_e - 2)
    m = min(int(k), n_r - 2)
    f = min(max(f - i, 0.0), 1.0)
    g = min(max(g - j, 0.0), 1.0)
    k -= m
    near = (1.0 - g) * ((1.0 - k) * values[i, j, m] + k * values[i, j, m + 1]) + g * (
        (1.0 - k) * values[i, j + 1, m] + k * values[i, j + 1, m + 1]
    )
    far = (1.0 - g) * ((1.0 - k) * values[i + 1, j, m] + k * values[i + 1, j, m + 1]) + g * (
        (1.0 - k) * values[i + 1, j + 1, m] + k * values[i + 1, j + 1, m + 1]
    )
    return growth((1.0 - f) * near + f * far, scale)
