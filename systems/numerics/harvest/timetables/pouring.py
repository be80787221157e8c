"""How a tank empties into a cart that stays beside it, step by step."""

import numpy as np

from ...compiled import compiled


@compiled
def pour(grain, reachable, first, last, load, rate, step):
    """Let a cart stay beside a combine, and pour whenever it is reached.

    Within a step the crop comes in evenly, and an empty tank passes on what is cut.

    Args:
        grain: Cut up to each step, shape (K + 1,) [kg]; none is cut after the last one.
        reachable: Whether a cart is reached in each step, shape (K,); after the last one it is.
        first: Step with which the cart's stay begins.
        last: Step before which it ends, or -1: as soon as the tank is empty.
        load: Of the tank at first [kg].
        rate: Of the auger [kg/s].
        step: Of time [s].

    Returns:
        Step before which the tank was empty first (-1: not in that time), and the loads before
        each step of the stay and after it.
    """
    count = len(reachable)
    longest = last - first
    if last < 0:
        rest = load + grain[-1] - grain[min(first, count)]
        longest = max(count - first, 0) + int(rest / (rate * step)) + 2
    loads = np.empty(max(longest, 0) + 1)
    loads[0] = load
    emptied = first if load <= 0.0 else -1
    used = 0
    for used in range(len(loads) - 1):
        k = first + used
        if last < 0 and emptied >= 0:
            return emptied, loads[: used + 1]
        more = grain[k + 1] - grain[k] if k < count else 0.0
        after = loads[used] + more
        if k >= count or reachable[k]:
            after = max(after - rate * step, 0.0)
        loads[used + 1] = after
        if after <= 0.0 and emptied < 0:
            emptied = k + 1
    return emptied, loads
