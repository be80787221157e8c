"""The order and the directions in which swaths are driven, by annealing.

A cart drives on the left of a combine, on ground that is cut. So a swath is driven with crop on its
left only where the way that this saves is worth it.
"""

import math
from typing import NamedTuple

import numpy as np

from ...compiled import compiled, kernel

# Steps of the annealing per swath, and the first and last temperatures [s].
STEPS = 1500
HOT, COLD = 40.0, 0.3

# In place of the swath on the left: no crop, or crop that none of these swaths cuts.
OPEN, STANDS = -1, -2


class SwathTimes(NamedTuple):
    """Times between swaths; swath i driven to its second end is node 2 i, back it is 2 i + 1.

    Attributes:
        between: From the end of a node to the beginning of another, shape (2 m, 2 m) [s].
        first: From where the combine comes from, shape (2 m,) [s].
        last: What it costs to end with a node, shape (2 m,) [s].
        left: Number of the swath on the left of who drives a node, OPEN or STANDS, shape (2 m,).
        closed: What it costs to drive a node while crop stands on its left, shape (2 m,) [s].
    """

    between: np.ndarray
    first: np.ndarray
    last: np.ndarray
    left: np.ndarray
    closed: np.ndarray


def order_swaths(times: SwathTimes, seed: int) -> tuple[list[int], float]:
    """Nodes in the best order found, and what it costs: time between swaths and of closed ones [s].

    Args:
        times: Of m swaths.
        seed: Of the annealing.
    """
    count = len(times.first) // 2
    if count == 0:
        return [], 0.0
    order = 2 * np.arange(count)
    best = np.empty_like(order)
    draws = np.random.default_rng(seed).random((STEPS * count, 5))
    total = _anneal(order, best, times, draws, HOT, COLD)
    return best.tolist(), float(total)


@kernel
def _total(order, times, done):
    total = times.first[order[0]] + times.last[order[-1]]
    done[:] = False
    for k in range(len(order)):
        node = order[k]
        if k > 0:
            total += times.between[order[k - 1], node]
        left = times.left[node]
        if left == STANDS or (left != OPEN and not done[left]):
            total += times.closed[node]
        done[node // 2] = True
    return total


@compiled
def _anneal(order, best, times, draws, hot, cold):
    """Write the best order found into `best`; what it costs."""
    count, steps = len(order), len(draws)
    done = np.zeros(count, dtype=np.bool_)
    now = _total(order, times, done)
    best[:] = order
    least = now
    trial = order.copy()
    for step in range(steps):
        heat = hot * (cold / hot) ** (step / steps)
        trial[:] = order
        kind, flip = int(4 * draws[step, 0]), int(2 * draws[step, 3])
        i, j = int(count * draws[step, 1]), int(count * draws[step, 2])
        if i > j:
            i, j = j, i
        if kind == 0:
            trial[i] ^= 1
        elif kind == 1:
            # Driven the other way round.
            for k in range(i, j + 1):
                trial[k] = order[i + j - k] ^ 1
        elif kind == 2:
            # One is put elsewhere, turned or not.
            moved = order[i] ^ flip
            for k in range(i, j):
                trial[k] = order[k + 1]
            trial[j] = moved
        else:
            moved = order[j] ^ flip
            for k in range(i, j):
                trial[k + 1] = order[k]
            trial[i] = moved
        time = _total(trial, times, done)
        if time <= now or draws[step, 4] < math.exp((now - time) / heat):
            order[:] = trial
            now = time
            if now < least:
                least = now
                best[:] = order
    return least
