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

from ...compiled import kernel
from .arcs import turned_beta, turning_arc
from .singular import singular_arc

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
