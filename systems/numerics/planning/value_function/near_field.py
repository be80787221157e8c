"""Exact times near the goal: the first moment at which a single arc enters the goal box."""

import math

import numpy as np

from ...compiled import compiled
from ..goal import Goal
from ..trailer import Trailer
from .grid import Grid
from .motions import control_set, hold_beta
from .obstacles import Walls, overlaps
from .sweeps import FAR

# Times are found to this fraction of 1 / turn rate.
RESOLUTION = 1e-3
# Samples between two steps of the integration of beta.
FINER = 20
# Samples between two looks for walls.
LOOK = 100


def first_hits(
    grid: Grid, trailer: Trailer, goal: Goal, scale: float, walls: Walls | None = None
) -> np.ndarray:
    """When the best single arc from each node first enters the box; zero inside it.

    Args:
        grid: Where the nodes are [m].
        trailer: Normalised.
        goal: The box [m]; x and y have finite tolerances.
        scale: Length of a turning radius [m].
        walls: Which arcs must not lead through.

    Returns:
        Shape of the grid, float32 [1 / turn rate]; FAR where no arc of up to one turn, nor a
        straight line, enters it.
    """
    table = np.full(grid.shape, FAR, dtype=np.float32)
    x_min, y_min, x_max, y_max = grid.bounds
    reach = math.hypot(x_max - x_min, y_max - y_min) / scale
    _, _, thetas, betas = grid.axes()
    starts = np.remainder(betas + math.pi, math.tau) - math.pi
    box = np.array(
        [(goal.state[0] - x_min) / grid.step, (goal.state[1] - y_min) / grid.step, *goal.state[2:]]
    )
    # Rounding must not drop a node on the face of the box.
    widths = np.array(goal.tolerance) / np.array([grid.step, grid.step, 1.0, 1.0]) + 1e-9
    for v, omega in control_set(trailer):
        horizon = math.tau if omega else reach
        knots = math.ceil(horizon / (FINER * RESOLUTION))
        paths = _refined(hold_beta(starts, v, omega, knots * FINER * RESOLUTION, knots, trailer))
        if trailer.jackknife < math.pi:
            # Beyond the limit a trailer may only fold back; see `make_motions`.
            limit = np.maximum(trailer.jackknife, np.abs(starts))
            paths[np.maximum.accumulate(np.abs(paths) > limit, axis=0)] = np.nan
        offsets = np.arange(len(paths)) * RESOLUTION
        cells = scale / grid.step
        if walls is None:
            _enter(table, thetas, paths, offsets, v, omega, cells, box, widths)
        else:
            hits = np.full(grid.shape, FAR, dtype=np.float32)
            _enter(hits, thetas, paths, offsets, v, omega, cells, box, widths)
            place = np.array([x_min, y_min, grid.step])
            _drop_walled(hits, walls, thetas, paths, int(v), int(omega), scale, place)
            np.minimum(table, hits, out=table)
    return table


@compiled
def _drop_walled(hits, walls, thetas, paths, v, omega, scale, place):
    """Forget arcs that lead through a wall, looked at LOOK samples apart."""
    theta_count, beta_count, y_count, x_count = hits.shape
    for t in range(theta_count):
        for b in range(beta_count):
            for j in range(y_count):
                for i in range(x_count):
                    if hits[t, b, j, i] >= FAR:
                        continue
                    count = round(hits[t, b, j, i] / RESOLUTION)
                    for n in range(count // LOOK + 2):
                        k = min(n * LOOK, count)
                        half = omega * k * RESOLUTION / 2
                        chord = v * k * RESOLUTION * scale
                        if omega != 0 and k > 0:
                            chord *= math.sin(half) / half
                        x = place[0] + i * place[2] + chord * math.cos(thetas[t] + half)
                        y = place[1] + j * place[2] + chord * math.sin(thetas[t] + half)
                        if overlaps(walls, x, y, thetas[t] + 2 * half, paths[k, b]):
                            hits[t, b, j, i] = FAR
                            break


def _refined(path: np.ndarray) -> np.ndarray:
    """Linear interpolation between the rows of a path, FINER steps each."""
    parts = np.arange(FINER)[:, None] / FINER
    fine = path[:-1, None] * (1 - parts) + path[1:, None] * parts
    return np.concatenate([fine.reshape(-1, path.shape[1]), path[-1:]])


@compiled
def _enter(table, thetas, paths, offsets, v, omega, scale, box, widths):
    """Lower the table by the entries of one control. Places are in cells."""
    theta_count, beta_count, y_count, x_count = table.shape
    for t in range(theta_count):
        for k in range(len(offsets)):
            time = offsets[k]
            theta = thetas[t] + omega * time
            gap = theta - box[2]
            if abs(gap - 2.0 * math.pi * np.rint(gap / (2.0 * math.pi))) > widths[2]:
                continue
            if omega == 0:
                dx = v * time * math.cos(theta)
                dy = v * time * math.sin(theta)
            else:
                dx = v * omega * (math.sin(theta) - math.sin(thetas[t]))
                dy = v * omega * (math.cos(thetas[t]) - math.cos(theta))
            x = box[0] - dx * scale
            y = box[1] - dy * scale
            left = max(0, math.ceil(x - widths[0]))
            right = min(x_count - 1, math.floor(x + widths[0]))
            low = max(0, math.ceil(y - widths[1]))
            high = min(y_count - 1, math.floor(y + widths[1]))
            if left > right or low > high:
                continue
            for b in range(beta_count):
                gap = paths[k, b] - box[3]
                off = abs(gap - 2.0 * math.pi * np.rint(gap / (2.0 * math.pi)))
                if off <= widths[3]:
                    for j in range(low, high + 1):
                        for i in range(left, right + 1):
                            table[t, b, j, i] = min(table[t, b, j, i], np.float32(time))
