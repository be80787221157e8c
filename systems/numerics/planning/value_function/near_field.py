"""Times near the goal without interpolation: words of up to three arcs that enter the goal box.

There the time to go jumps, where a cart that just misses the box has to come round again. To mix
values across the jump, next to the goal, would spoil all that is behind.
"""

import math

import numpy as np

from ...compiled import compiled
from ..arc_words.box_entries import enter_box
from ..arc_words.held_controls import control_set, half_angles
from ..arc_words.words import angles_after, endings_of, within_jackknife, words_of
from ..goal import Goal
from ..trailer import Trailer
from .grid import Grid
from .obstacles import Walls, overlaps
from .sweeps import FAR

# Arcs before the last: how many, the lattice of their durations, in angles between theta nodes, and
# how long a word may be [1 / turn rate].
BEFORE_LAST = 2
LATTICE = 0.5
LONGEST = 4.0
# Distance of samples of the last arc, between which entries are interpolated [1 / turn rate].
SAMPLE = 0.05
# Samples from one look for walls to the next.
LOOK = 2


def first_hits(
    grid: Grid,
    trailer: Trailer,
    goal: Goal,
    scale: float,
    *,
    walls: Walls | None = None,
    mirrored: bool = False,
) -> np.ndarray:
    """When the best word from each node first enters the box; zero inside it.

    Words have up to three arcs, or one among walls: the last is left at the moment of entry. An arc
    alone may go on for a turn, or straight across the grid.

    Args:
        grid: Where the nodes are [m].
        trailer: Normalised.
        goal: The box [m]; x and y have finite tolerances.
        scale: Length of a turning radius [m].
        walls: Which arcs must not lead through.
        mirrored: Whether the mirror images of nodes take as long.

    Returns:
        Shape of the grid, float32 [1 / turn rate]; FAR where no word enters it.
    """
    x_min, y_min, x_max, y_max = grid.bounds
    radius = scale / grid.step
    reach = math.hypot(x_max - x_min, y_max - y_min) / scale
    _, _, thetas, betas = grid.axes()
    place = np.array([(goal.state[0] - x_min), (goal.state[1] - y_min)]) / grid.step
    box = np.concatenate([place, goal.state[2:]])
    # Rounding must not drop a node on the face of the box.
    widths = np.array(goal.tolerance) / [grid.step, grid.step, 1.0, 1.0] + 1e-9
    before = 0 if walls is not None else BEFORE_LAST
    words = words_of(trailer, before, LONGEST, LATTICE * grid.theta_step)
    limited = trailer.jackknife < math.pi
    allowed = within_jackknife(words, betas, trailer.jackknife)
    rows = len(thetas) // 2 + 1 if mirrored else len(thetas)
    nodes = thetas[:rows], half_angles(betas)
    cells = np.array([radius, radius, 1.0, 1.0])
    table = np.full(grid.shape, FAR, dtype=np.float32)
    nowhere = np.zeros((0, 0, 0, 0), dtype=np.int32)
    for last in endings_of(trailer, words, LONGEST, reach, SAMPLE):
        hits = table if walls is None else np.full(grid.shape, FAR, dtype=np.float32)
        first = last.words.ends * cells, last.words.maps, allowed[last.numbers], last.lengths
        ending = last.shifts * cells[:3], last.maps
        enter_box(hits, nowhere, *nodes, *first, *ending, box, widths, SAMPLE, limited)
        if walls is not None:
            angles = angles_after(last.maps, betas)
            v, omega = control_set(trailer)[last.control].tolist()
            corner = np.array([x_min, y_min, grid.step])
            _drop_walled(hits, walls, thetas, angles, v, omega, scale, corner)
            np.minimum(table, hits, out=table)
    if mirrored:
        _reflect(table)
    return table


def _reflect(table: np.ndarray) -> None:
    """Fill the rows of negative theta from those of positive theta."""
    theta_count, beta_count = table.shape[:2]
    betas = -np.arange(beta_count) % beta_count
    for t in range(theta_count // 2 + 1, theta_count):
        table[t] = table[theta_count - t][betas, ::-1]


@compiled
def _drop_walled(hits, walls, thetas, angles, v, omega, scale, corner):
    """Forget arcs that lead through a wall, looked at LOOK samples apart."""
    theta_count, beta_count, y_count, x_count = hits.shape
    for t in range(theta_count):
        for b in range(beta_count):
            for j in range(y_count):
                for i in range(x_count):
                    if hits[t, b, j, i] >= FAR:
                        continue
                    count = math.ceil(hits[t, b, j, i] / SAMPLE)
                    for n in range(count // LOOK + 2):
                        k = min(n * LOOK, count, len(angles) - 1)
                        half = omega * k * SAMPLE / 2
                        chord = v * k * SAMPLE * scale
                        if omega != 0 and k > 0:
                            chord *= math.sin(half) / half
                        x = corner[0] + i * corner[2] + chord * math.cos(thetas[t] + half)
                        y = corner[1] + j * corner[2] + chord * math.sin(thetas[t] + half)
                        if overlaps(walls, x, y, thetas[t] + 2 * half, angles[k, b]):
                            hits[t, b, j, i] = FAR
                            break
