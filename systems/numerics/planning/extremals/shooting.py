"""Where a word of arcs leads, and by how much its costate misses its switches.

A word is a sequence of bang arcs (1 left, -1 right) with at most one singular arc (0) among them.
On the singular arc the costate follows from the state and the turn rate (with lambda_0 = 1):

    lambda_theta = omega, lambda_beta = -omega,
    (lambda_x, lambda_y) = (1 - omega sin(beta)) (cos, sin)(theta) + omega cos(beta) (sin, -cos),

and from there along the bangs: lambda_theta changes by lambda_x dy - lambda_y dx, and lambda_beta
by the factor by which the flow of beta contracts. Between two bangs the switching function
lambda_theta + lambda_beta (3.24) has to vanish; next to the singular arc it does so by itself.
With the four coordinates of the goal that makes as many equations as unknowns: durations, and the
turn rate at which the singular arc begins.

Source: Zhang 2014, (3.22)-(3.24); Chitsaz 2013.
"""

import math

import numpy as np

from ...compiled import compiled, kernel
from .arcs import turned_beta, turning_arc
from .singular import TERMS, singular_arc

# Most arcs in a word; unknowns: their durations, then the turn rate.
ARCS = 5
_TURN = 2.0 * math.pi
# Of any arc, in the normalised model.
_LONGEST = 1e4
# A seed is given up after so many iterations, if its squared miss is still as large as this.
PATIENCE = 7
HOPELESS = 0.02


@kernel
def _misses(word, unknowns, start, goal, first, states, series, misses):
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


@compiled
def solve_words(words, lengths, seeds, start, goal, iterations):
    """Levenberg-Marquardt from every seed.

    Args:
        words: Of each seed, shape (m, ARCS), as far as its length.
        lengths: Arcs in each word, shape (m,).
        seeds: Durations, as many as arcs, then the turn rate; shape (m, ARCS + 1).
        start: x, y, theta, beta, shape (4,).
        goal: The same; theta and beta are met up to whole turns.
        iterations: At most, for each seed.

    Returns:
        Answers, shape (m, ARCS + 1), arranged as the seeds, and the largest miss of each, shape
        (m,).
    """
    answers = seeds.copy()
    errors = np.full(seeds.shape[0], np.inf)
    size = ARCS + 1
    states, tried_states = np.empty((size, 4)), np.empty((size, 4))
    series = np.empty((7, TERMS + 1))
    misses, tried_misses = np.zeros(size), np.zeros(size)
    tried, step, gradient = np.empty(size), np.empty(size), np.empty(size)
    slopes, normal, matrix = np.empty((size, size)), np.empty((size, size)), np.empty((size, size))
    for seed in range(seeds.shape[0]):
        n = lengths[seed]
        word = words[seed, :n]
        singular = -1
        for i in range(n):
            if word[i] == 0:
                singular = i
        free = n + 1 if singular >= 0 else n
        answer = answers[seed]
        count = _misses(word, answer, start, goal, 0, states, series, misses)
        cost = 0.0
        for i in range(count):
            cost += misses[i] ** 2
        damping = 1e-3
        fresh = True
        for iteration in range(iterations):
            if iteration == PATIENCE and cost > HOPELESS:
                break
            if fresh:
                for k in range(free):
                    tried[: n + 1] = answer[: n + 1]
                    tried[k] += 1e-7
                    first = k if k < n else singular
                    tried_states[: first + 1] = states[: first + 1]
                    _misses(word, tried, start, goal, first, tried_states, series, tried_misses)
                    for i in range(count):
                        slopes[i, k] = (tried_misses[i] - misses[i]) * 1e7
                for k in range(free):
                    gradient[k] = 0.0
                    for i in range(count):
                        gradient[k] -= slopes[i, k] * misses[i]
                    for j in range(free):
                        normal[k, j] = 0.0
                        for i in range(count):
                            normal[k, j] += slopes[i, k] * slopes[i, j]
            for k in range(free):
                step[k] = gradient[k]
                for j in range(free):
                    matrix[k, j] = normal[k, j]
                matrix[k, k] += damping * (1e-6 + normal[k, k])
            if not _solve(matrix, step, free):
                break
            largest = 0.0
            for k in range(free):
                largest = max(largest, abs(step[k]))
            shrink = min(1.0, 1.0 / largest) if largest > 0.0 else 1.0
            tried[n] = answer[n]
            for k in range(free):
                tried[k] = answer[k] + shrink * step[k]
                if k < n:
                    # No arc is driven backwards.
                    tried[k] = min(max(tried[k], 0.0), _LONGEST)
                else:
                    tried[k] = min(max(tried[k], -1.0), 1.0)
            _misses(word, tried, start, goal, 0, tried_states, series, tried_misses)
            tried_cost = 0.0
            for i in range(count):
                tried_cost += tried_misses[i] ** 2
            fresh = tried_cost < cost
            if fresh:
                settled = cost < 1e-24
                answer[: n + 1] = tried[: n + 1]
                states[: n + 1] = tried_states[: n + 1]
                misses[:count] = tried_misses[:count]
                cost = tried_cost
                damping = max(damping * 0.1, 1e-14)
                if settled:
                    break
            else:
                if cost < 1e-22:
                    break
                damping = max(damping * 8.0, 1e-8)
                if damping > 1e8:
                    break
        errors[seed] = 0.0
        for i in range(count):
            errors[seed] = max(errors[seed], abs(misses[i]))
    return answers, errors
