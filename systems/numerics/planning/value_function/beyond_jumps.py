"""The time to go where it jumps within a cell: from feet ahead, where it does not.

Across a jump any interpolation is between two times neither of which is meant. A long step leads
out of the cell, mostly to where the time to go is smooth; the best of such steps is a sharper
answer, and never mixes what is on either side.
"""

import math

import numpy as np

from ..arc_words.held_controls import (
    control_set,
    half_angle_map,
    half_angles,
    normalised,
    shift_of,
)
from ..arc_words.quickest import quickest_word
from ..goal import Goal
from ..trailer import Trailer
from .grid import StateGrid
from .lookup import look_up

# Spread of the nodes of a cell that is a jump [1 / turn rate].
JUMP = 1.5
# How far ahead feet are looked for [1 / turn rate].
AHEAD = 3.2


def look_beyond_jumps(
    table: np.ndarray, grid: StateGrid, trailer: Trailer, goal: Goal, states: np.ndarray
) -> np.ndarray:
    """Interpolated times, and beyond jumps the least of long steps to smooth cells and words.

    Turns end on theta nodes, so that there is one direction less to interpolate. Where no foot is
    in a smooth cell, the interpolated time stays, unless a word into the goal takes less. Words
    cost some milliseconds for each state beside a jump.

    Args:
        table, grid: Of an open field, shape (theta, beta, y, x) [s].
        trailer: Whose time it is.
        goal: The box, in the table's frame.
        states: In the table's frame, shape (n, 4).

    Returns:
        Shape (n,) [s].
    """
    times, spreads = look_up(table, grid, states)
    jump = JUMP / trailer.turn_rate
    at = np.flatnonzero((spreads > jump) & np.isfinite(times))
    if not len(at):
        return times
    feet, durations = _feet(grid, trailer, states[at])
    ahead, around = look_up(table, grid, np.ascontiguousarray(feet.reshape(-1, 4)))
    totals = ahead.reshape(durations.shape) + durations
    totals[around.reshape(durations.shape) > jump] = np.inf
    best = totals.min(axis=1)
    words = [quickest_word(trailer, state, goal) for state in states[at]]
    entries = np.array([math.inf if word is None else word.time for word in words])
    times[at] = np.minimum(np.where(np.isfinite(best), best, times[at]), entries)
    return times


def _feet(grid: StateGrid, trailer: Trailer, states: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Ends of long steps, shape (n, m, 4), and their durations, shape (n, m) [s]."""
    cart = normalised(trailer)
    radius = trailer.speed / trailer.turn_rate
    x, y, theta, beta = states.T[:, :, None]
    past = np.remainder(theta / grid.theta_step, 1.0)
    steps = np.arange(math.ceil(AHEAD / grid.theta_step))
    feet, durations = [], []
    for v, omega in control_set(cart):
        first = 0.5 if omega == 0 else 1.0 - past if omega > 0 else past
        times = (first + steps + np.zeros_like(past)) * grid.theta_step
        dx, dy = shift_of(theta, v, omega, times)
        s, c = np.moveaxis(half_angles(beta), -1, 0)
        maps = half_angle_map(cart, v, omega, times)
        s, c = maps[..., 0, 0] * s + maps[..., 0, 1] * c, maps[..., 1, 0] * s + maps[..., 1, 1] * c
        ends = (x + radius * dx, y + radius * dy, theta + omega * times, 2 * np.arctan2(s, c))
        feet.append(np.stack(np.broadcast_arrays(*ends), axis=-1))
        durations.append(times / trailer.turn_rate)
    return np.concatenate(feet, axis=1), np.concatenate(durations, axis=1)
