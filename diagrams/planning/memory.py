"""How much memory a table may take."""

import os

from ...systems.numerics.planning.value_function.grid import StateGrid

# Of a solution of the value function, for each node: the table, bounds and what passes keep.
BYTES_PER_NODE = 24
# Among walls, for each node of x and y besides: free room by heading on a finer raster.
_BYTES_OF_WALLS = 2 * 8 * 4 * 4
# Where a system does not say how much it has [bytes].
_UNKNOWN = 8e9


def quarter_of_memory() -> float:
    """A quarter of the machine's memory [bytes]."""
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 4
    except (AttributeError, OSError, ValueError):
        return _UNKNOWN / 4


def memory_of(grid: StateGrid, walled: bool) -> float:
    """What solving on a grid takes [bytes].

    Args:
        grid: Whose nodes.
        walled: Whether there are obstacles.
    """
    theta, beta, y, x = grid.shape
    walls = theta * y * x * _BYTES_OF_WALLS if walled else 0.0
    return float(theta) * beta * y * x * BYTES_PER_NODE + walls
