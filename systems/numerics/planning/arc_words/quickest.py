"""The quickest word of three arcs from one state into a goal box.

The ways into a small box can form a narrow channel, far from any Dubins path to its middle. Trying
all words on a fine lattice finds it, unless it is narrower than the lattice.
"""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ...compiled import compiled, kernel
from ..goal import Goal
from ..plan import TrailerPath
from ..trailer import Trailer, half_angles, held_states
from .words import Endings, Words, control_set, endings_of, normalised, within_jackknife, words_of

TURN = 2.0 * math.pi
# Of words whose times differ by less, the first is taken, so that rounding does not decide
# [1 / turn rate].
ALIKE = np.float32(1e-5)


@kernel
def _excess(gap, width):
    """How far an angle is outside a box."""
    return abs(gap - TURN * np.rint(gap / TURN)) - width


@kernel
def _later(part, before, after):
    """The later of a moment and that at which an excess falls to zero, by interpolation."""
    if before > 0.0 and after <= 0.0:
        return max(part, before / (before - after))
    return part


@kernel
def _half_angle(matrix, s, c):
    return matrix[0, 0] * s + matrix[0, 1] * c, matrix[1, 0] * s + matrix[1, 1] * c


@kernel
def _first_sample(gap, omega_step, width):
    """First sample of a turn at which theta is inside the box; -1: a straight never is.

    Args:
        gap: Heading minus that of the box, at sample 0 [rad].
        omega_step: Change of the heading from sample to sample [rad].
        width: Half-width of the box [rad].
    """
    gap -= TURN * np.rint(gap / TURN)
    if abs(gap) <= width:
        return 0
    if omega_step == 0.0:
        return -1
    way = -gap if omega_step > 0.0 else gap
    way += TURN if way < 0.0 else 0.0
    return math.ceil((way - width) / abs(omega_step))


@kernel
def _comes_round(start, soon, after):
    """Whether beta passes pi on an arc: then it ends on the other side than it sets out for."""
    s, c = _half_angle(soon, math.sin(start / 2), math.cos(start / 2))
    way = 2.0 * math.atan2(s, c) - start
    way -= TURN * np.rint(way / TURN)
    gap = after - TURN * np.rint(after / TURN) - (start - TURN * np.rint(start / TURN))
    return way * gap < 0.0


@compiled
def enter_box(
    table,
    found,
    thetas,
    halves,
    ends,
    maps,
    allowed,
    lengths,
    lasts,
    last_maps,
    box,
    widths,
    sample,
    limited,
    offset,
):
    """Lower a table by the words that end with one control. Places are in cells.

    A word has the same displacement from every node of one theta: so the nodes from which it ends
    in the box form a rectangle, and their beta is tested through one matrix. The rectangle is
    turned by the heading of the box.

    Args:
        table: Times so far, shape (n_theta, n_beta, n_y, n_x).
        found: Where the numbers of the words go, of the same shape.
        thetas: Of the rows to lower, shape (m,) [rad].
        halves: (sin, cos) of half of beta, shape (n_beta, 2).
        ends, maps: Of the words without their last arcs, see `Words`.
        allowed: Whether beta keeps within jackknife along each word, shape (n, n_beta).
        lengths: Largest number of a sample on the last arc, shape (n,).
        lasts: dx, dy, dtheta at the samples of the last arc, shape (n_samples, 3).
        last_maps: The same for the trailer, shape (n_samples, 2, 2).
        box: Middle of the goal: x, y, theta, beta.
        widths: Its half-widths, along its heading first; those of angles may be infinite: free.
        sample: Time from sample to sample.
        limited: Whether beta must not pass pi.
        offset: To be added to the numbers of words.
    """
    _, beta_count, y_count, x_count = table.shape
    goal_s, goal_c = math.sin(box[3] / 2), math.cos(box[3] / 2)
    bound = math.sin(min(widths[3], math.pi) / 2) ** 2
    turn = lasts[1, 2]
    single = x_count * y_count == 1
    pace = math.hypot(lasts[1, 0], lasts[1, 1]) * 1.01
    box_c, box_s = math.cos(box[2]), math.sin(box[2])
    # Half of what the turned box covers along the grid.
    wide = abs(box_c) * widths[0] + abs(box_s) * widths[1]
    tall = abs(box_s) * widths[0] + abs(box_c) * widths[1]
    for t in range(len(thetas)):
        cos, sin = math.cos(thetas[t]), math.sin(thetas[t])
        for w in range(len(ends)):
            # From a single state one knows whether a word can still be quicker.
            if single and beta_count == 1 and table[t, 0, 0, 0] <= ends[w, 3]:
                continue
            theta = thetas[t] + ends[w, 2]
            first = _first_sample(theta - box[2], turn, widths[2])
            if first < 0:
                continue
            # The middle of the box, carried back along the word.
            x0 = box[0] - (cos * ends[w, 0] - sin * ends[w, 1])
            y0 = box[1] - (sin * ends[w, 0] + cos * ends[w, 1])
            longest = min(lengths[w], len(lasts) - 1)
            reach = longest * pace
            if first > longest or (single and max(abs(x0) - wide, abs(y0) - tall) > reach):
                continue
            c, s = math.cos(theta), math.sin(theta)
            for k in range(first, longest + 1):
                if _excess(theta + lasts[k, 2] - box[2], widths[2]) > 0.0:
                    break
                x = x0 - (c * lasts[k, 0] - s * lasts[k, 1])
                y = y0 - (s * lasts[k, 0] + c * lasts[k, 1])
                left = max(0, math.ceil(x - wide))
                right = min(x_count - 1, math.floor(x + wide))
                low = max(0, math.ceil(y - tall))
                high = min(y_count - 1, math.floor(y + tall))
                if left > right or low > high:
                    continue
                # Where the box was at the sample before, and how far outside theta was.
                p = max(k - 1, 0)
                x_before = x0 - (c * lasts[p, 0] - s * lasts[p, 1])
                y_before = y0 - (s * lasts[p, 0] + c * lasts[p, 1])
                turned = _later(
                    0.0,
                    _excess(theta + lasts[p, 2] - box[2], widths[2]),
                    _excess(theta + lasts[k, 2] - box[2], widths[2]),
                )
                time = ends[w, 3] + p * sample
                for b in range(beta_count):
                    if not allowed[w, b]:
                        continue
                    start_s, start_c = _half_angle(maps[w], halves[b, 0], halves[b, 1])
                    end_s, end_c = _half_angle(last_maps[k], start_s, start_c)
                    cross = end_s * goal_c - end_c * goal_s
                    if cross * cross > bound * (end_s * end_s + end_c * end_c):
                        continue
                    folded = -1.0  # not known yet
                    for j in range(low, high + 1):
                        for i in range(left, right + 1):
                            if table[t, b, j, i] <= time:
                                continue
                            ahead = abs(box_c * (i - x) + box_s * (j - y)) - widths[0]
                            aside = abs(box_c * (j - y) - box_s * (i - x)) - widths[1]
                            if max(ahead, aside) > 1e-9:
                                continue
                            if folded < 0.0:
                                start = 2.0 * math.atan2(start_s, start_c)
                                after = 2.0 * math.atan2(end_s, end_c)
                                if limited and _comes_round(start, last_maps[1], after):
                                    break
                                s_before, c_before = _half_angle(last_maps[p], start_s, start_c)
                                before = 2.0 * math.atan2(s_before, c_before)
                                folded = _later(
                                    turned,
                                    _excess(before - box[3], widths[3]),
                                    _excess(after - box[3], widths[3]),
                                )
                            dx, dy = i - x_before, j - y_before
                            before_ahead = abs(box_c * dx + box_s * dy) - widths[0]
                            before_aside = abs(box_c * dy - box_s * dx) - widths[1]
                            part = _later(folded, before_ahead, min(ahead, 0.0))
                            part = _later(part, before_aside, min(aside, 0.0))
                            value = np.float32(time + part * (k - p) * sample)
                            if value < table[t, b, j, i] - ALIKE:
                                table[t, b, j, i] = value
                                found[t, b, j, i] = w + offset


# Arcs before the last, the lattice of their durations, and the longest word [1 / turn rate].
BEFORE_LAST = 2
LATTICE = 1 / 32
LONGEST = 5.0
# Longest single straight, and time between samples of the last arc [1 / turn rate].
REACH = 20.0
SAMPLE = 0.05
# Samples of a path per 1 / turn rate.
_DENSITY = 20
_NOWHERE = np.float32(np.inf)


class ArcWord(NamedTuple):
    """Controls, one after the other.

    Attributes:
        controls: v, omega, shape (k, 2) [m/s], [rad/s].
        durations: How long each is held, shape (k,) [s].
    """

    controls: np.ndarray
    durations: np.ndarray

    @property
    def time(self) -> float:
        """Of travel [s]."""
        return float(self.durations.sum())


def quickest_word(trailer: Trailer, start, goal: Goal, lattice: float = LATTICE) -> ArcWord | None:
    """The quickest word into a box, with its first arcs on a lattice; None if there is none.

    Its end is in the box but for an error of interpolation, a thousandth of a turning radius.

    Args:
        trailer: The cart, in the open field.
        start: x, y, theta, beta [m], [m], [rad], [rad].
        goal: The box; x and y have finite tolerances.
        lattice: Step of the durations of the first arcs [1 / turn rate].
    """
    cart = normalised(trailer)
    radius = trailer.radius
    words, endings = _known(cart, lattice)
    x, y, theta, beta = (float(value) for value in start)
    middle = (goal.state[0] - x) / radius, (goal.state[1] - y) / radius
    box = np.array([*middle, goal.state[2], goal.state[3]])
    widths = np.array(goal.tolerance) / [radius, radius, 1.0, 1.0] + 1e-9
    limited = cart.jackknife < math.pi
    best = np.full((1, 1, 1, 1), _NOWHERE)
    found = np.zeros(best.shape, dtype=np.int32)
    node = np.array([theta]), half_angles([beta])
    choice: tuple[Endings, int] | None = None
    allowed = within_jackknife(words, [beta], cart.jackknife)
    for each in endings:
        before = best[0, 0, 0, 0]
        first = each.words.ends, each.words.maps, allowed[each.numbers], each.lengths
        last = each.shifts, each.maps
        enter_box(best, found, *node, *first, *last, box, widths, SAMPLE, limited, 0)
        if best[0, 0, 0, 0] < before:
            choice = each, int(each.numbers[found[0, 0, 0, 0]])
    if choice is None:
        return None
    ending, word = choice
    arcs = _arcs_of(words, word, lattice)
    arcs.append((ending.control, float(best[0, 0, 0, 0] - words.ends[word, 3])))
    pairs = control_set(cart) * [trailer.speed, trailer.turn_rate]
    numbers, times = zip(*arcs, strict=True)
    return ArcWord(pairs[list(numbers)], np.array(times) / trailer.turn_rate)


def word_path(trailer: Trailer, start, word: ArcWord) -> TrailerPath:
    """Where a word leads from a state, sampled along its arcs.

    Args:
        trailer: Which drives.
        start: x, y, theta, beta [m], [m], [rad], [rad].
        word: Its arcs.
    """
    state = np.array(start, dtype=float)
    states, controls, steps = [state[None]], [], []
    for (v, omega), duration in zip(word.controls.tolist(), word.durations.tolist(), strict=True):
        count = max(2, math.ceil(_DENSITY * duration * trailer.turn_rate))
        states.append(held_states(trailer, states[-1][-1], (v, omega), duration, count))
        controls.append(np.tile([v, omega], (count, 1)))
        steps.append(np.full(count, duration / count))
    times = np.append(0.0, np.cumsum(np.concatenate(steps)))
    return TrailerPath(times, np.concatenate(states), np.concatenate(controls))


@lru_cache(maxsize=4)
def _known(cart: Trailer, lattice: float) -> tuple[Words, list[Endings]]:
    words = words_of(cart, BEFORE_LAST, LONGEST, lattice)
    return words, endings_of(cart, words, LONGEST, REACH, SAMPLE)


def _arcs_of(words: Words, number: int, lattice: float) -> list[tuple[int, float]]:
    """Controls of a word and their durations, in order."""
    arcs: list[tuple[int, float]] = []
    while number:
        control = int(words.last[number])
        if arcs and arcs[0][0] == control:
            arcs[0] = control, arcs[0][1] + lattice
        else:
            arcs.insert(0, (control, lattice))
        number = int(words.roots[number])
    return arcs
