"""A path from the table: turn the way that the time to go falls.

Source: Zhang 2014, (3.20); the choice by looking ahead, where (3.20) does not help, is ours.
"""

import math
from dataclasses import dataclass

import numpy as np

from ..arc_words.held_controls import control_set, hold_beta, shift_of
from ..plan import TrailerPath
from ..trailer import Trailer
from .value_function import ValueFunction

# Steps of a path in one angle between theta nodes.
STEPS_PER_ANGLE = 8
# How far ahead a choice looks, in angles between theta nodes.
LOOK_AHEAD = (1, 2, 4)
# A path that takes this many times the promised time, and two turns more, is lost.
PATIENCE = 1.5
# One that takes this many times the promised time, and half a radian's turn more, went in a loop:
# greedy paths that do not are at most a quarter longer.
LATE = 1.3
_LATE_TURN = 0.5


@dataclass(frozen=True, eq=False)
class Rollout:
    """A path driven greedily down a value function.

    Attributes:
        path: As far as it went.
        arrived: Whether its end is inside the goal box of the table.
        promised: Time to go at the start by the table; infinite: unreachable [s].
        late: Whether it took so much longer than promised that it must have gone in a loop.
        fallbacks: Times at which the sign in (3.20) was of no use, because the time to go had no
            gradient or would not have fallen, and the control was chosen by looking ahead,
            shape (n,) [s].
    """

    path: TrailerPath
    arrived: bool
    promised: float
    late: bool
    fallbacks: np.ndarray


def bang_bang(value: ValueFunction, state) -> float:
    """Turn rate (3.20): minus the sign of du/dtheta + du/dbeta, by a central difference [rad/s].

    Zero where the two sides are equal, or where neither can be compared.

    Args:
        value: The table.
        state: x, y, theta, beta [m], [m], [rad], [rad].
    """
    step = 0.5 * value.grid.theta_step
    shift = np.array([[0, 0, step, step], [0, 0, -step, -step]])
    ahead, behind = value.interpolated(np.asarray(state, dtype=float) + shift)
    if ahead == behind:
        return 0.0
    return value.trailer.turn_rate * (-1.0 if ahead > behind else 1.0)


def look_ahead(value: ValueFunction, state) -> tuple[float, float]:
    """The control (v, omega) whose long steps promise the least time [m/s], [rad/s].

    Args:
        value: The table.
        state: x, y, theta, beta [m], [m], [rad], [rad].
    """
    trailer = value.trailer
    times = np.array(LOOK_AHEAD) * value.grid.theta_step / trailer.turn_rate
    pairs = control_set(trailer) * [trailer.speed, trailer.turn_rate]
    feet = np.array([[drive(trailer, state, v, w, time) for time in times] for v, w in pairs])
    promised = (value.interpolated(feet) + times).min(axis=1)
    # Straight on, where all are alike.
    order = np.lexsort((np.abs(pairs[:, 1]), promised))
    v, omega = pairs[order[0]]
    return float(v), float(omega)


def drive(trailer: Trailer, state, v: float, omega: float, duration: float) -> np.ndarray:
    """The state after a held control, shape (4,).

    Args:
        trailer: Which drives.
        state: x, y, theta, beta [m], [m], [rad], [rad].
        v, omega: The control [m/s], [rad/s].
        duration: For how long it is held [s].
    """
    x, y, theta, beta = (float(value) for value in state)
    dx, dy = shift_of(theta, v, omega, duration)
    steps = max(1, math.ceil(20 * duration * (trailer.turn_rate + trailer.speed / trailer.length)))
    beta = hold_beta(beta, v, omega, duration, steps, trailer)[-1]
    return np.array([x + dx, y + dy, theta + omega * duration, beta])


def inside(value: ValueFunction, states) -> np.ndarray:
    """Whether states are in the table's goal box, shape (..., 4) -> (...,)."""
    gaps = np.abs(value.to_table(states) - np.array(value.goal.state))
    gaps[..., 2:] = np.abs(np.remainder(gaps[..., 2:] + math.pi, math.tau) - math.pi)
    return np.all(gaps <= value.goal.tolerance, axis=-1)


def is_late(value: ValueFunction, promised: float, time: float) -> bool:
    """Whether a path took so much longer than promised at its start that it went in a loop.

    Args:
        value: The table.
        promised: Time to go at the start [s].
        time: Of the path [s].
    """
    return time > LATE * promised + _LATE_TURN / value.trailer.turn_rate


def roll_out(value: ValueFunction, start) -> Rollout:
    """Drive down the time to go until the box is entered, the time is up, or there is no way on.

    Args:
        value: Whose trailer drives, its control chosen afresh STEPS_PER_ANGLE times in each angle
            between theta nodes: by (3.20), or by looking ahead if it may reverse.
        start: x, y, theta, beta [m], [m], [rad], [rad].
    """
    trailer = value.trailer
    by_sign = not trailer.reverse
    step = value.grid.theta_step / trailer.turn_rate / STEPS_PER_ANGLE
    state = np.array(start, dtype=float)
    promised = float(value.time_to_go(state))
    states, controls, fallbacks = [state], [], []
    to_go = promised
    limit = PATIENCE * promised + 2 * math.tau / trailer.turn_rate
    limit = limit if math.isfinite(promised) else 0.0
    arrived = bool(inside(value, state))
    while not arrived and len(controls) * step < limit and math.isfinite(to_go):
        v, omega = trailer.speed, bang_bang(value, state) if by_sign else 0.0
        ahead = drive(trailer, state, v, omega, step)
        if omega == 0.0 or value.interpolated(ahead) > to_go - 0.5 * step:
            fallbacks.append(len(controls) * step)
            v, omega = look_ahead(value, state)
            ahead = drive(trailer, state, v, omega, step)
        state = ahead
        states.append(state)
        controls.append((v, omega))
        to_go = float(value.interpolated(state))
        # Not by the time to go: between nodes, it is zero a little outside of the box too.
        arrived = bool(inside(value, state))
    path = TrailerPath(
        step * np.arange(len(states)), np.array(states), np.array(controls).reshape(-1, 2)
    )
    late = arrived and is_late(value, promised, float(path.times[-1]))
    return Rollout(path, arrived, promised, late, np.array(fallbacks))
