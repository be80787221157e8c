"""Times near the goal without interpolation: words of up to three arcs that enter the goal box.

There the time to go jumps, where a cart that just misses the box has to come round again. To mix
values across the jump, next to the goal, would spoil all that is behind.
"""

import math

import numpy as np

from ..arc_words.box_entries import enter_box
from ..arc_words.held_controls import half_angles
from ..arc_words.words import endings_of, within_jackknife, words_of
from ..goal import Goal
from ..trailer import Trailer
from .grid import StateGrid
from .obstacles import Walls
from .sweeps import FAR
from .walled_words import alike, drop_walled

# Arcs before the last: how many, the lattice of their durations, in angles between theta nodes, and
# how long a word may be [1 / turn rate].
BEFORE_LAST = 2
LATTICE = 0.5
LONGEST = 4.0
# Distance of samples of the last arc, between which entries are interpolated [1 / turn rate].
SAMPLE = 0.05


def first_hits(
    grid: StateGrid,
    trailer: Trailer,
    goal: Goal,
    scale: float,
    *,
    walls: Walls | None = None,
    mirrored: bool = False,
) -> np.ndarray:
    """When the best word from each node first enters the box; zero inside it.

    Words have up to three arcs: the last is left at the moment of entry. An arc alone may go on for
    a turn, or straight across the grid. Among walls, the best of the words with the same controls
    counts, if it is clear.

    Args:
        grid: Where the nodes are [m].
        trailer: Normalised.
        goal: The box [m]; x and y have finite tolerances.
        scale: Length of a turning radius [m].
        walls: What words must not lead through.
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
    words = words_of(trailer, BEFORE_LAST, LONGEST, LATTICE * grid.theta_step)
    limited = trailer.jackknife < math.pi
    allowed = within_jackknife(words, betas, trailer.jackknife)
    rows = len(thetas) // 2 + 1 if mirrored else len(thetas)
    nodes = thetas[:rows], half_angles(betas)
    cells = np.array([radius, radius, 1.0, 1.0])
    corner = np.array([x_min, y_min, grid.step])
    table = np.full(grid.shape, FAR, dtype=np.float32)
    found = np.zeros((0, 0, 0, 0) if walls is None else grid.shape, dtype=np.int32)
    for last in endings_of(trailer, words, LONGEST, reach, SAMPLE):
        for part in [last] if walls is None else alike(words, last):
            hits = table if walls is None else np.full(grid.shape, FAR, dtype=np.float32)
            first = part.words.ends * cells, part.words.maps, allowed[part.numbers], part.lengths
            ending = part.shifts * cells[:3], part.maps
            enter_box(hits, found, *nodes, *first, *ending, box, widths, SAMPLE, limited)
            if walls is not None:
                drop_walled(hits, found, nodes, words, part, walls, corner, scale, SAMPLE)
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
