"""Keeping a disturbed cart on a planned path.

A target runs along the path, and waits or hurries so that it stays beside the cart; the cart keeps
the path's speed and corrects its turn rate. With the error (e_x ahead, e_y to the left, e_theta,
e_beta) of the cart in the target's frame, omega = omega_r + u and the target's rate 1 + w, the
errors obey, to first order,

    e_x' = omega_r e_y - v_r w,    e_y' = v_r e_theta - omega_r e_x,
    e_theta' = u - omega_r w,      e_beta' = a e_beta + b u - beta_r' w,

with a and b the slopes of beta' in beta and omega; (u, w) = -K (e_x, e_y, e_theta, e_beta) is the
linear-quadratic regulator of this system along the path. A path that turns at the bound leaves the
cart no turn rate to correct with to that side: it then comes back where the path eases.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from ..errors import require
from .plan import TrailerPath, motion_step, refined_path
from .trailer import Trailer, trailer_rates

# How much the errors at the path's end weigh, against a second of them on the way.
END_WEIGHT = 10.0
# Times of the trailer's length / speed between two gains.
STEP = 0.05
FASTEST_TARGET = 2.0


@dataclass(frozen=True, eq=False)
class PathTracker:
    """A path with the gains that hold a cart to it.

    Attributes:
        trailer: Parameters.
        path: Sampled as densely as the gains.
        gains: K from each time to the next, shape (n - 1, 2, 4).
    """

    trailer: Trailer
    path: TrailerPath
    gains: np.ndarray

    @property
    def duration(self) -> float:
        """Of the path [s]."""
        return float(self.path.times[-1])


def make_path_tracker(
    trailer: Trailer,
    path: TrailerPath,
    weights: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0),
) -> PathTracker:
    """Compute the gains for a path.

    Args:
        trailer: Parameters.
        path: At least two samples; forwards, backwards or both.
        weights: Of squared errors ahead, to the left (in trailer lengths), in theta and in beta
            (in radians), against the square of turn rate / turn-rate bound.

    Raises:
        InvalidInput: The path is none or a weight is not positive.
    """
    for weight in weights:
        require(weight > 0, "weights", "be positive", weights)
    path = refined_path(path, trailer, STEP * trailer.length / trailer.speed)
    scales = np.array([trailer.length, trailer.length, 1.0, 1.0])
    state_cost = np.diag(np.array(weights) / scales**2)
    control_cost = np.diag([1 / trailer.turn_rate**2, 1.0])
    gains = np.empty((len(path.controls), 2, 4))
    value = END_WEIGHT * state_cost
    for k in range(len(gains) - 1, -1, -1):
        step = path.times[k + 1] - path.times[k]
        middle = (path.states[k] + path.states[k + 1]) / 2
        a, b = _held(*_error_system(middle, path.controls[k], trailer), step)
        cross = b.T @ value @ a
        gains[k] = np.linalg.solve(control_cost * step + b.T @ value @ b, cross)
        value = state_cost * step + a.T @ value @ a - cross.T @ gains[k]
        value = (value + value.T) / 2
    return PathTracker(trailer, path, gains)


def tracking_control(
    tracker: PathTracker, state: np.ndarray, progress: float
) -> tuple[np.ndarray, float]:
    """What the cart and the target are to do; beyond the path's end both stand still.

    Args:
        tracker: Path and gains.
        state: x, y, theta, beta of the cart, shape (4,) [m], [m], [rad], [rad].
        progress: The target's time along the path [s].

    Returns:
        v, omega within the turn-rate bound, shape (2,) [m/s], [rad/s]; and the rate of the
        progress, in [0, 2].
    """
    path, trailer = tracker.path, tracker.trailer
    if progress >= tracker.duration:
        return np.zeros(2), 0.0
    k = max(int(np.searchsorted(path.times, progress, side="right")) - 1, 0)
    planned = path.controls[k]
    target = motion_step(path.states[k], planned, progress - path.times[k], trailer)
    correction, hurry = -tracker.gains[k] @ tracking_error(state, target)
    omega = np.clip(planned[1] + correction, -trailer.turn_rate, trailer.turn_rate)
    rate = float(np.clip(1 + hurry, 0.0, FASTEST_TARGET))
    return np.array([planned[0], omega]), rate


def tracking_error(state: np.ndarray, target: np.ndarray) -> np.ndarray:
    """A state as seen from another: ahead, to the left [m], theta and beta [rad], shape (4,)."""
    dx, dy, theta, beta = np.asarray(state, dtype=float) - target
    c, s = math.cos(target[2]), math.sin(target[2])
    theta, beta = math.remainder(theta, math.tau), math.remainder(beta, math.tau)
    return np.array([c * dx + s * dy, c * dy - s * dx, theta, beta])


def _error_system(state, control, trailer: Trailer):
    """Matrices of the first-order system above, shape (4, 4) and (4, 2)."""
    (v, omega), theta, beta = control, state[2], state[3]
    beta_rate = trailer_rates(theta, beta, v, omega, trailer)[3]
    # Slopes from the equations themselves: a complex step is exact to rounding.
    tiny = 1e-30
    in_beta = trailer_rates(theta, beta + 1j * tiny, v, omega, trailer)[3].imag / tiny
    in_omega = trailer_rates(theta, beta, v, omega + 1j * tiny, trailer)[3].imag / tiny
    a = np.array([[0, omega, 0, 0], [-omega, 0, v, 0], [0, 0, 0, 0], [0, 0, 0, in_beta]])
    b = np.array([[0, -v], [0, 0], [1, -omega], [in_omega, -beta_rate]])
    return a, b


def _held(a, b, step: float):
    """The system over a step with its controls held."""
    whole = np.zeros((6, 6))
    whole[:4, :4], whole[:4, 4:] = a * step, b * step
    whole = expm(whole)
    return whole[:4, :4], whole[:4, 4:]
