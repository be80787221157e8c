"""Interpolation of a table between its nodes."""

import math

import numpy as np

from ...compiled import compiled, kernel
from .sweeps import FAR, between


@compiled
def look_up(table, x_min, y_min, step, states, out):
    """Value at each state, into out (n,): clipped cubic.

    Infinite outside the grid, and where a node of the state's own cell is unreachable.

    Args:
        table: Shape (n_theta, n_beta, n_y, n_x), float32; infinite: unreachable.
        x_min, y_min, step: Of the grid [m].
        states: x, y, theta, beta, shape (n, 4).
        out: Shape (n,).
    """
    theta_count, beta_count, y_count, x_count = table.shape
    parts = np.empty(4, dtype=np.float32)
    values = np.empty((4, 4, 4, 4), dtype=np.float32)
    nodes = np.empty((4, 4), dtype=np.int64)
    for s in range(len(states)):
        out[s] = np.inf
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
        out[s] = _interpolate(table, nodes, parts, values)


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
def _interpolate(table, nodes, parts, values):
    """Clipped cubic in beta, y, x, theta in turn; a part of zero needs no other node."""
    for a in range(4):
        for b in range(4):
            for c in range(4):
                for d in range(4):
                    value = table[nodes[0, a], nodes[1, b], nodes[2, c], nodes[3, d]]
                    inner = (
                        _counts(a, parts[0])
                        and _counts(b, parts[1])
                        and _counts(c, parts[2])
                        and _counts(d, parts[3])
                    )
                    if inner and value == np.inf:
                        return np.inf
                    values[a, b, c, d] = value if value < FAR else FAR
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
