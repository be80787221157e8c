"""`plan_by_value_function`: solve or reuse a table, then drive down it."""

import math
from collections.abc import Sequence
from dataclasses import replace
from time import perf_counter

from ...errors import require
from ...geometry.world import World
from ..among_walls.planner import METHOD, grid_within, plan_from_table
from ..goal import Goal
from ..plan import Plan
from ..trailer import Trailer
from ..value_function.grid import THESIS_STEP, grid_around
from ..value_function.rollout import is_late, roll_out
from ..value_function.solve import Progress, solve_value_function, widened
from ..value_function.value_function import ValueFunction
from ..vehicle.clear import require_clear_ends, walls_part
from ..vehicle.footprint import Discs, covering_discs
from ..vehicle.start import checked_start


def plan_by_value_function(
    trailer: Trailer,
    start: Sequence[float],
    goal: Goal,
    *,
    step: float = THESIS_STEP,
    polish: int | None = None,
    value: ValueFunction | None = None,
    progress: Progress | None = None,
    obstacles: World | None = None,
    discs: Discs | None = None,
) -> Plan:
    """Solve for the time to go, and drive down it by the policy of the table.

    The path is what was driven, and `time` is how long that took; the notes hold the
    `value_function`, its `time_to_go`, and `warnings`, for example of a tolerance that the grid
    cannot resolve. Then the plan is not converged: it is for a wider box.

    Args:
        trailer: The cart.
        start: (x, y, theta, beta) [m], [m], [rad], [rad].
        goal: The box. With a table that was solved for a goal elsewhere, the box turns with the
            goal's heading.
        step: Distance of nodes in turning radii: 0.2 is the thesis's grid.
        polish: See `solve_value_function`.
        value: A table to reuse, of the same cart and for a goal of the same beta and tolerance.
        progress: See `solve_value_function`.
        obstacles: Walls to keep clear of, on a grid over all of that world; see `plan_from_table`
            for the path and the notes. A table to reuse takes no walls.
        discs: What the cart covers; by default `covering_discs(trailer)`.

    Raises:
        InvalidInput: Start, goal or option out of range, an end in a wall, or the table is for
            something else.
    """
    began = perf_counter()
    start = checked_start(trailer, start).tolist()
    if obstacles is not None:
        body = discs or covering_discs(trailer)
        require(value is None, "value", "be left out among obstacles", "a table")
        require_clear_ends(obstacles, body, start, goal)
        if walls_part(obstacles, body, start, goal):
            return Plan(method=METHOD, goal=goal, status="unreachable", converged=False)
        value = solve_value_function(
            trailer,
            goal,
            grid_within(obstacles, trailer, goal, step),
            polish=polish,
            progress=progress,
            obstacles=obstacles,
            discs=body,
        )
        plan = plan_from_table(value, start, goal, obstacles, body)
        return replace(plan, wall_time=perf_counter() - began)
    if value is None:
        grid = grid_around(trailer, start, goal, step)
        value = solve_value_function(trailer, goal, grid, polish=polish, progress=progress)
    else:
        require(value.trailer == trailer, "value", "be for the same trailer", value.trailer)
        # A table for a box that its grid cannot resolve is for a wider one.
        wide, _ = widened(replace(value.goal, tolerance=goal.tolerance), value.grid)
        same = value.goal.tolerance == wide.tolerance and value.goal.state[3] == goal.state[3]
        require(same, "value", "be for the same beta and tolerance", value.goal)
        value = value.moved(*goal.state[:3])
    driven = roll_out(value, start)
    path = driven.path if driven.arrived else None
    time = float(path.times[-1]) if path is not None else math.inf
    late = is_late(value, driven.promised, time)
    notes: dict[str, object] = {
        "value_function": value,
        "time_to_go": driven.promised,
        "sweeps": value.sweeps,
        "scheme": value.scheme,
        "grid": value.grid.shape,
        "tolerance": value.goal.tolerance,
        "warnings": list(value.warnings),
    }
    if math.isinf(driven.promised):
        status = "unreachable on this grid"
    elif path is None:
        status = "lost on the way"
    elif late:
        status = "arrived later than promised"
    else:
        status = "arrived in a wider box" if value.warnings else "arrived"
    return Plan(
        method=METHOD,
        goal=goal,
        status=status,
        # The table only chooses the word: what is promised is a path into the goal.
        converged=path is not None and not late and not value.warnings,
        time=time,
        path=path,
        iterations=value.sweeps,
        residual=value.residual,
        wall_time=perf_counter() - began,
        notes=notes,
    )
