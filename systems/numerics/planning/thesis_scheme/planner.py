"""`plan_by_averaging`: down the thesis's table by the thesis's rule."""

import math
from collections.abc import Sequence
from time import perf_counter

import numpy as np

from ...errors import InvalidInput
from ..goal import Goal
from ..plan import Plan, TrailerPath
from ..trailer import Trailer
from ..value_function.grid import THESIS_STEP
from ..value_function.rollout import drive, inside
from ..value_function.solve import Progress
from ..value_function.tables import open_field_table
from ..value_function.value_function import ValueFunction
from ..vehicle.start import checked_start
from .averaging import solve_by_averaging

METHOD = "averaging"
# Time from one choice of the turn rate to the next, and after which a path is lost
# [1 / turn rate].
CHOICE = 0.02
PATIENCE = 30.0


def plan_by_averaging(
    trailer: Trailer,
    start: Sequence[float],
    goal: Goal,
    *,
    step: float = THESIS_STEP,
    value: ValueFunction | None = None,
    progress: Progress | None = None,
) -> Plan:
    """Solve (3.15), and turn by (3.20), whose values are those of the nearest nodes.

    `time_to_go` in the notes is the table's, which is not the time to go.

    Args:
        trailer: The cart, forward only.
        start: (x, y, theta, beta) [m], [m], [rad], [rad].
        goal: The box, in the open field.
        step: Distance of nodes in turning radii.
        value: A table of `solve_by_averaging`, placed at this goal; by default one that is kept.
        progress: See `solve_by_averaging`.

    Raises:
        InvalidInput: Start, goal or option out of range, or the cart may reverse.
    """
    began = perf_counter()
    state = checked_start(trailer, start)
    if value is None:
        value = open_field_table(trailer, start, goal, step, progress, solve_by_averaging)
    if value is None:
        raise InvalidInput(f"`goal` must be within reach of a table; got {goal.state}")
    promised = _nearest(value, state)
    states, controls = [state], []
    pace = CHOICE / trailer.turn_rate
    arrived = bool(inside(value, state))
    while not arrived and len(controls) * CHOICE < PATIENCE and math.isfinite(promised):
        turn_rate = trailer.turn_rate * _turn(value, states[-1])
        states.append(drive(trailer, states[-1], trailer.speed, turn_rate, pace))
        controls.append((trailer.speed, turn_rate))
        arrived = bool(inside(value, states[-1]))
    times = pace * np.arange(len(states))
    path = TrailerPath(times, np.array(states), np.array(controls).reshape(-1, 2))
    there = arrived and not any(goal.miss(states[-1]))
    words = "arrived" if there else "arrived in a wider box" if arrived else "lost on the way"
    return Plan(
        method=METHOD,
        goal=goal,
        status=words if math.isfinite(promised) else "unreachable",
        converged=there and value.converged,
        time=float(times[-1]) if arrived else math.inf,
        path=path if arrived else None,
        iterations=value.sweeps,
        residual=value.residual,
        wall_time=perf_counter() - began,
        notes={
            "time_to_go": promised,
            "grid": value.grid.shape,
            "tolerance": value.goal.tolerance,
            "warnings": list(value.warnings),
        },
    )


def _nearest(value: ValueFunction, state: np.ndarray) -> float:
    """The value at the nearest node; infinite off the grid."""
    grid = value.grid
    x, y, theta, beta = value.to_table(state)
    i, j = round((x - grid.x_min) / grid.step), round((y - grid.y_min) / grid.step)
    if not (0 <= i < grid.x_count and 0 <= j < grid.y_count):
        return math.inf
    t, b = round(theta / grid.theta_step), round(beta / grid.beta_step)
    return float(value.table[t % grid.theta_count, b % grid.beta_count, j, i])


def _turn(value: ValueFunction, state: np.ndarray) -> float:
    """Minus the sign of du/dtheta + du/dbeta (3.20), by a central difference."""
    away = np.array([0.0, 0.0, value.grid.theta_step, value.grid.beta_step])
    ahead, behind = _nearest(value, state + away), _nearest(value, state - away)
    if ahead == behind:
        return 0.0
    return -1.0 if ahead > behind else 1.0
