"""The corner game over whole arrays of positions: partitions and pursuit fields as maps.

Positions are Cartesian, in the corner's frame: the corner at the origin, edge A along the
negative x axis, edge B at polar angle alpha - pi (see `corner_frame`). Pursuers on either side of
the star region are handled. Source: Zhang 2014, Figures 2.1 to 2.3.
"""

import math

import numpy as np
from numba import njit

from ..errors import InvalidInput, require, require_finite, require_one_of
from .corner_fields import FIELDS, corner_field
from .corner_frame import to_corner_frame
from .corner_game import region

# The code of positions inside the obstacle, beside the region codes of `corner_game`.
BLOCKED = -1

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
        InvalidInput: `alpha` is out of range, or `points` are no finite positions.
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
    require(0 < a < 1, "a", "lie between 0 and 1", a)


def _positions(name: str, points: object) -> np.ndarray:
    try:
        array = np.asarray(points, dtype=float)
    except (TypeError, ValueError):
        raise InvalidInput(f"`{name}` must be positions [x, y]; got {points!r}") from None
    shaped = array.ndim >= 1 and array.shape[-1] == 2
    require(shaped, name, "be positions [x, y]", f"an array of shape {array.shape}")
    require(bool(np.isfinite(array).all()), name, "be finite", "NaN or an infinity")
    return array


def _free_position(name: str, point: object, alpha: float) -> np.ndarray:
    position = _positions(name, point)
    require(position.shape == (2,), name, "be one position [x, y]", position.tolist())
    blocked = bool(inside_obstacle(position, alpha))
    require(not blocked, name, "not be inside the obstacle", position.tolist())
    return position
