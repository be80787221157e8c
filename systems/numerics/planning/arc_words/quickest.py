"""The quickest word of three arcs from one state into a goal box.

Ways into a small box can be a channel that no Dubins path to its middle is near. All words on a
fine lattice find it, if it is not narrower than that.
"""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ..goal import Goal
from ..plan import TrailerPath
from ..trailer import Trailer
from .box_entries import enter_box
from .held_controls import control_set, half_angles, hold_beta, normalised, shift_of
from .words import Endings, Words, endings_of, within_jackknife, words_of

# Arcs before the last, the lattice of their durations, and the longest word [1 / turn rate].
BEFORE_LAST = 2
LATTICE = 1 / 32
LONGEST = 5.0
# Longest straight alone, and samples of the last arc [1 / turn rate].
REACH = 20.0
SAMPLE = 0.05
# Samples of a path in one of 1 / turn rate.
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
    radius = trailer.speed / trailer.turn_rate
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
    allowed = np.ones((len(words.ends), 1), dtype=bool)
    if limited:
        allowed = within_jackknife(words, [beta], cart.jackknife)
    for each in endings:
        before = best[0, 0, 0, 0]
        first = each.words.ends, each.words.maps, allowed[each.numbers], each.lengths
        last = each.shifts, each.maps
        enter_box(best, found, *node, *first, *last, box, widths, SAMPLE, limited)
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
        times = duration / count * np.arange(1, count + 1)
        x, y, theta, beta = states[-1][-1]
        dx, dy = shift_of(theta, v, omega, times)
        angles = hold_beta(beta, v, omega, duration, count, trailer)[1:]
        states.append(np.column_stack([x + dx, y + dy, theta + omega * times, angles]))
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
