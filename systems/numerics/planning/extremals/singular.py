"""The general singular arc, by Taylor series.

Where the switching function (3.24) vanishes along an arc, its second derivative gives
lambda_beta = -lambda_0 omega, and with lambda_beta' = v lambda_beta cos(beta)

    omega' = v omega cos(beta),    beta' = omega - v sin(beta),

so that omega = v sin(beta) +- sqrt(rho^2 - cos(beta)^2), rho constant, and beta'' =
sin(beta) cos(beta): a pendulum upside down. Straights and merging curves (3.29)-(3.31) have
rho = 1, straights omega = 0. Kept as (beta, omega) the arc passes beta' = 0 without a choice of
sign.
"""

import math

import numpy as np

from ...compiled import compiled, kernel

# Terms of the series; its last ones choose the step, so that what is left out is about this much.
TERMS = 16
_TRUNCATION = 1e-13
_LONGEST_STEP = 2.0


@kernel
def singular_arc(x, y, theta, beta, omega, v, t, series):
    """State after a singular arc.

    Args:
        x: At the start [m].
        y: At the start [m].
        theta: At the start [rad].
        beta: At the start [rad].
        omega: Turn rate at the start, which chooses the arc.
        v: Speed, 1 or -1.
        t: Duration, of any sign.
        series: Scratch, shape (7, TERMS + 1).

    Returns:
        x, y, theta, beta, omega; angles not wrapped.
    """
    left = abs(t)
    sign = 1.0 if t >= 0.0 else -1.0
    while left > 0.0:
        _expand(theta, beta, omega, v, series)
        largest = 1e-300
        for row in range(7):
            for k in range(TERMS - 1, TERMS + 1):
                largest = max(largest, abs(series[row, k]))
        h = min(min(_LONGEST_STEP, (_TRUNCATION / largest) ** (1.0 / TERMS)), left)
        left -= h
        x, y, theta, beta, omega = _sum(x, y, v, sign * h, series)
    return x, y, theta, beta, omega


@kernel
def _expand(theta, beta, omega, v, series):
    # Rows: beta, its sine and cosine, omega, theta, its sine and cosine.
    series[0, 0] = beta
    series[1, 0] = math.sin(beta)
    series[2, 0] = math.cos(beta)
    series[3, 0] = omega
    series[4, 0] = theta
    series[5, 0] = math.sin(theta)
    series[6, 0] = math.cos(theta)
    for k in range(TERMS):
        over = 1.0 / (k + 1)
        series[0, k + 1] = (series[3, k] - v * series[1, k]) * over
        series[4, k + 1] = series[3, k] * over
        sine, cosine, turn, north, east = 0.0, 0.0, 0.0, 0.0, 0.0
        for j in range(k + 1):
            beta_rate = (j + 1) * series[0, j + 1]
            theta_rate = (j + 1) * series[4, j + 1]
            sine += beta_rate * series[2, k - j]
            cosine -= beta_rate * series[1, k - j]
            turn += series[3, j] * series[2, k - j]
            north += theta_rate * series[6, k - j]
            east -= theta_rate * series[5, k - j]
        series[1, k + 1] = sine * over
        series[2, k + 1] = cosine * over
        series[3, k + 1] = v * turn * over
        series[5, k + 1] = north * over
        series[6, k + 1] = east * over


@kernel
def _sum(x, y, v, h, series):
    # The state after h; x and y are integrals of the last two rows.
    ahead, left = 0.0, 0.0
    beta, omega, theta = series[0, TERMS], series[3, TERMS], series[4, TERMS]
    for k in range(TERMS - 1, -1, -1):
        ahead = ahead * h + series[6, k] / (k + 1)
        left = left * h + series[5, k] / (k + 1)
        beta = beta * h + series[0, k]
        omega = omega * h + series[3, k]
        theta = theta * h + series[4, k]
    return x + v * h * ahead, y + v * h * left, theta, beta, omega


@compiled
def singular_samples(state, omega, v, times):
    """States and turn rates along a singular arc.

    Args:
        state: x, y, theta, beta at the start, shape (4,).
        omega: Turn rate at the start.
        v: Speed, 1 or -1.
        times: Since the start, shape (n,).

    Returns:
        x, y, theta, beta and omega, shape (n, 5).
    """
    series = np.empty((7, TERMS + 1))
    samples = np.empty((times.size, 5))
    for i in range(times.size):
        samples[i] = singular_arc(
            state[0], state[1], state[2], state[3], omega, v, times[i], series
        )
    return samples
