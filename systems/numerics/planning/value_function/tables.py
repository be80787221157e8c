"""Tables of the open field, solved once in a process and used for every start and goal."""

import math
from collections.abc import Callable, Sequence

from ..goal import Goal
from ..trailer import Trailer
from .grid import StateGrid, grid_around
from .solve import Progress, solve_value_function
from .value_function import ValueFunction

# How far a start may be from the goal, along each axis of the goal, in turning radii: a table is
# as wide as the least of these that is enough, so that neighbouring starts share one.
# The least makes the thesis's grid.
REACHES = (3.0, 4.5, 6.75, 10.0, 15.0)
# Tables that are kept, the last used ones.
_KEPT = 8

Solver = Callable[..., ValueFunction]

_tables: dict[tuple[Solver, Trailer, Goal, StateGrid], ValueFunction] = {}


def open_field_table(
    trailer: Trailer,
    start: Sequence[float],
    goal: Goal,
    step: float,
    progress: Progress | None = None,
    solve: Solver = solve_value_function,
) -> ValueFunction | None:
    """A table around a goal that holds a start, from those of this process if one fits.

    Args:
        trailer: The cart.
        start: x, y, theta, beta [m], [m], [rad], [rad].
        goal: The box; a tolerance below a cell is widened, with a warning. It turns with its
            heading.
        step: Distance of nodes in turning radii.
        progress: See `solve_value_function`; not called for a table of before.
        solve: What solves for a table.

    Returns:
        The table, placed at the goal; None for a start farther away than any of `REACHES`, or a
        goal that is free in x or y.

    Raises:
        InvalidInput: The step is out of range.
    """
    radius = trailer.speed / trailer.turn_rate
    x, y, heading, beta = goal.state
    dx, dy = start[0] - x, start[1] - y
    c, s = math.cos(heading), math.sin(heading)
    away = abs(c * dx + s * dy) / radius, abs(c * dy - s * dx) / radius
    if max(away) > REACHES[-1] or any(map(math.isinf, goal.tolerance[:2])):
        return None
    width, height = (next(reach for reach in REACHES if reach >= each) for each in away)
    centred = Goal(state=(0.0, 0.0, 0.0, beta), tolerance=goal.tolerance)
    far = (width * radius, height * radius, 0.0, 0.0)
    grid = grid_around(trailer, far, centred, step)
    key = solve, trailer, centred, grid
    table = _tables.pop(key, None)
    if table is None:
        table = solve(trailer, centred, grid, progress=progress)
    _tables[key] = table
    for oldest in list(_tables)[:-_KEPT]:
        del _tables[oldest]
    return table.moved(x, y, heading)
