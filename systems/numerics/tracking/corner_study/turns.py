"""The two players' turns in the dynamic programme of `game_solution`, over the whole grid."""

import math

import numpy as np
from numba import njit

from .moves import growth


@njit(cache=True)
def pursuer_turn(
    value: np.ndarray,
    out: np.ndarray,
    cell: np.ndarray,
    share: np.ndarray,
    distance: np.ndarray,
) -> None:
    """out = the largest value that one step of the pursuer leads to.

    Args:
        value, out: Values, shape (p, r, e).
        cell, share, distance: The pursuer's `Landings`, shape (p, d) each.
    """
    n_p, n_r, n_e = value.shape
    out[:] = value
    for i in range(n_p - 1):
        for d in range(cell.shape[1]):
            c, s, r = cell[i, d], share[i, d], distance[i, d]
            if r == 0.0:
                continue
            for k in range(1, n_r):
                # rho grows as r_p shrinks.
                place = min(k / r, n_r - 1.0)
                ratio = k / (r * place)
                m = min(int(place), n_r - 2)
                f = place - m
                near_in, near_out = (1.0 - s) * (1.0 - f), (1.0 - s) * f
                far_in, far_out = s * (1.0 - f), s * f
                for j in range(n_e):
                    x = near_in * value[c, m, j] + near_out * value[c, m + 1, j]
                    x += far_in * value[c + 1, m, j] + far_out * value[c + 1, m + 1, j]
                    x = r * growth(x, ratio)
                    if x > out[i, k, j]:
                        out[i, k, j] = x


@njit(cache=True)
def evader_turn(
    value: np.ndarray,
    out: np.ndarray,
    cell: np.ndarray,
    share: np.ndarray,
    distance: np.ndarray,
    angles: np.ndarray,
    phi_e: np.ndarray,
    rho: np.ndarray,
    step: float,
    timed: bool,
) -> None:
    """out = the smallest value, after a step's time if `timed`, that one evader's step leads to.

    A timed step into the shadow ends on the sight ray.

    Args:
        value, out: Values, shape (e, r, p).
        cell, share, distance: The evader's `Landings`, shape (e, r, d + 1) each.
        angles: Its directions, shape (d,) [rad].
        phi_e, rho, step: Of the grid, shapes (e,), (r,) [rad], [r_p], [r_p / v_p].
        timed: Whether the value is a time.
    """
    n_e, n_r, n_p = value.shape
    # The sight ray of the pursuer's node i passes through the evader's node i + offset.
    offset = n_e - n_p
    cost = step if timed else 0.0
    out[:] = value + cost
    for j in range(n_e):
        for k in range(n_r):
            for d in range(len(angles) + 1):
                c, s = cell[j, k, d], share[j, k, d]
                place = min(distance[j, k, d], n_r - 1.0)
                ratio = distance[j, k, d] / place if place > 0.0 else 1.0
                m = min(int(place), n_r - 2)
                f = place - m
                near_in, near_out = (1.0 - s) * (1.0 - f), (1.0 - s) * f
                far_in, far_out = s * (1.0 - f), s * f
                first = last = 0
                if timed:
                    first = max(j - offset + 1, 0)
                    last = max(min(math.ceil(c + s) - offset, n_p - 1), first)
                for i in range(first):
                    x = near_in * value[c, m, i] + near_out * value[c, m + 1, i]
                    x += far_in * value[c + 1, m, i] + far_out * value[c + 1, m + 1, i]
                    x = cost + growth(x, ratio)
                    if x < out[j, k, i]:
                        out[j, k, i] = x
                for i in range(first, last):
                    x = rho[k]
                    if d < len(angles):
                        away = math.sin(angles[d] - phi_e[i + offset])
                        depth = rho[k] * math.sin(phi_e[i + offset] - phi_e[j])
                        x = min(depth / away, step) if away > 0.0 else step
                    if x < out[j, k, i]:
                        out[j, k, i] = x
                for i in range(last, n_p - 1):
                    x = near_in * value[c, m, i] + near_out * value[c, m + 1, i]
                    x += far_in * value[c + 1, m, i] + far_out * value[c + 1, m + 1, i]
                    x = cost + growth(x, ratio)
                    if x < out[j, k, i]:
                        out[j, k, i] = x
    # In the star region nobody moves.
    out[:, :, -1] = value[:, :, -1]
