"""The order and the directions in which swaths are driven, by annealing."""

import math
from typing import NamedTuple

import numpy as np

from ...compiled import compiled

# Steps of the annealing per swath, and the first and last temperatures [s].
STEPS = 1500
HOT, COLD = 40.0, 0.3


class SwathTimes(NamedTuple):
    """Times between swaths; swath i driven to its second end is node 2 i, back it is 2 i + 1.

    Attributes:
        between: From the end of a node to the beginning of another, shape (2 m, 2 m) [s].
        first: From where the combine comes from, shape (2 m,) [s].
        last: What it costs to end with a node, shape (2 m,) [s].
    """

    between: np.ndarray
    first: np.ndarray
    last: np.ndarray


def order_swaths(times: SwathTimes, fixed: tuple[int, ...], seed: int) -> tuple[list[int], float]:
    """Nodes in the best order found, and the time between swaths in it [s].

    Args:
        times: Of m swaths.
        fixed: Nodes that come first, in this order.
        seed: Of the annealing.
    """
    count = len(times.first) // 2
    if count == 0:
        return [], 0.0
    taken = {node // 2 for node in fixed}
    rest = [2 * i for i in range(count) if i not in taken]
    order = np.array([*fixed, *rest], dtype=np.int64)
    best = np.empty_like(order)
    draws = np.random.default_rng(seed).random((STEPS * count, 5))
    total = _anneal(order, best, len(fixed), *times, draws, HOT, COLD)
    return best.tolist(), float(total)


@compiled
def _total(order, between, first, last):
    total = first[order[0]] + last[order[-1]]
    for k in range(len(order) - 1):
        total += between[order[k], order[k + 1]]
    return total


@compiled
def _anneal(order, best, fixed, between, first, last, draws, hot, cold):
    """Write the best order found into `best`; its time."""
    count, steps = len(order), len(draws)
    now = _total(order, between, first, last)
    best[:] = order
    least = now
    trial = order.copy()
    free = count - fixed
    if free < 1:
        return least
    for step in range(steps):
        heat = hot * (cold / hot) ** (step / steps)
        trial[:] = order
        kind, flip = int(4 * draws[step, 0]), int(2 * draws[step, 3])
        i = fixed + int(free * draws[step, 1])
        j = fixed + int(free * draws[step, 2])
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
        time = _total(trial, between, first, last)
        if time <= now or draws[step, 4] < math.exp((now - time) / heat):
            order[:] = trial
            now = time
            if now < least:
                least = now
                best[:] = order
    return least
