"""Interpolation of a table between its nodes."""

import math

import numpy as np

from ...compiled import compiled, kernel
from .grid import StateGrid
from .sweeps import FAR, between


def look_up(
    table: np.ndarray, grid: StateGrid, states: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Value at each state, by limited cubics, and how much the nodes of its cell differ.

    The value is infinite outside the grid, and where a node of the state's own cell is unreachable.

    Args:
        table: Shape (n_theta, n_beta, n_y, n_x), float32; infinite: unreachable.
        grid: Where its nodes are.
        states: x, y, theta, beta, shape (n, 4).

    Returns:
        Values and spreads, each of shape (n,).
    """
    values, spreads = np.full(len(states), np.inf), np.zeros(len(states))
    _look_up(table, grid.x_min, grid.y_min, grid.step, states, values, spreads)
    return values, spreads


@compiled
def _look_up(table, x_min, y_min, step, states, out, spreads):
    theta_count, beta_count, y_count, x_count = table.shape
    parts = np.empty(4, dtype=np.float32)
    values = np.empty((4, 4, 4, 4), dtype=np.float32)
    nodes = np.empty((4, 4), dtype=np.int64)
    for s in range(len(states)):
        x = (states[s, 0] - x_min) / step
        y = (states[s, 1] - y_min) / step
        # Rounding must not put a state on the edge of the grid outside.
        x = _snap(x)
        y = _snap(y)
        if not (0.0 <= x <= x_count - 1.0 and 0.0 <= y <= y_count - 1.0):
            continue
        theta = _snap((states[s, 2] / (2.0 * math.pi) % 1.0) * theta_count)
        beta = _snap((states[s, 3] / (2.0 * math.pi) % 1.0) * beta_count)
        parts[0] = _place(theta, theta_count, True, nodes[0])
        parts[1] = _place(beta, beta_count, True, nodes[1])
        parts[2] = _place(y, y_count, False, nodes[2])
        parts[3] = _place(x, x_count, False, nodes[3])
        spreads[s] = _gather(table, nodes, parts, values)
        if spreads[s] < np.inf:
            out[s] = _interpolate(parts, values)


@kernel
def _snap(cell):
    near = np.rint(cell)
    return near if abs(cell - near) < 1e-6 else cell


@kernel
def _place(cell, count, periodic, nodes):
    """The four nodes around a coordinate in cells; returns where it is between the inner two."""
    n = math.floor(cell)
    if not periodic:
        n = min(n, count - 2)
    for k in range(4):
        nodes[k] = (n - 1 + k) % count if periodic else min(max(n - 1 + k, 0), count - 1)
    return cell - n


@kernel
def _gather(table, nodes, parts, values):
    """Values at the nodes around; returns the spread of those with weight in a straight line.

    Infinite, if one of these is unreachable.
    """
    low, high = np.float32(np.inf), np.float32(0.0)
    for a in range(4):
        for b in range(4):
            for c in range(4):
                for d in range(4):
                    value = table[nodes[0, a], nodes[1, b], nodes[2, c], nodes[3, d]]
                    if (
                        _counts(a, parts[0])
                        and _counts(b, parts[1])
                        and _counts(c, parts[2])
                        and _counts(d, parts[3])
                    ):
                        low, high = min(low, value), max(high, value)
                    values[a, b, c, d] = min(value, FAR)
    return np.float32(np.inf) if high == np.inf else high - low


@kernel
def _interpolate(parts, values):
    """Limited cubic in beta, y, x, theta in turn, into the first of the values."""
    for a in range(4):
        for c in range(4):
            for d in range(4):
                v = values[a, :, c, d]
                v[0] = between(v[0], v[1], v[2], v[3], parts[1])
        for d in range(4):
            v = values[a, 0, :, d]
            v[0] = between(v[0], v[1], v[2], v[3], parts[2])
        v = values[a, 0, 0]
        v[0] = between(v[0], v[1], v[2], v[3], parts[3])
    v = values[:, 0, 0, 0]
    return between(v[0], v[1], v[2], v[3], parts[0])


@kernel
def _counts(k, part):
    """Whether the value of one of four nodes has weight in a straight line."""
    return k == 1 or (k == 2 and part > 0.0)
