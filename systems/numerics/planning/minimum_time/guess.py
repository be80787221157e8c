"""Where the solver starts: a path resampled at the nodes of a programme."""

from dataclasses import dataclass

import numpy as np

from ..goal import Goal
from ..plan import TrailerPath

# The sign of a control that is not held at a bound.
FREE = 0


@dataclass(frozen=True, eq=False)
class Guess:
    """A path whose intervals are grouped into arcs.

    Attributes:
        states: At the nodes, shape (n + 1, 4) [m], [m], [rad], [rad].
        controls: In the intervals, shape (n, 2) [m/s], [rad/s].
        durations: Of the arcs, each with equally many intervals, shape (k,) [s].
        signs: 1 or -1 for a control that is held at a bound, or FREE, shape (n, 2).
    """

    states: np.ndarray
    controls: np.ndarray
    durations: np.ndarray
    signs: np.ndarray


def resampled(path: TrailerPath, intervals: int) -> Guess:
    """One arc of intervals of equal duration: states interpolated, controls averaged."""
    times = np.linspace(path.times[0], path.times[-1], intervals + 1)
    # Averages are differences of the integral, which is piecewise linear.
    steps = np.diff(path.times)[:, None]
    integral = np.vstack([np.zeros((1, 2)), np.cumsum(path.controls * steps, axis=0)])
    duration = float(times[-1] - times[0])
    return Guess(
        columns_at(times, path.times, path.states),
        np.diff(columns_at(times, path.times, integral), axis=0) / max(duration / intervals, 1e-12),
        np.array([duration]),
        np.full((intervals, 2), FREE),
    )


def columns_at(times: np.ndarray, known: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Interpolate each column of values, shape (m, k), known at some times, at others."""
    return np.column_stack([np.interp(times, known, column) for column in values.T])


def nearest_goal_state(goal: Goal, state: np.ndarray) -> np.ndarray:
    """The goal's state, its angles turned fully until they are nearest to a state's, shape (4,)."""
    target = np.array(goal.state, dtype=float)
    target[2:] += 2 * np.pi * np.round((state[2:] - target[2:]) / (2 * np.pi))
    return target
