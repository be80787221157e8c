"""Sweeping until nothing changes, in the orders in which news spreads fastest."""

from collections.abc import Callable

import numpy as np


def settle(
    nodes: tuple[np.ndarray, ...],
    due: np.ndarray,
    sweep: Callable[[np.ndarray], int],
    progress: Callable[[float], None] | None,
) -> int:
    """Sweep by rows and by columns, to and fro, until nothing is due; count planes computed.

    Args:
        nodes: Rows and columns of the pursuer's nodes, shape (n,) each.
        due: Which planes have to be computed, shape (n,), bool; kept up to date by the sweeps.
        sweep: Of an order of the nodes, shape (n,); computes what is due and counts it.
        progress: Called now and then with the part of the planes that are settled.
    """
    rows, columns = nodes
    by_rows, by_columns = np.lexsort((columns, rows)), np.lexsort((rows, columns))
    updates = 0
    while True:
        for order in (by_rows, by_rows[::-1].copy(), by_columns, by_columns[::-1].copy()):
            if not due.any():
                return updates
            updates += sweep(order)
            if progress is not None:
                progress(1.0 - float(due.mean()))
