"""The thesis's own scheme: a time to go is the plain mean of the nodes around a foot point.

Such a mean sees the signs of the velocities and nothing else of them, so that its table is not the
time to go, and does not approach it as the grid is refined: it is here to compare with.

Source: Zhang 2014, (3.15)-(3.17) and Table 3.1.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from time import perf_counter

import numpy as np

from ...compiled import compiled
from ...errors import InvalidInput, require, require_positive
from ..arc_words.words import normalised
from ..goal import Goal, checked_start
from ..plan import Plan, TrailerPath
from ..trailer import Trailer, trailer_rates
from ..value_function.grid import THESIS_STEP, StateGrid
from ..value_function.policy import drive, inside
from ..value_function.solve import Progress, open_field_table, widened
from ..value_function.sweeps import FAR, LIMIT
from ..value_function.value_function import ValueFunction

SCHEME = "averaging"
# Table 3.1: length of a step [1 / turn rate] and number of turn rates from -1 to 1.
STEP = 0.05
TURN_RATES = 50
# Passes, at most, and the change below which they end [1 / turn rate].
SWEEP_LIMIT = 400
CHANGE = 1e-3


def solve_by_averaging(
    trailer: Trailer,
    goal: Goal,
    grid: StateGrid,
    *,
    step: float = STEP,
    progress: Progress | None = None,
) -> ValueFunction:
    """The table of (3.15), in the open field.

    A foot point is within one cell of its node, which is itself one of the nodes around it: its
    value is solved for, where the thesis iterates. The mean is over the nodes that have a value
    yet; with the others, which are infinite, no value would ever leave the goal.

    Args:
        trailer: The cart, forward only.
        goal: The box; a tolerance below one cell is widened to it, with a warning.
        grid: Where.
        step: Length of a step [1 / turn rate].
        progress: Called after each pass with its number and the largest change [s].

    Raises:
        InvalidInput: The goal is off the grid, the cart may reverse, or the step is not positive.
    """
    require_positive("step", step)
    require(not trailer.reverse, "trailer", "drive forwards only, for this scheme", "reverse")
    started = perf_counter()
    box, warnings = widened(goal, grid)
    signs = _signs(grid, normalised(trailer))
    table = np.full(grid.shape, FAR, dtype=np.float32)
    table[_inside(grid, box)] = 0.0
    sweeps, change = 0, math.inf
    while sweeps < SWEEP_LIMIT and change >= CHANGE:
        # Four orders: upwards or downwards in all directions, and in y alone the other way.
        order = sweeps % 4
        change = float(_pass(table, *signs, np.float32(step), order % 2 == 0, order < 2))
        sweeps += 1
        if progress:
            progress(sweeps, change / trailer.turn_rate)
    times = np.where(table < LIMIT, table, np.float32(np.inf)) / np.float32(trailer.turn_rate)
    note = f"averages of adjacent nodes, steps of {step:g}: not the time to go (3.15)"
    return ValueFunction(
        table=times,
        grid=grid,
        trailer=trailer,
        goal=box,
        scheme=SCHEME,
        sweeps=sweeps,
        residual=change / trailer.turn_rate,
        converged=change < CHANGE,
        wall_time=perf_counter() - started,
        warnings=(*warnings, note),
    )


def _signs(grid: StateGrid, cart: Trailer) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Signs of x' and y' by theta; of theta' and beta' by beta, for each of their combinations.

    Returns:
        Shapes (n_theta,), (n_theta,) and (n_beta, 4, 2); combinations that do not occur are 0, 0.
    """
    _, _, thetas, betas = grid.axes()
    rates = np.linspace(-1.0, 1.0, TURN_RATES)
    x_rate, y_rate, _, _ = trailer_rates(thetas, 0.0, 1.0, 0.0, cart)
    pairs = np.zeros((grid.beta_count, 4, 2), dtype=np.int64)
    for b, beta in enumerate(betas.tolist()):
        *_, beta_rates = trailer_rates(0.0, beta, 1.0, rates, cart)
        found = np.unique(np.stack([_sign(rates), _sign(beta_rates)], axis=1), axis=0)
        pairs[b, : len(found)] = found[:4]
    return _sign(x_rate), _sign(y_rate), pairs


def _sign(values: np.ndarray) -> np.ndarray:
    return np.where(np.abs(values) < 1e-9, 0, np.sign(values)).astype(np.int64)


def _inside(grid: StateGrid, box: Goal) -> np.ndarray:
    """Nodes in a box, shape of the grid."""
    x, y, theta, beta = grid.axes()
    # Rounding must not drop a node on the face of the box.
    wide = replace(box, tolerance=tuple(width + 1e-9 for width in box.tolerance))
    ground = np.zeros((len(y), len(x), 4))
    ground[..., 0], ground[..., 1], ground[..., 2:] = x, y[:, None], box.state[2:]
    angles = np.empty((len(theta), len(beta), 4))
    angles[..., :2], angles[..., 2], angles[..., 3] = box.state[:2], theta[:, None], beta
    return wide.contains(angles)[:, :, None, None] & wide.contains(ground)


@compiled
def _pass(table, x_signs, y_signs, pairs, step, upwards, along):
    """One Gauss-Seidel pass over all nodes; returns the largest change."""
    theta_count, beta_count, y_count, x_count = table.shape
    change = np.float32(0.0)
    for tt in range(theta_count):
        t = tt if upwards else theta_count - 1 - tt
        sx, sy = x_signs[t], y_signs[t]
        for bb in range(beta_count):
            b = bb if upwards else beta_count - 1 - bb
            for jj in range(y_count):
                j = jj if along == upwards else y_count - 1 - jj
                # Foot points on the edge of the grid have nothing beyond it.
                if not 0 <= j + sy < y_count:
                    continue
                for ii in range(x_count):
                    i = ii if upwards else x_count - 1 - ii
                    if not 0 <= i + sx < x_count or table[t, b, j, i] == 0.0:
                        continue
                    best = table[t, b, j, i]
                    for c in range(pairs.shape[1]):
                        turn, fold = pairs[b, c, 0], pairs[b, c, 1]
                        if turn == 0:
                            continue
                        t2 = (t + turn) % theta_count
                        b2 = (b + fold) % beta_count
                        # Where a sign is 0, both ends are one node, which counts twice.
                        total = np.float32(0.0)
                        own, others = 0, 0
                        for p in range(16):
                            tp = t2 if p & 1 else t
                            bp = b2 if p & 2 else b
                            jp = j + sy if p & 4 else j
                            ip = i + sx if p & 8 else i
                            if tp == t and bp == b and jp == j and ip == i:
                                own += 1
                            elif table[tp, bp, jp, ip] < LIMIT:
                                total += table[tp, bp, jp, ip]
                                others += 1
                        if others:
                            value = (total + np.float32(own + others) * step) / np.float32(others)
                            best = min(best, value)
                    if best < LIMIT:
                        gap = table[t, b, j, i] - best
                        change = max(change, gap)
                        table[t, b, j, i] = best
    return change


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
    state = checked_start(trailer, start, goal)
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
