"""Where a control that is held takes the cart, in closed form.

tan(beta / 2) obeys a Riccati equation, so that the pair (sin(beta / 2), cos(beta / 2)) is carried
by a 2 x 2 matrix, but for its length, and the matrices of successive controls multiply. For a turn
of the normalised cart the matrix is (3.28).
"""

import math

import numpy as np

from .trailer import Trailer


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
