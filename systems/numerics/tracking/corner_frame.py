"""The corner game's frame: one corner of a polygon, its edges always in the same place.

The corner is the origin, the obstacle a wedge of interior angle alpha. Edge A lies along the
negative x axis (polar angle pi), edge B at polar angle alpha - pi; free directions are
[alpha - pi, pi]. See `Corners` in `geometry.world` for where a polygon's corners get their
headings. Nothing that follows depends on which of the two edges is called A: a pursuer beyond
the star region on the far side is reflected about the obstacle's bisector.
"""

import math

from numba import njit

# A pursuer this near to the star region is in it [rad]. Pursuers run exactly to its rim, where
# rounding would otherwise decide whether the corner threatens.
STAR_RIM = 1e-9


@njit(cache=True)
def free_angle(x: float, y: float, alpha: float) -> float:
    """Polar angle of a frame point in [alpha - pi, pi] [rad].

    The branch cut runs along the obstacle's bisector, so that a point on an edge, or a rounding
    error behind one, gets the angle of that edge and never that of the other.

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
        # alpha - pi <= alpha - phi_p < 0; the outer clamp takes off what rounding adds.
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
