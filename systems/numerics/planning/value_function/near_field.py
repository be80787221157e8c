"""Times near the goal without interpolation: words of arcs that enter the goal box.

There the time to go jumps: a cart that just misses the box has to come round again. Interpolating
across this jump, next to the goal, would spoil all times that build on it. Words of up to three
arcs on a lattice show which controls lead into the box. In the open, their durations are then
optimised from every node, off the lattice, with more switches where these save time.
"""

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...compiled import compiled, kernel
from ..arc_words.linear_steps import ROOM, merge, refine, shorten, stays
from ..arc_words.quickest import enter_box
from ..arc_words.words import Endings, Words, endings_of, within_jackknife, words_of
from ..goal import Goal
from ..trailer import Trailer, half_angles
from .grid import StateGrid
from .known_words import HELD, MOST_ARCS, KnownWords, aim_of, word_controls
from .obstacles import Walls, overlaps
from .sweeps import FAR

# Samples of a last arc from one check for walls to the next.
LOOK = 2


def alike(words: Words, last: Endings) -> list[Endings]:
    """Split endings into groups whose words have the same sequence of controls."""
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
    known: np.ndarray,
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
        known: Times by other words, of the same shape: slower words are not looked at.
        nodes: Thetas, and half angles of the betas, of the nodes, shapes (t,), (b, 2).
        words: All words; they are checked at their lattice points.
        last: The endings that `found` indexes; their arcs are checked every LOOK samples.
        walls: What is in the way.
        corner: x and y of the first node, and the step of the grid, shape (3,) [m].
        scale: Length of a turning radius [m].
        sample: Distance of samples of the last arc [1 / turn rate].
    """
    prefix = words.ends, words.maps, words.roots, last.numbers
    _drop(hits, found, known, *nodes, *prefix, last.shifts, last.maps, walls, corner, scale, sample)


@compiled
def _drop(
    hits,
    found,
    known,
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
                    if hits[t, b, j, i] >= known[t, b, j, i]:
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
# Words that are no longer than this have their durations chosen anew; longer ones only bound the
# passes from above, and many of them more than they can tell [1 / turn rate].
SHORTENED = 3.0
# Least saving of a step of that search [1 / turn rate], and the number of steps.
HELD_GAIN, HELD_SEARCH = 1e-3, 6
# By how much a word whose end is in the box may be longer than one whose entry was interpolated
# [1 / turn rate].
KEPT_LATER = 0.02


def first_hits(
    grid: StateGrid,
    trailer: Trailer,
    goal: Goal,
    scale: float,
    walls: Walls,
) -> np.ndarray:
    """Time in which the best word from each node enters the box among walls; zero inside it.

    Words have up to three arcs; the last ends at the moment of entry. A single arc may be a whole
    turn, or a straight across the grid. Of words with the same controls only the best is used, and
    only if it is clear of walls.

    Args:
        grid: Where the nodes are [m].
        trailer: Normalised.
        goal: The box [m]; x and y have finite tolerances.
        scale: Length of a turning radius [m].
        walls: What words must not lead through.

    Returns:
        Shape of the grid, float32 [1 / turn rate]; FAR where no word enters it.
    """
    table, _, _ = _lattice_words(grid, trailer, goal, scale, walls, mirrored=False)
    return table


class _Lattice(NamedTuple):
    """What the word numbers stored for the nodes stand for.

    Attributes:
        firsts: First number of the words that end with each control, shape (C + 1,).
        numbers: Index, among all words, of the arcs before the last one, shape (n,).
        last, roots, spent: Of all words: their last control, the word a lattice step shorter, and
            their duration [1 / turn rate].
        step: Of the lattice [1 / turn rate].
    """

    firsts: np.ndarray
    numbers: np.ndarray
    last: np.ndarray
    roots: np.ndarray
    spent: np.ndarray
    step: float


def near_words(
    grid: StateGrid, trailer: Trailer, goal: Goal, scale: float, *, mirrored: bool = False
) -> tuple[np.ndarray, KnownWords]:
    """As `first_hits`, in the open, with durations chosen for each node; and words of near nodes.

    Args:
        grid, trailer, goal, scale: See `first_hits`.
        mirrored: Whether the mirror images of nodes take as long.

    Returns:
        Shape of the grid, float32 [1 / turn rate], and the words of nodes within HELD of the goal.
    """
    table, found, lattice = _lattice_words(grid, trailer, goal, scale, None, mirrored=mirrored)
    words = _with_durations(grid, trailer, goal, scale, table, found, lattice)
    if trailer.reverse:
        # Of words as quick on the lattice, the first may have cusps and be the worse one.
        alone, forwards = near_words(grid, replace(trailer, reverse=False), goal, scale)
        words = _quicker(trailer, words, table, forwards, alone)
        np.minimum(table, alone, out=table)
    times = np.take(table, words.nodes)
    near = times <= HELD
    words = KnownWords(*(each[near] for each in words))
    if mirrored:
        words = _with_images(grid, trailer, words, times[near])
        _reflect(table)
    return table, words


def _with_durations(
    grid: StateGrid,
    trailer: Trailer,
    goal: Goal,
    scale: float,
    table: np.ndarray,
    found: np.ndarray,
    lattice: _Lattice,
) -> KnownWords:
    """Optimise the durations of near nodes' lattice words, and put their times into the table."""
    at = np.flatnonzero(table[: len(found)].ravel() < SHORTENED)
    t, b, j, i = np.unravel_index(at, table.shape)
    x_nodes, y_nodes, thetas, betas = grid.axes()
    starts = np.column_stack([x_nodes[i], y_nodes[j], thetas[t], betas[b]])
    units = np.array([scale, scale, 1.0, 1.0])
    in_radii = replace(
        goal,
        state=tuple(goal.state / units),
        tolerance=tuple(goal.tolerance / units),
    )
    controls = np.zeros((len(at), MOST_ARCS), dtype=np.int8)
    durations = np.zeros(controls.shape, dtype=np.float32)
    counts = np.zeros(len(at), dtype=np.int8)
    times = table[t, b, j, i]
    _choose_durations(
        starts / units,
        goal.to_frame(starts) / units,
        found[t, b, j, i],
        times,
        lattice,
        np.array(grid.bounds) / scale,
        trailer.jackknife,
        aim_of(trailer, in_radii, gain=HELD_GAIN, steps=HELD_SEARCH),
        counts,
        controls,
        durations,
    )
    table[t, b, j, i] = times
    return KnownWords(at, counts, controls, durations)


def _quicker(
    trailer: Trailer,
    words: KnownWords,
    table: np.ndarray,
    forwards: KnownWords,
    alone: np.ndarray,
) -> KnownWords:
    """Words with cusps, replaced by those that only drive forwards where these are quicker."""
    times = np.take(alone, words.nodes)
    better = np.flatnonzero((times < np.take(table, words.nodes)) & (times <= HELD))
    places = np.searchsorted(forwards.nodes, words.nodes[better])
    numbers = _numbers(word_controls(replace(trailer, reverse=False)), word_controls(trailer))
    words.counts[better] = forwards.counts[places]
    words.controls[better] = numbers[forwards.controls[places]]
    words.durations[better] = forwards.durations[places]
    return words


def _with_images(
    grid: StateGrid, trailer: Trailer, words: KnownWords, times: np.ndarray
) -> KnownWords:
    """Add the mirror images of words whose times are (W,); of two for a node, the quicker stays."""
    nodes, counts, controls, durations = words
    t, b, j, i = np.unravel_index(nodes, grid.shape)
    images = -t % grid.theta_count, -b % grid.beta_count, grid.y_count - 1 - j, i
    both = np.append(nodes, np.ravel_multi_index(images, grid.shape))
    # Rows of headings along the axis are their own images.
    chosen = np.lexsort([np.append(times, times), both])
    both, firsts = np.unique(both[chosen], return_index=True)
    chosen = chosen[firsts]
    pairs = word_controls(trailer)
    mirror = _numbers(pairs * [1, -1], pairs)
    return KnownWords(
        both,
        np.append(counts, counts)[chosen],
        np.concatenate([controls, mirror[controls]])[chosen],
        np.concatenate([durations, durations])[chosen],
    )


def _numbers(controls: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Index of each control in `pairs` of v, omega, int8."""
    return (controls[:, None] == pairs).all(axis=-1).argmax(axis=1).astype(np.int8)


def _lattice_words(
    grid: StateGrid,
    trailer: Trailer,
    goal: Goal,
    scale: float,
    walls: Walls | None,
    *,
    mirrored: bool,
) -> tuple[np.ndarray, np.ndarray, _Lattice]:
    """Times of words on the lattice, their numbers, and what these mean.

    If mirrored, only rows with a heading of at least zero are filled in.
    """
    x_min, y_min, x_max, y_max = grid.bounds
    radius = scale / grid.step
    reach = math.hypot(x_max - x_min, y_max - y_min) / scale
    _, _, thetas, betas = grid.axes()
    place = np.array([(goal.state[0] - x_min), (goal.state[1] - y_min)]) / grid.step
    box = np.concatenate([place, goal.state[2:]])
    # Rounding must not drop a node on the face of the box.
    widths = np.array(goal.tolerance) / [grid.step, grid.step, 1.0, 1.0] + 1e-9
    step = grid.theta_step / max(1, round(grid.theta_step / LATTICE))
    words = words_of(trailer, BEFORE_LAST, LONGEST, step)
    limited = trailer.jackknife < math.pi
    allowed = within_jackknife(words, betas, trailer.jackknife)
    rows = len(thetas) // 2 + 1 if mirrored else len(thetas)
    nodes = thetas[:rows], half_angles(betas)
    cells = np.array([radius, radius, 1.0, 1.0])
    corner = np.array([x_min, y_min, grid.step])
    table = np.full(grid.shape, FAR, dtype=np.float32)
    found = np.zeros((rows, *grid.shape[1:]), dtype=np.int32)
    all_endings = endings_of(trailer, words, LONGEST, reach, SAMPLE)
    firsts = np.cumsum([0, *(len(last.numbers) for last in all_endings)])
    for last, offset in zip(all_endings, firsts[:-1].tolist(), strict=True):
        for part in [last] if walls is None else alike(words, last):
            hits = table if walls is None else np.full(grid.shape, FAR, dtype=np.float32)
            first = part.words.ends * cells, part.words.maps, allowed[part.numbers], part.lengths
            ending = part.shifts * cells[:3], part.maps
            limits = box, widths, SAMPLE, limited, offset if walls is None else 0
            enter_box(hits, found, *nodes, *first, *ending, *limits)
            if walls is not None:
                drop_walled(hits, found, table, nodes, words, part, walls, corner, scale, SAMPLE)
                np.minimum(table, hits, out=table)
    numbers = np.concatenate([last.numbers for last in all_endings])
    spent = words.ends[:, 3].copy()
    return table, found, _Lattice(firsts, numbers, words.last, words.roots, spent, step)


@compiled
def _choose_durations(
    starts, local, found, times, lattice, bounds, jackknife, aim, counts, controls, durations
):
    """Choose durations, and more switches, with which the words of nodes take the least time.

    Args:
        starts, local: Nodes in the table's frame and the box's, in turning radii, shape (n, 4).
        found: Numbers of their words on the lattice, shape (n,).
        times: Of these, to be lowered, shape (n,).
        lattice: What the numbers mean.
        bounds: Of the grid, in turning radii.
        jackknife: Largest |beta|.
        aim: The box.
        counts, controls, durations: See `KnownWords`; to be filled.
    """
    word, spent = np.empty((ROOM, 2)), np.empty(ROOM)
    # Plain numbers: Numba would compile `refine` for each constant.
    rounds, most = np.int64(1), np.int64(MOST_ARCS)
    for s in range(len(starts)):
        if times[s] == 0.0:
            continue
        control = np.searchsorted(lattice.firsts, found[s], side="right") - 1
        number = lattice.numbers[found[s]]
        count = _on_lattice(control, number, times[s], lattice, aim.pairs, word, spent)
        total = shorten(local[s], word, spent, count, aim)
        if total < math.inf:
            count = merge(word, spent, count)
            total, count = refine(local[s], word, spent, count, total, aim, rounds, most)
        if not (
            total <= times[s] + KEPT_LATER
            and stays(starts[s], word, spent, count, aim.cart, bounds, jackknife)
        ):
            # Keep the word of the lattice.
            count = _on_lattice(control, number, times[s], lattice, aim.pairs, word, spent)
            total = float(times[s])
        times[s] = total
        counts[s] = count
        for n in range(count):
            durations[s, n] = spent[n]
            for c in range(len(aim.pairs)):
                if aim.pairs[c, 0] == word[n, 0] and aim.pairs[c, 1] == word[n, 1]:
                    controls[s, n] = c


@kernel
def _on_lattice(control, number, time, lattice, pairs, word, spent):
    """The arcs of a word of the lattice, in order; returns how many there are.

    Args:
        control: Of the last arc.
        number: Of the word of the others.
        time: Of all of it.
        lattice: What numbers mean.
        pairs: v, omega of all controls.
        word, spent: To be filled.
    """
    # Backwards first.
    word[0, 0], word[0, 1], count = pairs[control, 0], pairs[control, 1], 1
    spent[0] = time - lattice.spent[number]
    before = control
    while number > 0:
        control = lattice.last[number]
        if control == before and count > 1:
            spent[count - 1] += lattice.step
        else:
            word[count, 0], word[count, 1] = pairs[control, 0], pairs[control, 1]
            spent[count] = lattice.step
            count += 1
        before, number = control, lattice.roots[number]
    for n in range(count // 2):
        k = count - 1 - n
        for m in range(2):
            word[n, m], word[k, m] = word[k, m], word[n, m]
        spent[n], spent[k] = spent[k], spent[n]
    return count


def _reflect(table: np.ndarray) -> None:
    """Fill the rows of negative theta from positive theta; make those of zero and pi symmetric."""
    theta_count, beta_count = table.shape[:2]
    betas = -np.arange(beta_count) % beta_count
    for t in range(theta_count):
        image = table[-t % theta_count][betas, ::-1]
        if 2 * t > theta_count:
            table[t] = image
        elif -t % theta_count == t:
            table[t] = np.minimum(table[t], image)
