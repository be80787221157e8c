"""What a planner returns: a path with its controls, and what the planner says of it."""

from dataclasses import dataclass, field

import numpy as np

from .goal import Goal


@dataclass(frozen=True, eq=False)
class TrailerPath:
    """States and controls over time.

    Attributes:
        times: Increasing from 0, shape (n,) [s].
        states: x, y, theta, beta, shape (n, 4) [m], [m], [rad], [rad]; angles not wrapped, so that
            they can be interpolated.
        controls: v, omega held from each time to the next, shape (n - 1, 2) [m/s], [rad/s].
    """

    times: np.ndarray
    states: np.ndarray
    controls: np.ndarray


@dataclass(frozen=True, eq=False, kw_only=True)
class Plan:
    """The answer of one planner to one question.

    Attributes:
        method: Its name.
        goal: What was to be reached.
        status: In words: "optimal", "unreachable", "iteration limit", ...
        converged: Whether `time` and `path` mean what the method promises.
        time: Travel time; infinite without a path [s].
        path: The path, or None.
        iterations: Of the solver.
        residual: Its own measure of error, in the units of the state.
        wall_time: How long it took [s].
        notes: What a reader should know: which arcs, where it fell back, ...
    """

    method: str
    goal: Goal
    status: str
    converged: bool
    time: float = float("inf")
    path: TrailerPath | None = None
    iterations: int = 0
    residual: float = 0.0
    wall_time: float = 0.0
    notes: dict[str, object] = field(default_factory=dict)
