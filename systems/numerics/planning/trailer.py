"""The tractor-trailer: its parameters, its motion, and where a control that is held takes it.

NumPy arrays, Drake's scalars and CasADi's symbols all go through the equations.

tan(beta / 2) obeys a Riccati equation, so that the pair (sin(beta / 2), cos(beta / 2)) is carried
by a 2 x 2 matrix, but for its length, and the matrices of successive controls multiply. For a turn
of the normalised cart the matrix is (3.28).

Source: Zhang 2014, 3.2.2 and (3.18)-(3.20); the hitch offset is the usual extension.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..checked import Checked, Finite, Positive
from ..errors import require
from ..tracking.mobile_agents import clip_symmetric


@dataclass(frozen=True, kw_only=True)
class Trailer(Checked):
    """A tractor and its trailer.

    The state is (x, y, theta, beta): the tractor's rear axle [m], its heading [rad], and the angle
    from the trailer's heading to the tractor's [rad]. The control is (v, omega): speed [m/s] and
    turn rate [rad/s] of the tractor.

    Raises:
        InvalidInput: A number is out of its range.
    """

    # Speed of the tractor [m/s].
    speed: Positive = 1.0
    # Bound of its turn rate [rad/s].
    turn_rate: Positive = 1.0
    # From the hitch to the trailer's axle [m].
    length: Positive = 1.0
    # From the tractor's rear axle back to the hitch [m].
    hitch_offset: Finite = 0.0
    # Whether it may drive backwards too, at the same speed.
    reverse: bool = False
    # Largest |beta| [rad]; pi: no limit.
    jackknife: float = math.pi

    def __post_init__(self) -> None:
        super().__post_init__()
        require(isinstance(self.reverse, bool), "reverse", "be true or false", self.reverse)
        require(0 < self.jackknife <= math.pi, "jackknife", "lie in (0, pi]", self.jackknife)

    @property
    def radius(self) -> float:
        """Of the tightest turn at full speed [m]."""
        return self.speed / self.turn_rate


# Any: NumPy, Drake and CasADi have no type in common that sine and product take.
def trailer_rates(
    theta: Any, beta: Any, v: Any, omega: Any, trailer: Trailer
) -> tuple[Any, Any, Any, Any]:
    """Rates of x, y, theta and beta; scalars or arrays of any kind that NumPy's sine takes.

    x' = v cos(theta), y' = v sin(theta), theta' = omega,
    beta' = omega - (v sin(beta) - M omega cos(beta)) / L,

    with L the length and M the hitch offset; in the normalised model beta' = omega - v sin(beta),
    which is (3.14).
    """
    pull = (v * np.sin(beta) - trailer.hitch_offset * omega * np.cos(beta)) / trailer.length
    return v * np.cos(theta), v * np.sin(theta), omega, omega - pull


def trailer_pose(x, y, theta, beta, trailer: Trailer):
    """The trailer's axle and heading: x, y [m], [m] and theta - beta [rad].

    Scalars or arrays of any kind that NumPy's sine takes.
    """
    heading = theta - beta
    behind, length = trailer.hitch_offset, trailer.length
    axle_x = x - behind * np.cos(theta) - length * np.cos(heading)
    axle_y = y - behind * np.sin(theta) - length * np.sin(heading)
    return axle_x, axle_y, heading


def clip_control(v, omega, trailer: Trailer):
    """The nearest allowed speed and turn rate; without branches, for scalars of any kind.

    The speed lies in [0, speed], or in [-speed, speed] for a tractor that may reverse; the turn
    rate in [-turn_rate, turn_rate]. Beyond a bound, and on it to one side, the slope is zero.

    Args:
        v: Speed wished for [m/s].
        omega: Turn rate wished for [rad/s].
        trailer: Whose bounds.
    """
    if trailer.reverse:
        allowed_v = clip_symmetric(v, trailer.speed)
    else:
        half = trailer.speed / 2
        allowed_v = half + clip_symmetric(v - half, half)
    return allowed_v, clip_symmetric(omega, trailer.turn_rate)


def control_excess(controls: np.ndarray, trailer: Trailer) -> float:
    """By how much controls leave the bounds at most [m/s or rad/s]; 0 if they do not.

    Args:
        controls: v, omega, shape (n, 2) [m/s], [rad/s].
        trailer: Whose bounds.
    """
    v, omega = clip_control(controls[:, 0], controls[:, 1], trailer)
    gaps = np.abs(controls - np.stack([v, omega], axis=1))
    return float(np.max(gaps, initial=0.0))


def shift_of(theta, v, omega, duration):
    """Shift (dx, dy) of the tractor under held controls (3.26), (3.27); broadcasts.

    Args:
        theta: Heading at the start [rad].
        v, omega: Controls [m/s], [rad/s].
        duration: [s].
    """
    half = omega * duration / 2
    chord = v * duration * np.sinc(half / math.pi)
    return chord * np.cos(theta + half), chord * np.sin(theta + half)


def half_angle_map(trailer: Trailer, v, omega, durations) -> np.ndarray:
    """Matrices that take (sin, cos) of beta / 2 to a multiple of it after held controls.

    Args:
        trailer: Whose equations.
        v, omega: The controls, which broadcast with the durations [m/s], [rad/s].
        durations: Shape (...) [s].

    Returns:
        Shape (..., 2, 2).
    """
    v, omega, durations = np.broadcast_arrays(
        *(np.asarray(a, float) for a in (v, omega, durations))
    )
    hitch = trailer.hitch_offset / trailer.length
    pull = -v / (2 * trailer.length)
    rise, fall = omega * (1 + hitch) / 2, omega * (hitch - 1) / 2
    # The square of the matrix of rates is a multiple of the identity: its exponential has two
    # terms. Where they grow, both are divided by the first, or a short trailer would overflow them.
    square = pull * pull + rise * fall
    root = np.sqrt(np.abs(square))
    phase = root * durations
    slow, grows = phase < 1e-9, square > 0
    even = np.where(grows, 1.0, np.cos(phase))
    odd = np.where(grows, np.tanh(phase), np.sin(phase)) / np.where(slow, 1.0, root)
    odd = np.where(slow, durations, odd)
    rows = [[even + pull * odd, rise * odd], [fall * odd, even - pull * odd]]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def half_angles(betas) -> np.ndarray:
    """Pairs (sin, cos) of beta / 2, shape (...) -> (..., 2)."""
    halves = np.asarray(betas, dtype=float) / 2
    return np.stack([np.sin(halves), np.cos(halves)], axis=-1)


def hold_beta(beta, v, omega, duration, count: int, trailer: Trailer) -> np.ndarray:
    """Beta at equally spaced moments under held controls, unwrapped.

    Args:
        beta, v, omega: Arrays that broadcast [rad], [m/s], [rad/s].
        duration: Until the last moment, one for all or for each [s].
        count: Number of moments after the start; from one to the next beta must change by less
            than half a turn.
        trailer: Whose equations.

    Returns:
        Shape (count + 1, *shape) [rad]; the start first.
    """
    beta, v, omega, duration = np.broadcast_arrays(beta, v, omega, duration)
    parts = np.linspace(0.0, 1.0, count + 1).reshape(-1, *[1] * beta.ndim)
    maps = half_angle_map(trailer, v, omega, parts * duration)
    pairs = np.einsum("...ij,...j->...i", maps, half_angles(beta))
    path = 2 * np.arctan2(pairs[..., 0], pairs[..., 1])
    steps = np.remainder(np.diff(path, axis=0) + math.pi, math.tau) - math.pi
    return np.concatenate([beta[None], beta + np.cumsum(steps, axis=0)])


def held_states(trailer: Trailer, state, control, duration: float, count: int) -> np.ndarray:
    """States at equally spaced moments under a held control, without the first; exact.

    Args:
        trailer: Whose equations.
        state: x, y, theta, beta at the start [m], [m], [rad], [rad].
        control: v, omega [m/s], [rad/s].
        duration: Until the last moment [s].
        count: Number of moments after the start; see `hold_beta`.

    Returns:
        Shape (count, 4); angles are not wrapped.
    """
    (x, y, theta, beta), (v, omega) = state, control
    times = duration / count * np.arange(1, count + 1)
    dx, dy = shift_of(theta, v, omega, times)
    angles = hold_beta(beta, v, omega, duration, count, trailer)[1:]
    return np.column_stack([x + dx, y + dy, theta + omega * times, angles])
