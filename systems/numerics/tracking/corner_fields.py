"""Pursuit fields around one corner: which way the pursuer should run, from positions alone.

`table_field` is Table 2.2 of Zhang 2014 in one right-handed frame; `margin_field` blends the same
two directions by the margin that each protects, and keeps what the game says can be kept. With
p = (r_p, phi_p) they are

    t = (-sin phi_p, cos phi_p)    turns the sight ray towards edge A fastest,
    s                              leads to the star region by the shortest way.

Every field returns a unit vector and its reach, the distance D_p to the star region [m]: a step
longer than that overshoots. In the star region all are (0, 0, 0): this corner threatens nothing.
"""

import math

from numba import njit

from .corner_frame import from_corner_frame, to_corner_frame
from .corner_game import HIDDEN, IN_STAR, REGION_1, REGION_2, REGION_4, margins, region

TABLE = 0
MARGIN = 1
TABLE_UP = 2

# What the fields are called, and the code by which numba kernels select one.
FIELDS = {"table": TABLE, "margin": MARGIN, "table_up": TABLE_UP}


@njit(cache=True)
def margin_field(
    r_p: float, phi_p: float, r_e: float, phi_e: float, alpha: float, a: float
) -> tuple[float, float, float]:
    """The margin field: u = normalise(|M1| t + M2 s), and t where that vanishes.

    Where the evader is hidden, u is the shortest way to the line from the evader through the
    corner, at right angles to it, or to the corner itself where that is nearer (g <= -pi/2):
    the way that regains sight of a resting evader soonest.

    Args:
        r_p, phi_p, r_e, phi_e: Pursuer and evader in the corner's frame [m], [rad].
        alpha: Interior angle of the obstacle [rad].
        a: Speed ratio v_e / v_p, in (0, 1).

    Returns:
        (ux, uy, reach) in the frame; reach [m].
    """
    if r_p == 0.0 or phi_p >= 0.0:
        return 0.0, 0.0, 0.0
    m1, m2, reach, _, gap = margins(r_p, phi_p, r_e, phi_e, alpha, a)
    cosine = math.cos(phi_p)
    sine = math.sin(phi_p)
    if gap < 0.0:
        turn = max(math.cos(gap), 0.0)
        run = -math.sin(gap) if gap > -0.5 * math.pi else 1.0
        return -turn * sine - run * cosine, turn * cosine - run * sine, reach
    turn = abs(m1)
    if cosine >= 0.0:
        ux, uy = -turn * sine, turn * cosine + m2
    else:
        ux, uy = -turn * sine - m2 * cosine, turn * cosine - m2 * sine
    length = math.hypot(ux, uy)
    if length == 0.0:
        return -sine, cosine, reach
    return ux / length, uy / length, reach


@njit(cache=True)
def table_field(
    r_p: float, phi_p: float, r_e: float, phi_e: float, alpha: float, a: float
) -> tuple[float, float, float]:
    """Table 2.2 with its LD rows: left of the corner in Region 1, run straight for the corner.

    A hidden evader, of whom the table says nothing, is treated as in Region 1, where it came
    from. Arguments and results as in `margin_field`.
    """
    return _table(r_p, phi_p, r_e, phi_e, alpha, a, False)


@njit(cache=True)
def table_field_up(
    r_p: float, phi_p: float, r_e: float, phi_e: float, alpha: float, a: float
) -> tuple[float, float, float]:
    """Table 2.2 with its LU rows: left of the corner in Region 1, run parallel to edge B.

    Arguments and results as in `margin_field`.
    """
    return _table(r_p, phi_p, r_e, phi_e, alpha, a, True)


@njit(cache=True)
def _table(
    r_p: float, phi_p: float, r_e: float, phi_e: float, alpha: float, a: float, up: bool
) -> tuple[float, float, float]:
    code = region(r_p, phi_p, r_e, phi_e, alpha, a)
    if code == IN_STAR:
        return 0.0, 0.0, 0.0
    reach = margins(r_p, phi_p, r_e, phi_e, alpha, a)[2]
    if code in (REGION_2, REGION_4):
        return 0.0, 1.0, reach
    left = phi_p < -0.5 * math.pi
    if left and (code in (REGION_1, HIDDEN)):
        if up:
            return math.cos(alpha), math.sin(alpha), reach
        return -math.cos(phi_p), -math.sin(phi_p), reach
    return -math.sin(phi_p), math.cos(phi_p), reach


@njit(cache=True)
def corner_field(
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
) -> tuple[float, float, float]:
    """Evaluate a pursuit field of one corner in world coordinates.

    Args:
        kind: TABLE, MARGIN or TABLE_UP (see FIELDS); anything else counts as MARGIN.
        px, py, ex, ey: World positions of pursuer and evader [m].
        cx, cy, heading, alpha: The corner, as in `Corners` [m], [rad].
        a: Speed ratio v_e / v_p, in (0, 1).

    Returns:
        (ux, uy, reach): world unit vector and the distance that caps a step [m].
    """
    r_p, phi_p, r_e, phi_e, mirrored = to_corner_frame(px, py, ex, ey, cx, cy, heading, alpha)
    if kind == TABLE:
        ux, uy, reach = table_field(r_p, phi_p, r_e, phi_e, alpha, a)
    elif kind == TABLE_UP:
        ux, uy, reach = table_field_up(r_p, phi_p, r_e, phi_e, alpha, a)
    else:
        ux, uy, reach = margin_field(r_p, phi_p, r_e, phi_e, alpha, a)
    ux, uy = from_corner_frame(ux, uy, heading, alpha, mirrored)
    return ux, uy, reach
