"""Where the passes over one grid may start from: the table of another."""

import numpy as np

from .grid import StateGrid
from .sweeps import FAR, LIMIT
from .value_function import ValueFunction


def carried_over(value: ValueFunction, grid: StateGrid) -> np.ndarray:
    """A table interpolated linearly at the nodes of another grid, one direction after the other.

    Args:
        value: A table in the frame of the grid.
        grid: Where it is wanted; larger or smaller, coarser or finer.

    Returns:
        Shape of the grid, float32 [s]; FAR off the first grid, and beside unreachable nodes.
    """
    table = np.where(np.isfinite(value.table), value.table, FAR)
    places = [
        _places(axis, first, step)
        for axis, first, step in zip(
            (grid.axes()[2], grid.axes()[3], grid.axes()[1], grid.axes()[0]),
            (0.0, 0.0, value.grid.y_min, value.grid.x_min),
            (value.grid.theta_step, value.grid.beta_step, value.grid.step, value.grid.step),
            strict=True,
        )
    ]
    # The planes first: there are fewer of them before the angles are refined.
    for direction in (3, 2, 1, 0):
        table = _along(table, direction, *places[direction], periodic=direction < 2)
    return np.where(table < LIMIT, table, FAR)


def _places(axis: np.ndarray, first: float, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Nodes below coordinates, and how far past them they are, in [0, 1)."""
    cells = (axis - first) / step
    cells = np.where(np.abs(cells - np.round(cells)) < 1e-6, np.round(cells), cells)
    nodes = np.floor(cells).astype(int)
    return nodes, (cells - nodes).astype(np.float32)


def _along(
    table: np.ndarray, direction: int, nodes: np.ndarray, parts: np.ndarray, *, periodic: bool
) -> np.ndarray:
    """Linear interpolation in one direction."""
    count = table.shape[direction]
    if periodic:
        low, high = nodes % count, (nodes + 1) % count
        off = np.zeros(len(nodes), dtype=bool)
    else:
        low, high = nodes.clip(0, count - 1), (nodes + (parts > 0)).clip(0, count - 1)
        off = (nodes < 0) | (nodes + (parts > 0) > count - 1)
    shape = [1] * table.ndim
    shape[direction] = -1
    part = parts.reshape(shape)
    mixed = table.take(low, direction)
    mixed *= np.float32(1.0) - part
    mixed += part * table.take(high, direction)
    mixed[(slice(None),) * direction + (off,)] = FAR
    return mixed
