"""Words into the goal among walls: which are of one kind, and which lead through a wall."""

import math

import numpy as np

from ...compiled import compiled
from ..arc_words.words import Endings, Words
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
