"""Words of arcs that lead to a goal: Levenberg-Marquardt on the misses, from many seeds.

A word is a sequence of bang arcs (1 left, -1 right) with at most one singular arc (0) among them.
On the singular arc the costate follows from the state and the turn rate (with lambda_0 = 1):

    lambda_theta = omega, lambda_beta = -omega,
    (lambda_x, lambda_y) = (1 - omega sin(beta)) (cos, sin)(theta) + omega cos(beta) (sin, -cos),

and from there along the bangs: lambda_theta changes by lambda_x dy - lambda_y dx, and lambda_beta
by the factor by which the flow of beta contracts. Between two bangs the switching function
lambda_theta + lambda_beta (3.24) has to vanish; next to the singular arc it does so by itself.
With the four coordinates of the goal that makes as many equations as unknowns: durations, and the
turn rate at which the singular arc begins.

An extremal that brings beta to the goal turns once more at the end, against the turn before. Drive
the goal back along such a turn, the start forward along a first one, or neither, and join the two
by Dubins words: x, y and theta are met, and beta is left to the solver. Rarer kinds are
added: a whole circle before or after, which may be what brings beta about; a singular arc that
turns between the second and third of four bangs; a short first turn the other way.

Source: Zhang 2014, (3.22)-(3.24); Chitsaz 2013; Marquardt 1963, with the damping lowered after a
step that helps and raised after one that does not.
"""

import math

import numpy as np

from ...compiled import compiled, kernel
from ..car_paths import dubins_paths
from .arcs import TERMS, singular_arc, turned_beta, turning_arc

# Most arcs in a word; unknowns: their durations, then the turn rate.
ARCS = 5
_TURN = 2.0 * math.pi


@kernel
def word_misses(word, unknowns, start, goal, first, states, series, misses):
    """States at the ends of the arcs, and the misses: of the goal, then of the switches.

    Args:
        word: Of each arc 1, -1, or 0 where it is singular, shape (n,).
        unknowns: Durations and the turn rate, shape (n + 1,).
        start: x, y, theta, beta, shape (4,).
        goal: The same.
        first: Arc from which on the states are computed; those before it are taken as they are.
        states: Filled, shape (n + 1, 4).
        series: Scratch, shape (7, TERMS + 1).
        misses: Filled, shape (n + 1,).

    Returns:
        How many misses there are.
    """
    n = word.size
    singular = -1
    for j in range(4):
        states[0, j] = start[j]
    for i in range(n):
        if word[i] == 0:
            singular = i
        if i < first:
            continue
        x, y, theta, beta = states[i, 0], states[i, 1], states[i, 2], states[i, 3]
        if word[i] == 0:
            x, y, theta, beta, _ = singular_arc(
                x, y, theta, beta, unknowns[n], 1.0, unknowns[i], series
            )
        else:
            x, y, theta, beta = turning_arc(x, y, theta, beta, 1.0, word[i], unknowns[i])
        states[i + 1, 0], states[i + 1, 1], states[i + 1, 2], states[i + 1, 3] = x, y, theta, beta
    misses[0] = states[n, 0] - goal[0]
    misses[1] = states[n, 1] - goal[1]
    for j in range(2, 4):
        gap = states[n, j] - goal[j]
        misses[j] = gap - _TURN * math.floor(gap / _TURN + 0.5)
    count = 4
    if singular < 0:
        return count
    theta, beta, omega = states[singular, 2], states[singular, 3], unknowns[n]
    forward, sideways = 1.0 - omega * math.sin(beta), omega * math.cos(beta)
    east = forward * math.cos(theta) + sideways * math.sin(theta)
    north = forward * math.sin(theta) - sideways * math.cos(theta)
    # Backwards from the singular arc; there lambda_beta = -lambda_theta.
    costate_theta, costate_beta = omega, -omega
    for i in range(singular - 1, 0, -1):
        dx, dy = states[i + 1, 0] - states[i, 0], states[i + 1, 1] - states[i, 1]
        costate_theta -= east * dy - north * dx
        costate_beta /= turned_beta(states[i, 3], 1.0, word[i], unknowns[i])[1]
        misses[count] = costate_theta + costate_beta
        count += 1
    # Forwards from its end, where the turn rate has the rate of theta, by the same integral.
    dx = states[singular + 1, 0] - states[singular, 0]
    dy = states[singular + 1, 1] - states[singular, 1]
    costate_theta = omega + east * dy - north * dx
    costate_beta = -costate_theta
    for i in range(singular + 1, n - 1):
        dx, dy = states[i + 1, 0] - states[i, 0], states[i + 1, 1] - states[i, 1]
        costate_theta += east * dy - north * dx
        costate_beta *= turned_beta(states[i, 3], 1.0, word[i], unknowns[i])[1]
        misses[count] = costate_theta + costate_beta
        count += 1
    return count


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


# Of any arc, in the normalised model.
_LONGEST = 1e4
# For the slopes of the misses.
_DIFFERENCE = 1e-7
# A seed is given up after so many iterations, if its squared miss is still as large as this.
_PATIENCE = 7
_HOPELESS = 0.02
# Squared misses below which one more step is the last, and below which a step that does not help
# ends the search.
_SETTLED = 1e-24
_ROUNDING = 1e-22
_WEAKEST, _STRONGEST = 1e-14, 1e8


@compiled
def solve_words(words, lengths, seeds, start, goal, iterations):
    """Solve from every seed.

    Args:
        words: Of each seed, shape (m, ARCS), as far as its length.
        lengths: Arcs in each word, shape (m,).
        seeds: Durations, as many as arcs, then the turn rate; shape (m, ARCS + 1).
        start: x, y, theta, beta in the normalised model, shape (4,).
        goal: The same; theta and beta are met up to whole turns.
        iterations: At most, for each seed.

    Returns:
        Answers, shape (m, ARCS + 1), arranged as the seeds, and the largest miss of each, shape
        (m,). Along the singular arc the turn rate may have left its bounds.
    """
    answers = seeds.copy()
    errors = np.empty(seeds.shape[0])
    size = ARCS + 1
    states, tried_states = np.empty((size, 4)), np.empty((size, 4))
    series = np.empty((7, TERMS + 1))
    misses, tried_misses = np.zeros(size), np.zeros(size)
    tried, step = np.empty(size), np.empty(size)
    slopes, normal = np.empty((size, size)), np.empty((size, size))
    for seed in range(seeds.shape[0]):
        n = lengths[seed]
        word = words[seed, :n]
        answer = answers[seed, : n + 1]
        singular = _singular_place(word)
        free = n + 1 if singular < n else n
        tried[: n + 1] = answer
        count = word_misses(word, answer, start, goal, 0, states, series, misses)
        cost = _squared(misses, count)
        damping = 1e-3
        fresh = True
        for iteration in range(iterations):
            if iteration == _PATIENCE and cost > _HOPELESS:
                break
            if fresh:
                _fill_slopes(
                    word,
                    singular,
                    answer,
                    start,
                    goal,
                    states,
                    tried_states,
                    series,
                    misses,
                    tried,
                    tried_misses,
                    slopes,
                )
            _fill_normal_equations(slopes, misses, count, free, damping, normal, step)
            if not _solve(normal, step, free):
                break
            _fill_tried(word, answer, step, free, tried)
            word_misses(word, tried, start, goal, 0, tried_states, series, tried_misses)
            tried_cost = _squared(tried_misses, count)
            fresh = tried_cost < cost
            if not fresh:
                damping = max(8.0 * damping, 1e-8)
                if cost < _ROUNDING or damping > _STRONGEST:
                    break
                continue
            settled = cost < _SETTLED
            answer[:] = tried[: n + 1]
            states[: n + 1] = tried_states[: n + 1]
            misses[:count] = tried_misses[:count]
            cost = tried_cost
            damping = max(0.1 * damping, _WEAKEST)
            if settled:
                break
        errors[seed] = np.max(np.abs(misses[:count]))
    return answers, errors


@kernel
def _squared(values, count):
    total = 0.0
    for i in range(count):
        total += values[i] * values[i]
    return total


@kernel
def _singular_place(word):
    # Its index; as many as there are arcs, where there is none.
    for i in range(word.size):
        if word[i] == 0:
            return i
    return word.size


@kernel
def _fill_slopes(
    word,
    singular,
    answer,
    start,
    goal,
    states,
    tried_states,
    series,
    misses,
    tried,
    tried_misses,
    slopes,
):
    # Forward differences of the misses.
    n = word.size
    for k in range(n + 1 if singular < n else n):
        for j in range(n + 1):
            tried[j] = answer[j]
        tried[k] += _DIFFERENCE
        # The turn rate acts from the singular arc on.
        first = k if k < n else singular
        for i in range(first + 1):
            for j in range(4):
                tried_states[i, j] = states[i, j]
        count = word_misses(word, tried, start, goal, first, tried_states, series, tried_misses)
        for i in range(count):
            slopes[i, k] = (tried_misses[i] - misses[i]) / _DIFFERENCE


@kernel
def _fill_normal_equations(slopes, misses, count, free, damping, normal, right):
    for k in range(free):
        right[k] = 0.0
        for i in range(count):
            right[k] -= slopes[i, k] * misses[i]
        for j in range(free):
            normal[k, j] = 0.0
            for i in range(count):
                normal[k, j] += slopes[i, k] * slopes[i, j]
        normal[k, k] += damping * (1e-6 + normal[k, k])


@kernel
def _fill_tried(word, answer, step, free, tried):
    # No unknown changes by more than 1, no arc is driven backwards, and the turn rate is bounded.
    n = word.size
    largest = 1.0
    for k in range(free):
        largest = max(largest, abs(step[k]))
    for k in range(n + 1):
        tried[k] = answer[k]
    for k in range(free):
        tried[k] += step[k] / largest
        if k < n:
            tried[k] = min(max(tried[k], 0.0), _LONGEST)
        else:
            tried[k] = min(max(tried[k], -1.0), 1.0)


@kernel
def _solve(matrix, right, size):
    """Gauss elimination with pivots, in place; the answer in `right`. False where singular."""
    for i in range(size):
        pivot = i
        for k in range(i + 1, size):
            if abs(matrix[k, i]) > abs(matrix[pivot, i]):
                pivot = k
        if not abs(matrix[pivot, i]) > 1e-300:
            return False
        for j in range(size):
            matrix[i, j], matrix[pivot, j] = matrix[pivot, j], matrix[i, j]
        right[i], right[pivot] = right[pivot], right[i]
        for k in range(i + 1, size):
            factor = matrix[k, i] / matrix[i, i]
            for j in range(i, size):
                matrix[k, j] -= factor * matrix[i, j]
            right[k] -= factor * right[i]
    for i in range(size - 1, -1, -1):
        for j in range(i + 1, size):
            right[i] -= matrix[i, j] * right[j]
        right[i] /= matrix[i, i]
    return True
