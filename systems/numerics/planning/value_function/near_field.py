"""Times near the goal without interpolation: words of up to three arcs that enter the goal box.

There the time to go jumps, where a cart that just misses the box has to come round again. To mix
values across the jump, next to the goal, would spoil all that is behind.
"""

import math

import numpy as np

from ...compiled import compiled
from ..arc_words.quickest import enter_box
from ..arc_words.words import Endings, Words, endings_of, half_angles, within_jackknife, words_of
from ..goal import Goal
from ..trailer import Trailer
from .grid import StateGrid
from .obstacles import Walls, overlaps
from .sweeps import FAR

# Samples of a last arc from one look for walls to the next.
LOOK = 2


def alike(words: Words, last: Endings) -> list[Endings]:
    """The same, parted by the controls of the words in order."""
    kinds = np.zeros(len(words.last), dtype=int)
    base = int(words.last.max()) + 2
    for number in range(1, len(kinds)):
        root = words.roots[number]
        longer = words.last[root] == words.last[number]
        kinds[number] = kinds[root] if longer else kinds[root] * base + words.last[number] + 1
    parts = []
    for kind in np.unique(kinds[last.numbers]):
        chosen = kinds[last.numbers] == kind
        some = Words(*(column[chosen] for column in last.words))
        numbers, lengths = last.numbers[chosen], last.lengths[chosen]
        parts.append(last._replace(words=some, numbers=numbers, lengths=lengths))
    return parts


def drop_walled(
    hits: np.ndarray,
    found: np.ndarray,
    nodes: tuple[np.ndarray, np.ndarray],
    words: Words,
    last: Endings,
    walls: Walls,
    corner: np.ndarray,
    scale: float,
    sample: float,
) -> None:
    """Forget the words that lead through a wall.

    Args:
        hits, found: From `enter_box`, shape of the grid.
        nodes: Thetas, and half angles of the betas, of the nodes, shapes (t,), (b, 2).
        words: All words; they are looked at on their lattice.
        last: What `found` counts in; looked at every LOOK samples.
        walls: What is in the way.
        corner: x and y of the first node, and the step of the grid, shape (3,) [m].
        scale: Length of a turning radius [m].
        sample: Distance of samples of the last arc [1 / turn rate].
    """
    prefix = words.ends, words.maps, words.roots, last.numbers
    _drop(hits, found, *nodes, *prefix, last.shifts, last.maps, walls, corner, scale, sample)


@compiled
def _drop(
    hits,
    found,
    thetas,
    halves,
    ends,
    maps,
    roots,
    numbers,
    shifts,
    last_maps,
    walls,
    corner,
    scale,
    sample,
):
    theta_count, beta_count, y_count, x_count = hits.shape
    for t in range(theta_count):
        c, s = math.cos(thetas[t]), math.sin(thetas[t])
        for b in range(beta_count):
            for j in range(y_count):
                y0 = corner[1] + j * corner[2]
                for i in range(x_count):
                    if hits[t, b, j, i] >= FAR:
                        continue
                    x0 = corner[0] + i * corner[2]
                    word = numbers[found[t, b, j, i]]
                    walled = False
                    # Along the last arc.
                    theta = thetas[t] + ends[word, 2]
                    x = x0 + scale * (c * ends[word, 0] - s * ends[word, 1])
                    y = y0 + scale * (s * ends[word, 0] + c * ends[word, 1])
                    half_s = maps[word, 0, 0] * halves[b, 0] + maps[word, 0, 1] * halves[b, 1]
                    half_c = maps[word, 1, 0] * halves[b, 0] + maps[word, 1, 1] * halves[b, 1]
                    cw, sw = math.cos(theta), math.sin(theta)
                    count = math.ceil((hits[t, b, j, i] - ends[word, 3]) / sample)
                    for n in range(max(count, 0) // LOOK + 2):
                        k = min(n * LOOK, max(count, 0), len(shifts) - 1)
                        m = last_maps[k]
                        beta = 2.0 * math.atan2(
                            m[0, 0] * half_s + m[0, 1] * half_c, m[1, 0] * half_s + m[1, 1] * half_c
                        )
                        px = x + scale * (cw * shifts[k, 0] - sw * shifts[k, 1])
                        py = y + scale * (sw * shifts[k, 0] + cw * shifts[k, 1])
                        if overlaps(walls, px, py, theta + shifts[k, 2], beta):
                            walled = True
                            break
                    # And back along the word to the node.
                    while not walled and word > 0:
                        word = roots[word]
                        m = maps[word]
                        beta = 2.0 * math.atan2(
                            m[0, 0] * halves[b, 0] + m[0, 1] * halves[b, 1],
                            m[1, 0] * halves[b, 0] + m[1, 1] * halves[b, 1],
                        )
                        px = x0 + scale * (c * ends[word, 0] - s * ends[word, 1])
                        py = y0 + scale * (s * ends[word, 0] + c * ends[word, 1])
                        walled = overlaps(walls, px, py, thetas[t] + ends[word, 2], beta)
                    if walled:
                        hits[t, b, j, i] = FAR


# Arcs before the last: how many, the lattice of their durations, and how long a word may be
# [1 / turn rate]. The lattice is made to fit the angle between theta nodes: so turns end on the
# faces of a box as wide as the cells.
BEFORE_LAST = 2
LATTICE = 1 / 16
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
    longest: float = LONGEST,
    lattice: float = LATTICE,
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
        longest: Of the words of several arcs [1 / turn rate].
        lattice: Of their durations, about; see LATTICE [1 / turn rate].

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
    step = grid.theta_step / max(1, round(grid.theta_step / lattice))
    words = words_of(trailer, BEFORE_LAST, longest, step)
    limited = trailer.jackknife < math.pi
    allowed = within_jackknife(words, betas, trailer.jackknife)
    rows = len(thetas) // 2 + 1 if mirrored else len(thetas)
    nodes = thetas[:rows], half_angles(betas)
    cells = np.array([radius, radius, 1.0, 1.0])
    corner = np.array([x_min, y_min, grid.step])
    table = np.full(grid.shape, FAR, dtype=np.float32)
    found = np.zeros((0, 0, 0, 0) if walls is None else grid.shape, dtype=np.int32)
    for last in endings_of(trailer, words, longest, reach, SAMPLE):
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
