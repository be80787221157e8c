"""The last reports of a team, as arrays."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .robot_link import RobotReport


@dataclass(frozen=True)
class RobotReports:
    """What robots said last; what a robot that was not heard has not said is blank.

    Attributes:
        infrared_ranges: Free ways before the sensors, shape (n, 4) [m]; blank is infinite.
        battery: Shape (n,) [V]; blank is 0.
        age: Since each report came, shape (n,) [s]; blank is infinite.
        robot_state: Numbers of RobotState, shape (n,); blank is -1.
        robot_flags: Bits of RobotFlag, shape (n,); blank is 0.
        counts: Of the left and the right encoder, shape (n, 2); blank is 0.
    """

    infrared_ranges: np.ndarray
    battery: np.ndarray
    age: np.ndarray
    robot_state: np.ndarray
    robot_flags: np.ndarray
    counts: np.ndarray


def robot_reports(
    newest: dict[int, RobotReport], robots: Sequence[int], now: float
) -> RobotReports:
    """Reports of some robots, in their order, at a time by time.monotonic [s].

    Args:
        newest: The newest of each robot.
        robots: Their numbers.
        now: The time [s].
    """
    count = len(robots)
    reports = RobotReports(
        infrared_ranges=np.full((count, 4), math.inf),
        battery=np.zeros(count),
        age=np.full(count, math.inf),
        robot_state=np.full(count, -1.0),
        robot_flags=np.zeros(count),
        counts=np.zeros((count, 2)),
    )
    for k, robot in enumerate(robots):
        report = newest.get(robot)
        if report is not None:
            reports.infrared_ranges[k] = report.ranges
            reports.battery[k] = report.battery
            reports.age[k] = max(now - report.time, 0.0)
            reports.robot_state[k] = report.state
            reports.robot_flags[k] = report.flags
            reports.counts[k] = report.counts
    return reports
