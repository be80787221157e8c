"""Words of arcs that lead to a goal: Levenberg-Marquardt on the misses, from many seeds.

Source: Marquardt 1963, with the damping lowered after a step that helps and raised after one that
does not.
"""

import numpy as np

from ...compiled import compiled, kernel
from .shooting import ARCS, word_misses
from .singular import TERMS

# Of any arc, in the normalised model.
_LONGEST = 1e4
# For the slopes of the misses.
_DIFFERENCE = 1e-7
# A seed is given up after so many iterations, if its squared miss is still as large as this.
_PATIENCE = 7
_HOPELESS = 0.02
# Squared misses below which a step more is the last, and below which there is none better.
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
