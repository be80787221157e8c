"""Words to begin from: car paths to where the last turn begins.

An extremal that brings beta to the goal turns once more at the end, against the turn before. Drive
the goal back along such a turn, the start forward along a first one, or neither, and join the two
by Dubins words: x, y and theta are met, and beta is left to the solver. Rarer kinds are
added: a whole circle before or after, which may be what brings beta about; a singular arc that
turns between the second and third of four bangs; a short first turn the other way.
"""

import math

import numpy as np

from ..dubins import dubins_paths
from .arcs import turning_arc
from .shooting import ARCS

# Durations of the last turn, and of a first one, in the normalised model.
_LAST_TURNS = (0.15, 0.5, 1.0, 1.6)
_FIRST_TURNS = (0.4, 1.0)
# A first turn of its own is rare: it is tried with these last turns only.
_LAST_TURNS_AFTER_FIRST = (0.5, 1.6)
# An arc shorter than this is tried with a circle more [rad].
_SHORT_ARC = 0.6
# The singular arc between bangs: its turn rate, towards the next bang, and its duration.
_TURNING_RATE = 0.5
_TURNING_TIME = 0.4
# A short first arc is also tried as one the other way, of this duration.
_OTHER_WAY_TIME = 0.15


def word_seeds(start, goal) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Seeds for `solve_words`.

    Args:
        start: x, y, theta, beta in the normalised model, shape (4,).
        goal: The same.

    Returns:
        Words, shape (m, ARCS), their lengths, shape (m,), and the unknowns, shape (m, ARCS + 1).
    """
    found = [(path.turns, path.lengths) for path in dubins_paths(start[:3], goal[:3], 1.0)]
    found = [(turns, lengths) for turns, lengths in found if turns[1] == 0]
    for last in (1, -1):
        for end in _LAST_TURNS:
            before = turning_arc(goal[0], goal[1], goal[2], 0.0, -1.0, -float(last), end)[:3]
            for path in dubins_paths(start[:3], before, 1.0):
                if path.turns[2] == -last:
                    found.append(((*path.turns, last), (*path.lengths, end)))
            if end not in _LAST_TURNS_AFTER_FIRST:
                continue
            for first in (1, -1):
                for begin in _FIRST_TURNS:
                    after = turning_arc(
                        start[0], start[1], start[2], 0.0, 1.0, float(first), begin
                    )[:3]
                    for path in dubins_paths(after, before, 1.0):
                        if path.turns == (-first, 0, -last):
                            word = (first, *path.turns, last)
                            found.append((word, (begin, *path.lengths, end)))
    found.extend(list(_with_circles(found)))
    found = [(turns, lengths, 0.0) for turns, lengths in found]
    found.extend([*_with_singular_arc(found), *_turned_the_other_way(found)])
    words = np.zeros((len(found), ARCS))
    unknowns = np.zeros((len(found), ARCS + 1))
    for i, (turns, lengths, omega) in enumerate(found):
        words[i, : len(turns)] = turns
        unknowns[i, : len(lengths)] = lengths
        unknowns[i, len(lengths)] = omega
    return words, np.array([len(turns) for turns, _, _ in found]), unknowns


def _with_circles(found):
    # Of words around one singular arc, whose first or third arc is short.
    for turns, lengths in found:
        for i in (0, 2):
            if len(turns) < ARCS and turns[1] == 0 and lengths[i] < _SHORT_ARC:
                longer = list(lengths)
                longer[i] += math.tau
                yield turns, tuple(longer)


def _with_singular_arc(found):
    # Of words of four bangs.
    for turns, lengths, _ in found:
        if len(turns) == 4 and 0 not in turns:
            word = (*turns[:2], 0, *turns[2:])
            times = (*lengths[:2], _TURNING_TIME, *lengths[2:])
            yield word, times, _TURNING_RATE * turns[2]


def _turned_the_other_way(found):
    # Of words around one singular arc, whose first arc is short.
    for turns, lengths, _ in found:
        if len(turns) < ARCS and turns[1] == 0 and lengths[0] < _SHORT_ARC:
            times = (_OTHER_WAY_TIME, *lengths[1:])
            yield (-turns[0], *turns[1:]), times, _TURNING_RATE * turns[2]
