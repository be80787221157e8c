"""The corner game: who wins, and how long sight lasts, from two positions around one corner.

The corner is the origin of its frame, the obstacle a wedge of interior angle alpha. Edge A lies
along the negative x axis (polar angle pi), edge B at polar angle alpha - pi; free directions are
[alpha - pi, pi]. See `Corners` in `geometry.world` for the headings of a polygon's corners.
Nothing that follows depends on which of the two edges is called A: a pursuer beyond the star
region on the far side is reflected about the obstacle's bisector.

Functions of the game take polar coordinates in that frame, with phi_p <= alpha, and the speed
ratio a = v_e / v_p in (0, 1). Two distances decide the game: D_p from the pursuer to the star
region, from which it sees round the corner, and D_e from the evader to edge A, where it is out of
sight of every pursuer short of the star region. The evader wins iff M1 = D_e - a D_p < 0.

Source: Zhang 2014, section 2.2.2, Table 2.1, worked out in one right-handed frame, its figures
being lost.
"""

import math

import numpy as np
from numba import njit

from ..errors import require_type
from ..geometry.edge_index import EdgeIndex
from ..geometry.segment_sight import segment_is_clear
from ..geometry.world import World

# A pursuer within this angle of the star region counts as inside [rad]. Pursuers run exactly to
# its rim, where rounding would otherwise decide whether the corner threatens.
STAR_RIM = 1e-9


@njit(cache=True)
def free_angle(x: float, y: float, alpha: float) -> float:
    """Polar angle of a frame point in [alpha - pi, pi] [rad].

    The branch cut runs along the obstacle's bisector, so that a point on an edge, or behind it by
    a rounding error, gets the angle of that edge and never that of the other.

    Args:
        x, y: The point in the corner's frame [m].
        alpha: Interior angle of the obstacle [rad].
    """
    angle = math.atan2(y, x)
    if angle < 0.5 * alpha - math.pi:
        angle += 2.0 * math.pi
    return min(max(angle, alpha - math.pi), math.pi)


@njit(cache=True)
def to_corner_frame(
    px: float,
    py: float,
    ex: float,
    ey: float,
    cx: float,
    cy: float,
    heading: float,
    alpha: float,
) -> tuple[float, float, float, float, bool]:
    """Carry a pursuer and an evader from the world into a corner's frame.

    Args:
        px, py: Pursuer's world position [m].
        ex, ey: Evader's world position [m].
        cx, cy: Corner's world position [m].
        heading: World heading of the frame's positive x axis [rad].
        alpha: Interior angle of the obstacle at the corner, in (0, pi) [rad].

    Returns:
        (r_p, phi_p, r_e, phi_e, mirrored): polar coordinates [m], [rad] of both. Where
        phi_p > alpha both are reflected (phi -> alpha - phi) and `mirrored` is set, so that
        phi_p <= alpha always; within STAR_RIM of the star region it is clamped into it. A
        pursuer at the corner gets phi_p = 0, an evader there phi_e = min(pi + phi_p, pi/2): it
        is in sight, and can reach edge A at once.
    """
    cosine = math.cos(heading)
    sine = math.sin(heading)
    x = cosine * (px - cx) + sine * (py - cy)
    y = cosine * (py - cy) - sine * (px - cx)
    r_p = math.hypot(x, y)
    phi_p = 0.0 if r_p == 0.0 else free_angle(x, y, alpha)
    x = cosine * (ex - cx) + sine * (ey - cy)
    y = cosine * (ey - cy) - sine * (ex - cx)
    r_e = math.hypot(x, y)
    phi_e = free_angle(x, y, alpha)
    mirrored = phi_p > alpha + STAR_RIM
    if -STAR_RIM <= phi_p <= alpha + STAR_RIM:
        phi_p = min(max(phi_p, 0.0), alpha)
    if mirrored:
        # alpha - pi <= alpha - phi_p < 0; the outer clamp removes rounding errors.
        phi_p = max(alpha - phi_p, alpha - math.pi)
        phi_e = min(alpha - phi_e, math.pi)
    if r_e == 0.0:
        phi_e = min(math.pi + phi_p, 0.5 * math.pi)
    return r_p, phi_p, r_e, phi_e, mirrored


@njit(cache=True)
def from_corner_frame(
    ux: float, uy: float, heading: float, alpha: float, mirrored: bool
) -> tuple[float, float]:
    """Carry a vector from a corner's frame back into the world, undoing the reflection.

    Args:
        ux, uy: Components in the (reflected) frame, any unit [-].
        heading: World heading of the frame's positive x axis [rad].
        alpha: Interior angle of the obstacle at the corner [rad].
        mirrored: What `to_corner_frame` returned.

    Returns:
        World components, same unit.
    """
    if mirrored:
        # Reflection about the line at angle alpha / 2.
        cosine = math.cos(alpha)
        sine = math.sin(alpha)
        ux, uy = cosine * ux + sine * uy, sine * ux - cosine * uy
    cosine = math.cos(heading)
    sine = math.sin(heading)
    return cosine * ux - sine * uy, sine * ux + cosine * uy


# Region codes. The numbers of the regions are those of Table 2.1.
IN_STAR = 0
REGION_1 = 1
REGION_2 = 2
REGION_3 = 3
REGION_4 = 4
REGION_5 = 5
HIDDEN = 6

# Names of the regions of the partition, by number.
REGION_NAMES = {
    IN_STAR: "star",
    REGION_1: "1",
    REGION_2: "2",
    REGION_3: "3",
    REGION_4: "4",
    REGION_5: "5",
    HIDDEN: "hidden",
}


@njit(cache=True)
def margins(
    r_p: float, phi_p: float, r_e: float, phi_e: float, alpha: float, a: float
) -> tuple[float, float, float, float, float]:
    """Return the lengths that decide the game.

    Args:
        r_p, phi_p: Pursuer in the corner's frame [m], [rad].
        r_e, phi_e: Evader in the corner's frame [m], [rad].
        alpha: Interior angle of the obstacle [rad].
        a: Speed ratio v_e / v_p, in (0, 1).

    Returns:
        (m1, m2, d_p, d_e, gap). m1 = d_e - a d_p [m], negative where the evader wins; m2, from
        the evader to the sight ray [m]; d_p, from the pursuer to the star region, zero inside
        it [m]; d_e, from the evader to edge A [m]; gap = pi + phi_p - phi_e, negative where the
        evader is hidden [rad].
    """
    if r_e == 0.0:
        phi_e = min(math.pi + phi_p, 0.5 * math.pi)
    gap = math.pi + phi_p - phi_e
    if phi_p >= 0.0:
        d_p = 0.0
    elif phi_p >= -0.5 * math.pi:
        d_p = -r_p * math.sin(phi_p)
    else:
        d_p = r_p
    d_e = r_e if phi_e <= 0.5 * math.pi else r_e * math.sin(phi_e)
    m2 = r_e * math.sin(gap) if gap < 0.5 * math.pi else r_e
    return d_e - a * d_p, m2, d_p, d_e, gap


@njit(cache=True)
def region(r_p: float, phi_p: float, r_e: float, phi_e: float, alpha: float, a: float) -> int:
    """Return the region code of a state: IN_STAR, HIDDEN or REGION_1 to REGION_5.

    The pursuer wins everywhere but in Region 1 and where the evader is hidden already. It is proved
    that the regions cover all states; the borders between 2 and 4, and 3 and 5, are our reading.

    Arguments as in `margins`.
    """
    if r_p == 0.0 or phi_p >= 0.0:
        return IN_STAR
    m1, _, _, _, gap = margins(r_p, phi_p, r_e, phi_e, alpha, a)
    if gap < 0.0:
        return HIDDEN
    if m1 < 0.0:
        return REGION_1
    if r_e < a * r_p:
        return REGION_2 if phi_e <= 0.5 * math.pi else REGION_4
    return REGION_5 if r_e >= a * r_p * (1.0 - phi_p) else REGION_3


@njit(cache=True)
def escape_time(
    r_p: float, phi_p: float, r_e: float, phi_e: float, alpha: float, a: float, v_p: float
) -> float:
    """Return T*, how long sight lasts when both players play optimally [s].

    Infinite where the pursuer wins, zero where the evader is hidden already.

    Args:
        r_p, phi_p, r_e, phi_e, alpha, a: As in `margins`.
        v_p: Pursuer's top speed [m/s].
    """
    code = region(r_p, phi_p, r_e, phi_e, alpha, a)
    if code == HIDDEN:
        return 0.0
    if code != REGION_1:
        return math.inf
    return dash(r_p, phi_p, r_e, phi_e, a) / (a * v_p)


@njit(cache=True)
def dash(r_p: float, phi_p: float, r_e: float, phi_e: float, a: float) -> float:
    """Distance that a winning evader runs until sight is lost [m]: v_e T*, by formula in any state.

    Where the pursuer wins it is the length of a dash that would come too late; it is zero where
    the evader is hidden already. Arguments as in `margins`, phi_p < 0.
    """
    gap = math.pi + phi_p - phi_e
    if gap < 0.0:
        return 0.0
    wx = r_e * math.cos(phi_e) + a * r_p * math.cos(phi_p)
    wy = r_e * math.sin(phi_e) + a * r_p * math.sin(phi_p)
    along = wx * math.cos(phi_e) + wy * math.sin(phi_e)
    if r_e > 0.0 and gap < 0.5 * math.pi and along < 0.0:
        # e + a p stays fixed while both run at right angles to it; sight is lost when p, O and e
        # are collinear.
        return a * r_p * r_e * math.sin(gap) / math.hypot(wx, wy)
    return r_e


def corner_table(world: World) -> np.ndarray:
    """Table of the corners of a world, one per row.

    Returns:
        Shape (k, 6): x, y [m], heading of the frame, interior angle [rad], lengths of edges A and
        B [m].

    Raises:
        InvalidInput: `world` is not a World.
    """
    require_type("world", world, World)
    corners = world.corners
    return np.column_stack([corners.points, corners.headings, corners.angles, corners.lengths])


def least_escape_time(
    index: EdgeIndex,
    corners: np.ndarray,
    pursuer: np.ndarray,
    evader: np.ndarray,
    ratio: float,
    speed: float,
) -> float:
    """An approximate upper bound on the time in sight among polygons: the least T* of all corners.

    An evader that plays the game of one corner alone is out of sight by that corner's T*, whatever
    the pursuer does, if the corner's edges are long enough and nothing is in the evader's way. If
    no corner is lost, each alone can be held, but not necessarily all of them. Corners count that
    pursuer and evader both see.

    Args:
        index: Edges of the world.
        corners: From `corner_table`, shape (k, 6).
        pursuer, evader: Positions, shape (2,) [m].
        ratio: Speed ratio a = v_e / v_p, in (0, 1).
        speed: Of the pursuer [m/s].

    Returns:
        T* [s]; infinite where each corner alone can be held.
    """
    px, py = (float(value) for value in pursuer)
    ex, ey = (float(value) for value in evader)
    least = math.inf
    for x, y, heading, angle in corners[:, :4].tolist():
        if segment_is_clear(index, px, py, x, y) and segment_is_clear(index, ex, ey, x, y):
            r_p, phi_p, r_e, phi_e, _ = to_corner_frame(px, py, ex, ey, x, y, heading, angle)
            time = escape_time(r_p, phi_p, r_e, phi_e, angle, ratio, speed)
            least = min(least, time)
    return least
