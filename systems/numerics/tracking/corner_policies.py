"""The players' policies in the corner game: the evader's best play, and Table 2.1 as printed.

Source: Zhang 2014, Table 2.1, in the frame of `corner_game` with phi_p <= alpha.
"""

import math

from numba import njit

from .corner_fields import margin_field
from .corner_game import HIDDEN, IN_STAR, REGION_1, REGION_2, REGION_3, REGION_4, region


@njit(cache=True)
def table_evader_policy(
    r_p: float, phi_p: float, r_e: float, phi_e: float, alpha: float, a: float
) -> tuple[float, float]:
    """Table 2.1's policy A, extended to every region: take the shortest way to edge A.

    The evader runs straight to the corner where phi_e <= pi/2, straight down otherwise. At the
    corner, and on edge A, it continues along the edge, away from the corner.

    Args:
        r_p, phi_p, r_e, phi_e: Pursuer and evader in the corner's frame [m], [rad].
        alpha: Interior angle of the obstacle [rad].
        a: Speed ratio v_e / v_p, in (0, 1).

    Returns:
        (ux, uy), a unit vector in the frame.
    """
    if r_e == 0.0 or phi_e == math.pi:
        return -1.0, 0.0
    if phi_e <= 0.5 * math.pi:
        return -math.cos(phi_e), -math.sin(phi_e)
    return 0.0, -1.0


@njit(cache=True)
def evader_policy(
    r_p: float, phi_p: float, r_e: float, phi_e: float, alpha: float, a: float
) -> tuple[float, float]:
    """Policy of an evader that breaks sight soonest where it can; elsewhere it does the same.

    With w = e + a p: it runs at right angles to w, along (w_y, -w_x)/|w|, where g < pi/2 and
    e . w < 0, that is inside the circle whose diameter joins O and -a p; otherwise to the nearest
    point of edge A. This is time-optimal in Region 1. A hidden evader runs to edge A, where only a
    pursuer in the star region sees it, and then along it. If the pursuer is in the star region,
    the evader runs to the corner, where it threatens most.

    Arguments and results as in `table_evader_policy`.
    """
    code = region(r_p, phi_p, r_e, phi_e, alpha, a)
    if r_e > 0.0 and code == IN_STAR:
        return -math.cos(phi_e), -math.sin(phi_e)
    if r_e > 0.0 and code != HIDDEN and math.pi + phi_p - phi_e < 0.5 * math.pi:
        wx = r_e * math.cos(phi_e) + a * r_p * math.cos(phi_p)
        wy = r_e * math.sin(phi_e) + a * r_p * math.sin(phi_p)
        if wx * math.cos(phi_e) + wy * math.sin(phi_e) < 0.0:
            length = math.hypot(wx, wy)
            return wy / length, -wx / length
    return table_evader_policy(r_p, phi_p, r_e, phi_e, alpha, a)


@njit(cache=True)
def pursuer_policy(
    r_p: float,
    phi_p: float,
    r_e: float,
    phi_e: float,
    alpha: float,
    a: float,
    vx: float,
    vy: float,
) -> tuple[float, float]:
    """Table 2.1's pursuer policy, which in Region 3 reacts to the evader's velocity.

    Region 2, 4: straight up. Region 3: the mirror, u_t = (r_p/r_e) |v_t| and
    u_r = -(r_p/r_e) |v_r|, which never lets the gap or r_e/r_p shrink. Region 5: full speed
    along t. Region 1 and hidden evaders, which the table does not cover: the margin field.

    Args:
        r_p, phi_p, r_e, phi_e, alpha, a: As in `table_evader_policy`.
        vx, vy: Evader's velocity in the frame, in units of v_p, so at most `a` long.

    Returns:
        (ux, uy), the pursuer's velocity in the frame in units of v_p, at most one long.
    """
    code = region(r_p, phi_p, r_e, phi_e, alpha, a)
    if code == IN_STAR:
        return 0.0, 0.0
    if code in (REGION_2, REGION_4):
        return 0.0, 1.0
    if code in (REGION_1, HIDDEN):
        ux, uy, _ = margin_field(r_p, phi_p, r_e, phi_e, alpha, a)
        return ux, uy
    cosine = math.cos(phi_p)
    sine = math.sin(phi_p)
    if code == REGION_3:
        v_r = vx * math.cos(phi_e) + vy * math.sin(phi_e)
        v_t = vy * math.cos(phi_e) - vx * math.sin(phi_e)
        turn = r_p / r_e * abs(v_t)
        run = r_p / r_e * abs(v_r)
        return -turn * sine - run * cosine, turn * cosine - run * sine
    return -sine, cosine
