"""The pursuit field around a pursuer: where it would run from other places."""

import math

import numpy as np

from ..compiled import compiled
from ..geometry.edge_index import EdgeIndex, point_is_free
from ..geometry.segment_sight import segment_is_clear
from .team_pursuit import pursuit_velocity


@compiled
def sample_field(
    index: EdgeIndex,
    points: np.ndarray,
    ex: float,
    ey: float,
    corners: np.ndarray,
    field: int,
    weighting: int,
    ratio: float,
) -> np.ndarray:
    """Direction in which a pursuer at each point would run after one evader, (2.2).

    Args:
        index: Edges of the world.
        points: Shape (n, 2) [m].
        ex, ey: The evader [m].
        corners: Shape (k, 6), from `corner_table`.
        field: Code of the pursuit field (`FIELDS`).
        weighting: Code of the risk vector (`RISK_VECTORS`).
        ratio: Speed ratio a = v_e / v_p.

    Returns:
        Unit vectors, shape (n, 2); zero where no corner threatens, in obstacles, and where the
        evader is out of sight.
    """
    directions = np.zeros((len(points), 2))
    shared = np.zeros(len(corners))
    beside = np.zeros(len(corners))
    for c in range(len(corners)):
        beside[c] = segment_is_clear(index, ex, ey, corners[c, 0], corners[c, 1])
    for n in range(len(points)):
        x, y = points[n, 0], points[n, 1]
        if not point_is_free(index, x, y) or not segment_is_clear(index, x, y, ex, ey):
            continue
        for c in range(len(corners)):
            seen = beside[c] > 0.5 and segment_is_clear(index, x, y, corners[c, 0], corners[c, 1])
            shared[c] = 1.0 if seen else 0.0
        vx, vy = pursuit_velocity(field, weighting, x, y, ex, ey, shared, corners, ratio, 1.0, 0.0)
        length = math.sqrt(vx * vx + vy * vy)
        if length > 0.0:
            directions[n, 0], directions[n, 1] = vx / length, vy / length
    return directions
