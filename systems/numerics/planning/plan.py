"""What a planner returns: a path with its controls, from which the path follows."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ..errors import require, require_positive, require_type
from .goal import Goal
from .trailer import Trailer, held_states, trailer_rates


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

    @property
    def widest_angle(self) -> float:
        """The trailer's largest angle to either side, from the start on without wrapping [rad].

        A trailer that turns right round within it, between two samples perhaps, is at more than pi.
        """
        turns = math.tau * round(float(self.states[0, 3]) / math.tau)
        return float(np.abs(self.states[:, 3] - turns).max())


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


def motion_step(state: np.ndarray, control: np.ndarray, duration: float, trailer: Trailer):
    """State after a control held for a short while, by one Runge-Kutta step of order 4.

    Args:
        state: x, y, theta, beta, shape (4,) [m], [m], [rad], [rad].
        control: v, omega, shape (2,) [m/s], [rad/s].
        duration: [s].
        trailer: Parameters.

    Returns:
        Shape (4,); angles are not wrapped.
    """

    def rates(at):
        return np.array(trailer_rates(at[2], at[3], control[0], control[1], trailer))

    first = rates(state)
    second = rates(state + duration / 2 * first)
    third = rates(state + duration / 2 * second)
    fourth = rates(state + duration * third)
    return state + duration / 6 * (first + 2 * second + 2 * third + fourth)


def driven_path(
    trailer: Trailer,
    start: Sequence[float],
    pieces: Sequence[tuple[float, float, float]],
    step: float = 0.05,
) -> TrailerPath:
    """The path of pieces of constant control.

    Args:
        trailer: Parameters; the bounds of the controls are not looked at.
        start: x, y, theta, beta [m], [m], [rad], [rad].
        pieces: v, omega and how long they are held [m/s], [rad/s], [s]; at least one, and all
            durations positive.
        step: Longest time between two samples [s].

    Raises:
        InvalidInput: There are no pieces, a duration or the step is not positive.
    """
    require(len(pieces) > 0, "pieces", "not be empty", pieces)
    require_positive("step", step)
    times, states, controls = [0.0], [np.array(start, dtype=float)], []
    for v, omega, duration in pieces:
        require_positive("duration", float(duration))
        control, begin = np.array([v, omega], dtype=float), times[-1]
        count = max(1, int(np.ceil(duration / step - 1e-9)))
        for k in range(1, count + 1):
            states.append(motion_step(states[-1], control, duration / count, trailer))
            times.append(begin + duration * k / count)
            controls.append(control)
    return TrailerPath(np.array(times), np.array(states), np.array(controls))


def refined_path(path: TrailerPath, trailer: Trailer, step: float) -> TrailerPath:
    """The same path with samples along its arcs, at most a step apart; its own samples stay.

    Args:
        path: At least two samples at increasing times.
        trailer: Parameters.
        step: [s].

    Raises:
        InvalidInput: The path is not such a path or the step is not positive.
    """
    require_path(path)
    require_positive("step", step)
    times, states, controls = [path.times[:1]], [path.states[:1]], []
    for k, control in enumerate(path.controls):
        duration = float(path.times[k + 1] - path.times[k])
        count = max(1, math.ceil(duration / step - 1e-9))
        between = held_states(trailer, path.states[k], control, duration, count)[:-1]
        times += [path.times[k] + duration / count * np.arange(1, count), path.times[k + 1 : k + 2]]
        states += [between, path.states[k + 1 : k + 2]]
        controls.append(np.tile(control, (count, 1)))
    return TrailerPath(np.concatenate(times), np.concatenate(states), np.concatenate(controls))


def require_path(path: TrailerPath) -> None:
    """Refuse what is no path, has other shapes than it should have, or numbers not finite."""
    require_type("path", path, TrailerPath)
    count = len(path.times)
    shapes = (np.shape(path.times), np.shape(path.states), np.shape(path.controls))
    wanted = ((count,), (count, 4), (count - 1, 2))
    require(count >= 2 and shapes == wanted, "path", "have shapes (n,), (n, 4), (n - 1, 2)", shapes)
    for values in (path.times, path.states, path.controls):
        require(bool(np.isfinite(values).all()), "path", "be finite", values)
    require(bool((np.diff(path.times) > 0).all()), "path", "have increasing times", path.times)
