"""The players' policies in the corner game: pursuit fields, and the evader's best play.

`table_field` is Table 2.2 of Zhang 2014 in one right-handed frame; `margin_field` blends the same
two directions by the margin that each protects, and keeps sight wherever the game says that it can
be kept. With p = (r_p, phi_p) the directions are

    t = (-sin phi_p, cos phi_p)    turns the sight ray towards edge A fastest,
    s                              leads to the star region by the shortest way.

Every field returns a unit vector and its reach, the distance D_p to the star region [m]: a step
longer than that overshoots. In the star region all are (0, 0, 0): this corner threatens nothing.

Table 2.1 stands here as printed, in the frame of `corner_game` with phi_p <= alpha.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import ArrayLike

from ..errors import InvalidInput, require, require_finite, require_one_of
from .corner_game import (
    HIDDEN,
    IN_STAR,
    REGION_1,
    REGION_2,
    REGION_3,
    REGION_4,
    from_corner_frame,
    margins,
    region,
    to_corner_frame,
)

TABLE = 0
MARGIN = 1
TABLE_UP = 2

# Names of the fields, and the codes by which numba kernels select one.
FIELDS = {"table": TABLE, "margin": MARGIN, "table_up": TABLE_UP}


@njit(cache=True)
def margin_field(
    r_p: float, phi_p: float, r_e: float, phi_e: float, alpha: float, a: float
) -> tuple[float, float, float]:
    """The margin field: u = normalise(|M1| t + M2 s), and t where that vanishes.

    Where the evader is hidden, u is the shortest way to the line from the evader through the
    corner, at right angles to it, or to the corner itself where that is nearer (g <= -pi/2).
    That regains sight of a resting evader soonest.

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

    The table does not cover a hidden evader; it is treated as in Region 1, from which it came.
    Arguments and results as in `margin_field`.
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


# Maps of the game over whole arrays of positions. Positions are Cartesian, in the corner's frame;
# pursuers on either side of the star region are handled. Source: Zhang 2014, Figures 2.1 to 2.3.

# The code of positions inside the obstacle, besides the region codes of `corner_game`.
BLOCKED = -1

# Farthest position from a corner: up to there the angle STAR_RIM is a negligible length [m].
FARTHEST = 1e6

# A point this close to an edge, relative to its distance from the corner, belongs to free space.
ON_EDGE = 1e-12


def inside_obstacle(points: object, alpha: float) -> np.ndarray:
    """Whether points are inside the obstacle; its edges belong to free space.

    Args:
        points: Positions in the corner's frame, shape (..., 2) [m].
        alpha: Interior angle of the obstacle, in (0, pi) [rad].

    Returns:
        Booleans, shape (...).

    Raises:
        InvalidInput: `alpha` is out of range, or `points` are not positions within FARTHEST.
    """
    _require_angle(alpha)
    x, y = np.moveaxis(_positions("points", points), -1, 0)
    # Below edge A, and clockwise of edge B.
    slack = ON_EDGE * np.hypot(x, y)
    return (y < -slack) & (x * math.sin(alpha) - y * math.cos(alpha) < -slack)


def partition(pursuer: object, points: object, alpha: float, a: float) -> np.ndarray:
    """Regions of evader positions for one pursuer (Figure 2.1).

    Args:
        pursuer: Position in the corner's frame, shape (2,) [m].
        points: Evader's positions, shape (..., 2) [m].
        alpha: Interior angle of the obstacle, in (0, pi) [rad].
        a: Speed ratio v_e / v_p, in (0, 1).

    Returns:
        Codes of `corner_game`, BLOCKED inside the obstacle, shape (...), int8.

    Raises:
        InvalidInput: An argument is out of range, or the pursuer is inside the obstacle.
    """
    _require_game(alpha, a)
    fixed = _free_position("pursuer", pursuer, alpha)
    evaders = _positions("points", points)
    pursuers = np.broadcast_to(fixed, evaders.shape)
    return _regions(pursuers, evaders, alpha, a)


def pursuer_partition(evader: object, points: object, alpha: float, a: float) -> np.ndarray:
    """Regions of pursuer positions for one evader (Figure 2.2).

    Args:
        evader: Position in the corner's frame, shape (2,) [m].
        points: Pursuer's positions, shape (..., 2) [m].
        alpha, a: As in `partition`.

    Returns:
        Codes of `corner_game`, BLOCKED inside the obstacle, shape (...), int8.

    Raises:
        InvalidInput: An argument is out of range, or the evader is inside the obstacle.
    """
    _require_game(alpha, a)
    fixed = _free_position("evader", evader, alpha)
    pursuers = _positions("points", points)
    evaders = np.broadcast_to(fixed, pursuers.shape)
    return np.where(
        inside_obstacle(pursuers, alpha), BLOCKED, _regions(pursuers, evaders, alpha, a)
    ).astype(np.int8)


def field_grid(field: str, evader: object, points: object, alpha: float, a: float) -> np.ndarray:
    """A pursuit field over pursuer positions, for one evader (Figure 2.3).

    Args:
        field: A name out of `FIELDS`.
        evader: Position in the corner's frame, shape (2,) [m].
        points: Pursuer's positions, shape (..., 2) [m].
        alpha, a: As in `partition`.

    Returns:
        (ux, uy, reach), the unit vector and the distance that caps a step [m], zeros in the star
        region and inside the obstacle, shape (..., 3).

    Raises:
        InvalidInput: An argument is out of range, or the evader is inside the obstacle.
    """
    require_one_of("field", field, FIELDS)
    _require_game(alpha, a)
    fixed = _free_position("evader", evader, alpha)
    pursuers = _positions("points", points)
    vectors = _field_vectors(FIELDS[field], pursuers.reshape(-1, 2), fixed, alpha, a)
    vectors[inside_obstacle(pursuers, alpha).ravel()] = 0.0
    return vectors.reshape(*pursuers.shape[:-1], 3)


def _regions(pursuers: np.ndarray, evaders: np.ndarray, alpha: float, a: float) -> np.ndarray:
    codes = _region_codes(pursuers.reshape(-1, 2), evaders.reshape(-1, 2), alpha, a)
    codes = codes.reshape(evaders.shape[:-1])
    return np.where(inside_obstacle(evaders, alpha), BLOCKED, codes).astype(np.int8)


@njit(cache=True)
def _region_codes(pursuers, evaders, alpha, a):
    codes = np.empty(len(pursuers), np.int8)
    for n in range(len(pursuers)):
        r_p, phi_p, r_e, phi_e, _ = to_corner_frame(
            pursuers[n, 0], pursuers[n, 1], evaders[n, 0], evaders[n, 1], 0.0, 0.0, 0.0, alpha
        )
        codes[n] = region(r_p, phi_p, r_e, phi_e, alpha, a)
    return codes


@njit(cache=True)
def _field_vectors(kind, pursuers, evader, alpha, a):
    vectors = np.empty((len(pursuers), 3))
    for n in range(len(pursuers)):
        vectors[n] = corner_field(
            kind,
            pursuers[n, 0],
            pursuers[n, 1],
            evader[0],
            evader[1],
            0.0,
            0.0,
            0.0,
            alpha,
            a,
        )
    return vectors


def _require_angle(alpha: float) -> None:
    require_finite("alpha", alpha)
    require(0 < alpha < math.pi, "alpha", "lie between 0 and pi [rad]", alpha)


def _require_game(alpha: float, a: float) -> None:
    _require_angle(alpha)
    require_finite("a", a)
    require(0 < a < 1, "a", "lie strictly between 0 and 1", a)


def _positions(name: str, points: object) -> np.ndarray:
    try:
        array = np.asarray(points, dtype=float)
    except (TypeError, ValueError):
        raise InvalidInput(f"`{name}` must be positions [x, y]; got {points!r}") from None
    shaped = array.ndim >= 1 and array.shape[-1] == 2
    require(shaped, name, "be positions [x, y]", f"an array of shape {array.shape}")
    require(bool(np.isfinite(array).all()), name, "be finite", "NaN or an infinity")
    require_near(name, array)
    return array


def require_near(name: str, points: ArrayLike) -> None:
    """Require positions within FARTHEST of a corner, where STAR_RIM is a negligible length.

    Args:
        name: Name of the parameter in error messages.
        points: In the corner's frame, shape (..., 2) [m].

    Raises:
        InvalidInput: One is beyond FARTHEST.
    """
    most = float(np.abs(points).max(initial=0.0))
    require(most <= FARTHEST, name, f"be within {FARTHEST:g} m of the corner", most)


def _free_position(name: str, point: object, alpha: float) -> np.ndarray:
    position = _positions(name, point)
    require(position.shape == (2,), name, "be one position [x, y]", position.tolist())
    blocked = bool(inside_obstacle(position, alpha))
    require(not blocked, name, "not be inside the obstacle", position.tolist())
    return position


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
