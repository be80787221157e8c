"""The long steps of a sweep: where each control takes each node.

Inside the solver lengths are in turning radii and times in 1 / turn rate, so that the tractor has
speed one and turn rate one. A step lasts a multiple of the angle between theta nodes, so that it
ends on a theta node exactly, and its shift in x and y is the same over the whole plane.
"""

import math
from dataclasses import dataclass

import numpy as np

from ..arc_words.held_controls import control_set, hold_beta, shift_of
from ..trailer import Trailer
from .grid import THESIS_ANGLES, StateGrid

# Durations of the steps on the thesis's grid, in angles between theta nodes.
MULTIPLES = (1, 2, 4)
# With which power of the distance of nodes they get shorter. Each step adds an error of
# interpolation: were they shortened in proportion, halving the grid would gain little.
SHORTENING = 0.75
# A foot point this near to a node, in cells, is on it.
SNAP = 1e-4


@dataclass(frozen=True, eq=False)
class Motions:
    """C controls, held for a while, from every node.

    Attributes:
        controls: v, omega in {-1, 0, 1}, shape (C, 2).
        multiples: Duration of each, in angles between theta nodes, shape (C,).
        durations: The same in 1 / turn rate, shape (C,).
        turns: By how many theta nodes each turns, shape (C,).
        x_cells, y_cells: Whole cells of the shift, by control and theta, shape (C, n_theta).
        x_parts, y_parts: What is left of it, in [0, 1), shape (C, n_theta).
        beta_cells: Beta node below the foot point, by control and beta, shape (C, n_beta);
            -1: the control is not allowed there (jackknife).
        beta_parts: Where between it and the next, in [0, 1), shape (C, n_beta).
    """

    controls: np.ndarray
    multiples: np.ndarray
    durations: np.ndarray
    turns: np.ndarray
    x_cells: np.ndarray
    x_parts: np.ndarray
    y_cells: np.ndarray
    y_parts: np.ndarray
    beta_cells: np.ndarray
    beta_parts: np.ndarray


def step_multiples(grid: StateGrid) -> tuple[int, ...]:
    """Durations of steps, in angles between theta nodes."""
    finer = (grid.theta_count / THESIS_ANGLES) ** SHORTENING
    # In doubt rather longer: at a step of 0.125, shorter ones had twice the median error.
    unit = max(1, math.floor(finer + 0.6))
    return tuple(multiple * unit for multiple in MULTIPLES)


def make_motions(grid: StateGrid, trailer: Trailer, scale: float) -> Motions:
    """Tabulate the steps of a normalised trailer; `scale` is a turning radius [m]."""
    pairs = [(v, omega, k) for v, omega in control_set(trailer) for k in step_multiples(grid)]
    v, omega, multiples = (np.array(column) for column in zip(*pairs, strict=True))
    durations = multiples * grid.theta_step
    _, _, thetas, betas = grid.axes()
    dx, dy = shift_of(thetas, v[:, None], omega[:, None], durations[:, None])
    x_cells, x_parts = _split(dx * scale / grid.step)
    y_cells, y_parts = _split(dy * scale / grid.step)
    starts = np.remainder(betas + math.pi, math.tau) - math.pi
    ends = np.array(
        [
            hold_beta(starts, vi, wi, ki * grid.theta_step, 8 * ki, trailer)[-1]
            for vi, wi, ki in pairs
        ]
    )
    beta_cells, beta_parts = _split(ends / grid.beta_step)
    beta_cells %= grid.beta_count
    # Nodes just beyond the limit are kept, for interpolation; they may only fold back.
    limit = np.maximum(trailer.jackknife, np.abs(starts))
    beyond = np.abs(starts) > trailer.jackknife + 2 * grid.beta_step
    if trailer.jackknife < math.pi:
        beta_cells[(np.abs(ends) > limit) | beyond] = -1
    return Motions(
        np.column_stack([v, omega]),
        multiples,
        durations.astype(np.float32),
        multiples * omega,
        x_cells,
        x_parts,
        y_cells,
        y_parts,
        beta_cells,
        beta_parts,
    )


def _split(cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Whole cells and what is left, in [0, 1)."""
    near = np.round(cells)
    cells = np.where(np.abs(cells - near) < SNAP, near, cells)
    whole = np.floor(cells)
    return whole.astype(np.int64), (cells - whole).astype(np.float32)
