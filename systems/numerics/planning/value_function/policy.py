"""The way down a table: what the roll-out, the feedback system and the command drive.

The best descents of the table, and the quickest word of three arcs, are words of held controls; the
durations of each are chosen anew to take the least time into the goal box, exactly, so that errors
of the table decide at most which word is taken. Among walls a path is searched down the table too,
and durations are chosen among those whose words keep clear. A cart that follows a word keeps to it
while it still leads into the box, and clear of walls, chooses its durations anew when it does not,
and takes another only when that does not help.
"""

import math
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from ..arc_words.candidates import car_words, keeps_limit, quickest_words, rank
from ..arc_words.quickest import LONGEST, ArcWord, quickest_word, word_path
from ..arc_words.shortened import OVERLAP, Clearance, end_of, merged, shortened
from ..goal import Goal
from .descents import descents
from .obstacles import with_spare
from .room import SPARE, room_along, room_of
from .value_function import ValueFunction
from .walled_search import search_path

# Descents that are shortened.
WAYS = 4
# Words of a car are tried that take at most so much longer than the quickest descent
# [1 / turn rate].
LONGER_CAR_PATH = 2.0
# A word that is kept may take this much longer than it was to take, relative to it, and this much
# in all [1 / turn rate].
LONGER, SLACK = 0.1, 0.2
# How much more time than into the whole box a way may take that keeps off its edge
# [1 / turn rate].
DETOUR = 0.5
# Of the margin, what a way that is kept may lose before it is chosen anew.
HALF = 0.5
# Room that a cart in its place beside a wall may lose at a start, in lengths of the trailer.
_ROUNDING = 1e-9
# No arcs: the cart is there.
STANDSTILL = ArcWord(np.zeros((0, 2)), np.zeros(0))


def best_word(value: ValueFunction, state, margin: float = 0.0) -> ArcWord | None:
    """The quickest way into the goal box that the table knows of; None where it knows none.

    Args:
        value: The table.
        state: x, y, theta, beta [m], [m], [rad], [rad].
        margin: Part of the half-widths of the box to keep off its edge, in [0, 1), and as far off
            walls as in x and y; it is given up where it would cost a detour.
    """
    local = value.to_table(state)
    whole = _best_into(value, local, value.goal, _spare(value, local, 0.0))
    if margin == 0.0 or whole is None:
        return whole
    inner = _best_into(value, local, _inner(value.goal, margin), _spare(value, local, margin))
    if inner is None or inner.time > whole.time + DETOUR / value.trailer.turn_rate:
        return whole
    return inner


def attained_times(value: ValueFunction, states: ArrayLike) -> np.ndarray:
    """Time in which a cart really gets into the goal box from each state [s].

    That of `best_word`: no promise by interpolation, as is `ValueFunction.time_to_go`, but how
    long a path takes that ends in the box when it is driven. So it is an upper bound of the least
    time, whatever the grid, and in the open mostly equal to it. Each state costs about as much as
    a roll-out, a tenth of a second.

    Args:
        value: The table.
        states: x, y, theta, beta, shape (..., 4) [m], [m], [rad], [rad].

    Returns:
        Shape (...); infinite where the table knows no way.
    """
    each = np.asarray(states, dtype=float)
    times = np.full(each.shape[:-1], math.inf)
    for place in np.ndindex(times.shape):
        word = best_word(value, each[place])
        times[place] = math.inf if word is None else word.time
    return times


def next_word(
    value: ValueFunction, state, word: ArcWord | None, margin: float = 0.0
) -> ArcWord | None:
    """The way to go on from a state for a cart that has followed a word so far.

    Args:
        value: The table.
        state: x, y, theta, beta, perhaps not quite where the word was to lead.
        word: What is left of the word; None: none was followed.
        margin: See `best_word`.

    Returns:
        No arcs: the cart is there. None: the table knows no way.
    """
    local = value.to_table(state)
    if word is None or not len(word.durations):
        # Standing in the box, it does not set out again to be farther from its edge.
        there = word is not None and bool(value.goal.contains(local))
        return STANDSTILL if there else best_word(value, state, margin)
    end, spare = end_of(value.trailer, local, word), _spare(value, local, HALF * margin)
    if _inner(value.goal, HALF * margin).contains(end) and _is_clear(value, local, word, spare):
        return word
    longest = (1 + LONGER) * word.time + SLACK / value.trailer.turn_rate
    for part in (margin, 0.0):
        goal, spare = _inner(value.goal, part), _spare(value, local, part)
        anew = shortened(value.trailer, local, word, goal, _clearance(value, spare))
        if anew is not None and anew.time <= longest and _allowed(value, local, anew, spare):
            return anew
    best = best_word(value, state, margin)
    if best is None and _is_clear(value, local, word, 0.0):
        # Beside the grid, what it follows leads back.
        return word
    return best


def _best_into(value: ValueFunction, local: np.ndarray, aim: Goal, spare: float) -> ArcWord | None:
    if aim.contains(local):
        return STANDSTILL
    trailer = value.trailer
    at_home = replace(value, placement=(0.0, 0.0, 0.0))
    ways = [
        merged(ArcWord(way.path.controls, np.diff(way.path.times)))
        for way in descents(at_home, local, aim=aim)[:WAYS]
    ]
    if value.walls is not None:
        search = search_path(at_home, with_spare(value.walls, spare), local, aim)
        if search.path is not None:
            path = search.path
            ways.append(merged(ArcWord(path.controls, np.diff(path.times))))
    ways.sort(key=lambda word: word.time)
    words = list(ways)
    # Where descents miss a channel, the promise knows of it.
    least = min([float(at_home.time_to_go(local)), *(word.time for word in ways)])
    if least * trailer.turn_rate < LONGEST:
        entry = quickest_word(trailer, local, aim)
        words += [] if entry is None else [entry]
    longest = LONGER_CAR_PATH + ways[0].time * trailer.turn_rate if ways else math.inf
    words += car_words(trailer, local, aim, longest)

    def allowed(word: ArcWord) -> bool:
        return _allowed(value, local, word, spare)

    near = quickest_words(trailer, local, words, aim, allowed, _clearance(value, spare))
    # A descent arrives as it is, should its durations not be for the better.
    if value.walled:
        ways = [word for word in ways if _is_clear(value, local, word, spare)]
    return min([*near, *ways], key=lambda word: rank(word, trailer), default=None)


def _allowed(value: ValueFunction, local: np.ndarray, word: ArcWord, spare: float) -> bool:
    """Whether a word keeps on the grid, clear of walls and within the jackknife limit."""
    states = word_path(value.trailer, local, word).states if len(word.durations) else local[None]
    x_min, y_min, x_max, y_max = value.grid.bounds
    x, y = states[:, 0], states[:, 1]
    on_grid = (x >= x_min) & (x <= x_max) & (y >= y_min) & (y <= y_max)
    kept = bool(on_grid.all()) and keeps_limit(value.trailer, local, word)
    return kept and _is_clear(value, local, word, spare)


def _spare(value: ValueFunction, local: np.ndarray, margin: float) -> float:
    """How far to keep off walls; a cart that is nearer comes no nearer [m]."""
    if value.walls is None:
        return 0.0
    length = value.trailer.length
    wanted = SPARE * length + margin * min(value.goal.tolerance[:2])
    return min(wanted, room_of(value.walls, local) - _ROUNDING * length)


def _clearance(value: ValueFunction, spare: float) -> Clearance | None:
    """What words have to keep off walls, for the search for durations."""
    if value.walls is None:
        return None
    return partial(room_along, with_spare(value.walls, spare), value.trailer)


def _is_clear(value: ValueFunction, local: np.ndarray, word: ArcWord, spare: float) -> bool:
    """Whether a word keeps off walls, as nearly as the search for durations does."""
    clearance = _clearance(value, spare)
    if clearance is None or not len(word.durations):
        return True
    least = float(clearance(local, word, True)(word.durations)[0].min())
    return least >= -OVERLAP * value.trailer.length


def _inner(goal: Goal, margin: float) -> Goal:
    """The goal with its box drawn in by part of its half-widths."""
    if margin == 0.0:
        return goal
    x, y, theta, beta = ((1 - margin) * width for width in goal.tolerance)
    return replace(goal, tolerance=(x, y, theta, beta))
