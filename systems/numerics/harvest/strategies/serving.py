"""What a cart is told: a combine to be beside, a truck to go to, or nothing; and how it decides."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..machines.filling import BLOCKED, DONE, FULL
from ..schedule.timetable import Visit

# Tasks beside the numbers of combines.
STAY, TRUCK = -1, -2

# Of a tank: less counts as empty; and a cart with less room as full.
EMPTY = 1e-6
# Columns of what a cart remembers: its task; how many visits it has made; whether it has emptied
# the tank of this one.
TASK, VISIT, EMPTIED = range(3)
MEMORY = 3


class Sight(NamedTuple):
    """What a dispatcher sees.

    Attributes:
        time: [s].
        tanks: Load of each combine, shape (N,) [kg].
        modes: Of each combine, shape (N,).
        alongside: Cart that each combine pours into, or -1, shape (N,).
        loads: Of each cart, shape (K,) [kg].
        room: In each cart, shape (K,) [kg].
    """

    time: float
    tanks: np.ndarray
    modes: np.ndarray
    alongside: np.ndarray
    loads: np.ndarray
    room: np.ndarray


def visit_rows(visits: Sequence[Visit]) -> np.ndarray:
    """Visits as combine, start of unloading, leave, by truck; shape (V, 4)."""
    rows = [(v.combine, v.start_unloading, v.leave, float(v.by_truck)) for v in visits]
    return np.array(rows, dtype=float).reshape(-1, 4)


def next_in_turn(
    cart: int, memory: np.ndarray, rows: np.ndarray, sight: Sight, capacity: float
) -> np.ndarray:
    """What a cart remembers next under the sequential strategy (Zhang 2014, 3.4).

    It serves one combine after another as its timetable says. It leaves a combine when the tank
    is empty and the timetable lets it go, or when its own room is used up; it passes by one that
    has finished and is empty. After the last visit of the timetable it goes on in the same order.

    Args:
        cart: Its number.
        memory: TASK, VISIT, EMPTIED, shape (3,).
        rows: Its visits, shape (n, columns).
        sight: What there is to see.
        capacity: Of a tank [kg].
    """
    after = memory.copy()
    if len(rows) == 0:
        after[TASK] = STAY
        return after
    mine = sorted({int(n) for n in rows[:, 0]})
    if memory[TASK] == TRUCK:
        if sight.loads[cart] > 0.0:
            return after
        after[TASK] = STAY
    if memory[TASK] >= 0:
        n = int(memory[TASK])
        row = rows[int(memory[VISIT]) % len(rows)]
        planned = memory[VISIT] < len(rows)
        done = sight.modes[n] == DONE
        empty = sight.tanks[n] <= EMPTY * capacity
        if empty and (sight.alongside[n] == cart or done):
            after[EMPTIED] = 1.0
        full = sight.room[cart] <= EMPTY * capacity
        behind = not planned or sight.time > row[2]
        other = _instead_of_waiting(n, mine, sight, cart, capacity) if behind else -1
        if other >= 0:
            after[VISIT] += next(
                k for k in range(len(rows)) if rows[int(after[VISIT] + k) % len(rows), 0] == other
            )
            after[TASK], after[EMPTIED] = other, 0.0
            return after
        leaves = after[EMPTIED] > 0 and (done or not planned or sight.time >= row[2])
        if not (leaves or full):
            return after
        after[EMPTIED] = 0.0
        if leaves:
            after[VISIT] += 1
        if (full or row[3] > 0) and sight.loads[cart] > 0.0:
            after[TASK] = TRUCK
            return after
        after[TASK] = STAY
    # Choose the next one that still has, or will have, something to give.
    for ahead in range(len(rows)):
        n = int(rows[int(after[VISIT] + ahead) % len(rows), 0])
        if sight.modes[n] != DONE or sight.tanks[n] > EMPTY * capacity:
            after[VISIT] += ahead
            after[TASK] = n
            return after
    finished = all(sight.modes[n] == DONE for n in mine)
    after[TASK] = TRUCK if finished and sight.loads[cart] > 0.0 else STAY
    return after


def _instead_of_waiting(
    combine: int, mine: list[int], sight: Sight, cart: int, capacity: float
) -> int:
    """Whom to serve instead of a combine that waits for others and is not being emptied.

    The fullest one from half a tank on: the others may be waiting for a cart. -1: nobody.
    """
    if sight.modes[combine] != BLOCKED or sight.alongside[combine] == cart:
        return -1
    tanks = [(float(sight.tanks[n]), n) for n in mine if n != combine]
    load, fullest = max(tanks, default=(0.0, -1))
    return fullest if load >= 0.5 * capacity else -1


def may_start(memory: np.ndarray, rows: np.ndarray, modes: np.ndarray, time: float) -> bool:
    """Whether a cart may empty the combine it is sent to.

    By its timetable, or at once when that one stands full or has finished.

    Args:
        memory: TASK, VISIT, EMPTIED, shape (3,).
        rows: Its visits, shape (n, columns).
        modes: Of the combines, shape (N,).
        time: Now [s].
    """
    n = int(memory[TASK])
    if n < 0:
        return False
    if memory[VISIT] >= len(rows) or modes[n] in (FULL, DONE):
        return True
    return bool(time >= rows[int(memory[VISIT]), 1])


def most_urgent(
    cart: int,
    memory: np.ndarray,
    others: Sequence[int],
    sight: Sight,
    capacity: float,
    threshold: float,
) -> np.ndarray:
    """What a cart remembers next under the on-demand strategy: it goes where a tank is fullest.

    Args:
        cart: Its number.
        memory: TASK, VISIT, EMPTIED, shape (3,).
        others: Tasks of the other carts.
        sight: What there is to see.
        capacity: Of a tank [kg].
        threshold: Part of a tank from which on a combine calls.
    """
    after = memory.copy()
    if memory[TASK] == TRUCK:
        if sight.loads[cart] > 0.0:
            return after
        after[TASK] = STAY
    if memory[TASK] >= 0:
        n = int(memory[TASK])
        empty = sight.tanks[n] <= EMPTY * capacity
        emptied = empty and (sight.alongside[n] == cart or sight.modes[n] == DONE)
        if not emptied and sight.room[cart] > EMPTY * capacity:
            return after
        after[VISIT] += 1
        after[TASK] = STAY
    calls = np.where(sight.modes == DONE, sight.tanks > EMPTY * capacity, False)
    calls = calls | (sight.tanks >= threshold * capacity)
    for n in others:
        if n >= 0:
            calls[n] = False
    finished = bool((sight.modes == DONE).all())
    if sight.loads[cart] > 0.0 and (sight.room[cart] < capacity or (finished and not calls.any())):
        after[TASK] = TRUCK
    elif calls.any():
        after[TASK] = int(np.argmax(np.where(calls, sight.tanks, -1.0)))
    return after
