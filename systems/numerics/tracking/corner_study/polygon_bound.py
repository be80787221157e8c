"""An approximate upper bound from the corner game, among polygons, on the time in sight.

An evader that plays the game of one corner alone is out of sight by that corner's T*, whatever the
pursuer does, if the corner's edges are long enough and nothing is in the evader's way. The least
T* of all corners is therefore about the longest time for which sight can be kept. If no corner is
lost, each alone can be held, but not necessarily all of them.
"""

import math

import numpy as np

from ...geometry.edge_index import EdgeIndex
from ...geometry.segment_sight import segment_is_clear
from ..corner_game import escape_time, to_corner_frame


def least_escape_time(
    index: EdgeIndex,
    corners: np.ndarray,
    pursuer: np.ndarray,
    evader: np.ndarray,
    ratio: float,
    speed: float,
) -> float:
    """The least T* over the corners that pursuer and evader both see.

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
