"""The wheels of robots that stand in: motors with friction, encoders, and where the robots go."""

import math

import numpy as np

from .robot_body import RobotBody

# Fastest wheel that is asked for; beyond it both are scaled, so that a curve stays the same [m/s].
_TOP_WHEEL_SPEED = 0.6


class StandInWheels:
    """Wheels of n robots, as `wheels_model.c` has them for those in simavr.

    A motor follows tau v' = power top_speed - v - friction sign(v), in closed form over a step; the
    power is what holds the speed that is asked for.

    Attributes:
        poses: Shape (n, 3) [m], [m], [rad]; headings count turns.
        speeds: Of the left and the right wheel, shape (n, 2) [m/s].
        odometry: Poses since the start by the encoders alone, shape (n, 3): carrying does not
            count, nor what encoders do not tell.
        sense: What encoders tell, shape (n, 2): 1 the wheel's way, -1 the other way, 0 nothing.

    Args:
        starts: Poses, shape (n, 3) [m], [m], [rad].
        body: Of all robots.
    """

    def __init__(self, starts: np.ndarray, body: RobotBody) -> None:
        self._body = body
        self.poses = np.array(starts, dtype=float)
        self.speeds = np.zeros((len(self.poses), 2))
        self.odometry = np.zeros_like(self.poses)
        self.sense = np.ones_like(self.speeds)
        self._counts = np.zeros_like(self.speeds)

    def counts(self) -> np.ndarray:
        """Of the left and the right encoder, whole numbers, shape (n, 2)."""
        return np.floor(self._counts).astype(int)

    def step(self, targets: np.ndarray, dt: float) -> None:
        """Go on for some time.

        Args:
            targets: Forward speeds and turn rates, shape (n, 2) [m/s], [rad/s]; zero brakes.
            dt: For how long [s].
        """
        body = self._body
        across = 0.5 * body.track_width * targets[:, 1]
        wanted = np.stack([targets[:, 0] - across, targets[:, 0] + across], axis=1)
        top = np.abs(wanted).max(axis=1, keepdims=True)
        wanted = wanted * (_TOP_WHEEL_SPEED / np.maximum(top, _TOP_WHEEL_SPEED))
        pull = np.clip(wanted + body.friction * np.sign(wanted), -body.top_speed, body.top_speed)
        before = self.speeds
        sticks = (before == 0) & (np.abs(pull) <= body.friction)
        direction = np.where(before != 0, before, pull)
        limit = pull - np.copysign(body.friction, direction)
        speeds = limit + (before - limit) * math.exp(-dt / body.time_constant)
        self.speeds = np.where(sticks | (speeds * direction <= 0), 0.0, speeds)
        ways = 0.5 * (before + self.speeds) * dt
        self._counts += self.sense * body.counts_per_metre * ways
        for poses, rolled in ((self.poses, ways), (self.odometry, self.sense * ways)):
            way, turn = rolled.mean(axis=1), (rolled[:, 1] - rolled[:, 0]) / body.track_width
            middle = poses[:, 2] + 0.5 * turn
            poses += np.column_stack([way * np.cos(middle), way * np.sin(middle), turn])
