"""Equations of motion of the agents, for NumPy arrays and for Drake's scalars alike.

Limits are written with absolute values instead of branches, so that automatic differentiation and
symbolic evaluation go through them, and they can be compiled as they stand.

Source: Zhang 2014, (2.1) for point agents; the unicycle is the usual model of the testbed's
differential-drive robots (2.2.8).
"""

import numpy as np
from numba.extending import register_jitable

# A robot with a smaller heading error drives straight [rad].
STRAIGHT = 1e-7


@register_jitable
def clip_symmetric(value, limit):
    """Clip to [-limit, limit], elementwise."""
    return (np.abs(value + limit) - np.abs(value - limit)) / 2


@register_jitable
def limit_speed(velocities, top_speed: float):
    """Shorten velocities that exceed the top speed, keeping their direction.

    Args:
        velocities: Shape (n, 2) [m/s].
        top_speed: [m/s].

    Returns:
        Shape (n, 2) [m/s].
    """
    square = (velocities[:, 0] ** 2 + velocities[:, 1] ** 2) / top_speed**2
    # max(1, square) without a branch; its root is never taken at zero, where it has no slope.
    excess = (1 + square + np.abs(square - 1)) / 2
    return velocities / np.sqrt(excess).reshape((-1, 1))


@register_jitable
def point_rates(velocities, top_speed: float):
    """Rates of point agents, shape (2 n,) -> (2 n,) [m/s]; see `limit_speed`."""
    return limit_speed(velocities.reshape((-1, 2)), top_speed).reshape((-1,))


@register_jitable
def point_step(positions, velocities, top_speed: float, step: float):
    """Positions of point agents after velocities held for a step, shape (2 n,) each [m].

    Args:
        positions: Shape (2 n,) [m].
        velocities: Shape (2 n,) [m/s].
        top_speed: [m/s].
        step: [s].
    """
    return positions + step * point_rates(velocities, top_speed)


@register_jitable
def unicycle_rates(headings, commands):
    """Rates of (x, y, theta) of unicycles.

    Args:
        headings: Shape (n,) [rad].
        commands: Speed and turn rate, shape (n, 2) [m/s], [rad/s].

    Returns:
        Shape (n, 3) [m/s], [m/s], [rad/s].
    """
    speed, turn_rate = commands[:, 0], commands[:, 1]
    return np.stack((speed * np.cos(headings), speed * np.sin(headings), turn_rate), axis=1)


@register_jitable
def unicycle_step(poses, commands, step: float):
    """Poses after commands held for a step: a straight chord at the mean heading.

    Second-order accurate; between two samples the robot is on the chord.

    Args:
        poses: Shape (n, 3) [m], [m], [rad].
        commands: Shape (n, 2) [m/s], [rad/s].
        step: [s].

    Returns:
        Shape (n, 3).
    """
    middle = poses[:, 2] + commands[:, 1] * (step / 2)
    return poses + step * unicycle_rates(middle, commands)


@register_jitable
def drive_step(poses, commands, limits, step: float):
    """Poses of differential drives after commands held for a step.

    Args:
        poses: Shape (3 n,) [m], [m], [rad].
        commands: Shape (2 n,) [m/s], [rad/s]; clipped to the limits.
        limits: Top speed and top turn rate, shape (2,) [m/s], [rad/s].
        step: [s].

    Returns:
        Shape (3 n,).
    """
    clipped = clip_symmetric(commands.reshape((-1, 2)), limits)
    return unicycle_step(poses.reshape((-1, 3)), clipped, step).reshape((-1,))


@register_jitable
def heading_command(headings, velocities, gain: float):
    """Speed and turn rate with which a unicycle follows a desired velocity.

    The speed is the part of the velocity along the robot, backwards too; the turn rate is
    proportional to the heading error.

    Args:
        headings: Shape (n,) [rad].
        velocities: Shape (n, 2) [m/s].
        gain: Turn rate per heading error [1/s].

    Returns:
        Shape (n, 2) [m/s], [rad/s].
    """
    c, s = np.cos(headings), np.sin(headings)
    ahead = c * velocities[:, 0] + s * velocities[:, 1]
    left = c * velocities[:, 1] - s * velocities[:, 0]
    return np.stack((ahead, gain * np.arctan2(left, ahead)), axis=1)


@register_jitable
def heading_commands(poses, velocities, gain: float):
    """Commands of robots, shapes (3 n,), (2 n,) -> (2 n,); see `heading_command`."""
    headings = poses.reshape((-1, 3))[:, 2]
    return heading_command(headings, velocities.reshape((-1, 2)), gain).reshape((-1,))


@register_jitable
def turn_first_command(headings, velocities, period: float):
    """Speed and turn rate of a unicycle that turns in place before it drives straight.

    It turns its front or its back to the direction, whichever is nearer, so by a right angle at
    most. A heading error below `STRAIGHT` is corrected while it drives.

    Args:
        headings: Shape (n,) [rad].
        velocities: Shape (n, 2) [m/s].
        period: For how long commands are held [s].

    Returns:
        Shape (n, 2) [m/s], [rad/s]; turn rates are not limited.
    """
    c, s = np.cos(headings), np.sin(headings)
    ahead = c * velocities[:, 0] + s * velocities[:, 1]
    left = c * velocities[:, 1] - s * velocities[:, 0]
    backwards = np.where(ahead < 0.0, -1.0, 1.0)
    error = np.arctan2(backwards * left, backwards * ahead)
    drives = np.abs(error) <= STRAIGHT
    return np.stack((np.where(drives, ahead, 0.0), error / period), axis=1)
