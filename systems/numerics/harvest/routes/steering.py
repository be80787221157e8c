"""Keeping a tractor on a line, step by step, and moving it with its trailer."""

import numpy as np

from ...compiled import compiled
from .way import rates

# How strongly a cart turns back to its line, per metre beside it [1/m].
PULL = 0.25


@compiled
def nearest_way(line, step, x, y, way, window):
    """Way along a line to the point nearest to (x, y), looked for about a way [m].

    Args:
        window: How far about that [m].
    """
    first = max(int((way - window) / step), 0)
    last = min(int((way + window) / step) + 1, len(line) - 1)
    best, place = np.inf, first
    for k in range(first, last + 1):
        gap = (line[k, 0] - x) ** 2 + (line[k, 1] - y) ** 2
        if gap < best:
            best, place = gap, k
    course = line[place, 2]
    ahead = (x - line[place, 0]) * np.cos(course) + (y - line[place, 1]) * np.sin(course)
    return step * place + min(max(ahead, -step), step)


@compiled
def steer(line, step, state, way, speed, radius, period):
    """Turn rate that brings a tractor onto a line at the end of a period.

    It is the line's turn over the way that is driven, with what corrects the heading, and the
    place beside the line.

    Args:
        line: x, y, theta, theta unwrapped, shape (m, 3).
        step: Spacing of its points [m].
        state: x, y, theta, beta.
        way: Along the line to the point nearest to the tractor [m].
        speed: [m/s].
        radius: Least turning radius [m].
        period: For which speed and turn rate are held [s].
    """
    if speed <= 0.0:
        return 0.0
    at = min(max(way / step, 0.0), len(line) - 1.001)
    k = int(at)
    x = line[k, 0] + (at - k) * (line[k + 1, 0] - line[k, 0])
    y = line[k, 1] + (at - k) * (line[k + 1, 1] - line[k, 1])
    course = line[k, 2] + (at - k) * (line[k + 1, 2] - line[k, 2])
    beside = np.cos(course) * (state[1] - y) - np.sin(course) * (state[0] - x)
    at = min(max((way + speed * period) / step, 0.0), len(line) - 1.001)
    k = int(at)
    ahead = line[k, 2] + (at - k) * (line[k + 1, 2] - line[k, 2])
    error = ahead - np.arctan(PULL * beside) - state[2]
    error = (error + np.pi) % (2 * np.pi) - np.pi
    most = speed / radius
    return min(max(error / period, -most), most)


@compiled
def drive(state, v, omega, hitch, period, count):
    """State after a control held for a period, in a number of Runge-Kutta steps of order 4.

    The equations are those of `planning.trailer`.

    Args:
        state: x, y, theta, beta of the cart, shape (4,) [m], [m], [rad], [rad].
        v: Speed of the tractor [m/s].
        omega: Its turn rate [rad/s].
        hitch: Of the cart.
        count: Number of steps.
    """
    step = period / count
    x, y, theta, beta = state[0], state[1], state[2], state[3]
    for _ in range(count):
        a = rates(theta, beta, v, omega, hitch)
        b = rates(theta + step / 2 * a[2], beta + step / 2 * a[3], v, omega, hitch)
        c = rates(theta + step / 2 * b[2], beta + step / 2 * b[3], v, omega, hitch)
        d = rates(theta + step * c[2], beta + step * c[3], v, omega, hitch)
        x += step / 6 * (a[0] + 2 * b[0] + 2 * c[0] + d[0])
        y += step / 6 * (a[1] + 2 * b[1] + 2 * c[1] + d[1])
        theta += step / 6 * (a[2] + 2 * b[2] + 2 * c[2] + d[2])
        beta += step / 6 * (a[3] + 2 * b[3] + 2 * c[3] + d[3])
    return np.array([x, y, theta, beta])


@compiled
def drive_team(states, v, omega, hitch, period, count):
    """States of several carts after their controls, shape (K, 4); see `drive`."""
    moved = np.empty_like(states)
    for k in range(len(states)):
        moved[k] = drive(states[k], v[k], omega[k], hitch, period, count)
    return moved
