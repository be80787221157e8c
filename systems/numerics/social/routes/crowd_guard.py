"""Speeds at which robots that feel each other by infrared never touch.

A robot that drives a distance s at an angle a from the way to another closes the gap between them
by at most s cos(a). So it may drive half of the gap: the other one does no more, and half and half
is a whole. Who drives forwards only and feels its whole front closes no gap that it does not feel.

Source: ours; Zhang 2014, 2.3.4.3, has infrared sensors for the same end.
"""

import numpy as np

from ...compiled import compiled


@compiled
def guarded_commands(
    commands: np.ndarray,
    ranges: np.ndarray,
    bearings: np.ndarray,
    half: float,
    margin: float,
    period: float,
) -> np.ndarray:
    """Commands whose speeds are cut so far that no two robots touch within a period.

    Args:
        commands: Speed and turn rate of each robot, shape (n, 2) [m/s], [rad/s]; speeds below
            zero become zero.
        ranges: Of each robot's sensors, from the rim, shape (n, sensors) [m].
        bearings: Of the sensors, shape (sensors,) [rad].
        half: Half of a cone's angle [rad].
        margin: Gap that is left between robots [m].
        period: For how long a command is held, along a straight chord [s].

    Returns:
        Shape (n, 2); turn rates are kept.
    """
    safe = commands.copy()
    for i in range(len(commands)):
        speed = max(commands[i, 0], 0.0)
        # The chord of a period lies half of its turn beside the heading.
        turned = abs(0.5 * period * commands[i, 1])
        for k in range(len(bearings)):
            beside = max(abs(bearings[k]) - half - turned, 0.0)
            closing = np.cos(min(beside, np.pi))
            if closing > 0.0:
                room = max(0.5 * (ranges[i, k] - margin), 0.0)
                speed = min(speed, room / (closing * period))
        safe[i, 0] = speed
    return safe
