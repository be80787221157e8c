"""Interpolation beside walls: the nodes in reach stand for their cell."""

import math

import numpy as np

from ...compiled import compiled
from .value_function import ValueFunction


def look_up_in_reach(value: ValueFunction, states) -> np.ndarray:
    """Time to go by the nodes in reach around each state, shape (..., 4) -> (...,) [s].

    Linear, and looser than `ValueFunction.time_to_go`, which is infinite beside every wall: to
    guide a search, not to be promised. Infinite where no node of the cell is in reach.
    """
    local = value.to_table(states)
    flat = np.ascontiguousarray(local.reshape(-1, 4))
    out = np.empty(len(flat))
    grid = value.grid
    _look_up(value.table, grid.x_min, grid.y_min, grid.step, flat, out)
    return out.reshape(local.shape[:-1])


@compiled
def _look_up(table, x_min, y_min, step, states, out):
    theta_count, beta_count, y_count, x_count = table.shape
    for s in range(len(states)):
        x, y = (states[s, 0] - x_min) / step, (states[s, 1] - y_min) / step
        theta = (states[s, 2] / (2.0 * math.pi) % 1.0) * theta_count
        beta = (states[s, 3] / (2.0 * math.pi) % 1.0) * beta_count
        i, j, t, b = math.floor(x), math.floor(y), math.floor(theta), math.floor(beta)
        total, known = 0.0, 0.0
        for corner in range(16):
            di, dj, dt, db = corner & 1, corner >> 1 & 1, corner >> 2 & 1, corner >> 3
            if not (0 <= i + di < x_count and 0 <= j + dj < y_count):
                continue
            weight = abs(1 - di - (x - i)) * abs(1 - dj - (y - j))
            weight *= abs(1 - dt - (theta - t)) * abs(1 - db - (beta - b))
            time = table[(t + dt) % theta_count, (b + db) % beta_count, j + dj, i + di]
            if weight > 0.0 and time < np.inf:
                total += weight * time
                known += weight
        out[s] = total / known if known > 0.0 else np.inf
