"""Encoder counts of robots that tell where they are, and not what their encoders count."""

import numpy as np

from ...systems.numerics.station.motion_checks import Chassis, wheel_ways

# Wheels do not go further between two reports; a pose that jumps was started anew [m].
_FURTHEST = 0.5


class OdometryCounts:
    """Counts of two wheels, made of poses one after the other.

    Args:
        chassis: The wheels.
    """

    def __init__(self, chassis: Chassis) -> None:
        self._chassis, self._ways = chassis, np.zeros(2)
        self._pose: np.ndarray | None = None

    def begin_anew(self) -> None:
        """Count nothing between the last pose and the next."""
        self._pose = None

    def after(self, pose: np.ndarray) -> tuple[int, int]:
        """Counts of the left and the right wheel when the robot has come to a pose.

        Args:
            pose: x, y [m] and heading [rad], shape (3,).
        """
        if self._pose is not None:
            step = wheel_ways(self._chassis, self._pose[np.newaxis], pose[np.newaxis])[0]
            self._ways += np.where(np.abs(step) < _FURTHEST, step, 0.0)
        self._pose = pose
        left, right = np.rint(self._chassis.counts_per_metre * self._ways).astype(int).tolist()
        return left, right
