"""The link to the robots as a system: velocity commands in, reports out."""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pydrake.systems.framework import Context, EventStatus, LeafSystem

from ...systems.drake_parts import read, state_vector
from ...systems.numerics.errors import require, require_non_negative, require_positive
from .robot_link import RobotLink, RobotReport


@dataclass(frozen=True)
class RobotReports:
    """Latest reports of robots; entries of a robot that was never heard are blank.

    Attributes:
        infrared_ranges: Free distances before the sensors, shape (n, 4) [m]; blank is infinite.
        battery: Shape (n,) [V]; blank is 0.
        age: Age of each report, shape (n,) [s]; blank is infinite.
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
    """Collect the reports of some robots, in the robots' order.

    Args:
        newest: The newest report of each robot.
        robots: Their numbers.
        now: The time by time.monotonic [s].
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


class RadioCommander(LeafSystem):
    """Sends the commands of a team periodically, and outputs the robots' latest reports.

    A robot whose command is not valid, or not finite, is told to stand still. Robots must have been
    armed (`RobotLink.arm`); they stand still by themselves when this system is no longer run. The
    outputs are sampled at the beginning of each period, so that a log of them is what controllers
    saw; the commands go out in a publish event, `offset` later.

    .. pydrake_system::

        name: RadioCommander
        input_ports:
        - velocity_commands
        - valid
        - pose_age
        - arm_again
        output_ports:
        - infrared_ranges
        - battery
        - link_quality
        - age
        - robot_state
        - robot_flags
        - counts

    =================  ====  ==========  =====  ===========
    port               size  unit        frame  feedthrough
    =================  ====  ==========  =====  ===========
    velocity_commands  2 N   m/s, rad/s  robot  -
    valid              N     -           -      -
    pose_age           N     s           -      -
    arm_again          N     -           -      -
    infrared_ranges    4 N   m           robot  -
    battery            N     V           -      -
    link_quality       N     -           -      -
    age                N     s           -      -
    robot_state        N     -           -      -
    robot_flags        N     -           -      -
    counts             2 N   -           -      -
    =================  ====  ==========  =====  ===========

    `valid`, all ones if not connected, is true above 0.5. `pose_age`, zero if not connected, is the
    age of the poses from which the commands are computed; the greatest among the robots with valid
    commands is sent along, and robots follow no command of poses older than 0.3 s. Robots whose
    `arm_again` is above 0.5 are armed again, unless they were stopped over this link. Ranges come
    robot by robot, from left to right, and are infinite before a robot's first report; `battery`
    and `link_quality` are zero then, and `age`, the age of the report, is infinite. `link_quality`
    is the share of recent frames that a robot has taken; `robot_state` is a number of RobotState,
    or -1; `robot_flags` has bits of RobotFlag; `counts` are of the left and the right encoder.

    Source: Zhang 2014, 2.2.8 and 2.3.4.

    Args:
        link: The link; it must be open while this system runs.
        period: Time between samples of the reports [s].
        repeats: How often commands are sent in a period. If they go out every 0.05 s, robots that
            stop after 0.17 s of silence tolerate the loss of two messages in a row.
        offset: Delay of sending after the outputs were sampled [s].

    Raises:
        InvalidInput: The period or the repeats are not positive, or the offset is negative.
        LinkError: While running: the link to the robots was lost.
    """

    def __init__(
        self, link: RobotLink, *, period: float = 0.05, repeats: int = 1, offset: float = 0.0
    ):
        super().__init__()
        require_positive("period", period)
        require(repeats > 0, "repeats", "be positive", repeats)
        require_non_negative("offset", offset)
        self._link = link
        count = len(link.robots)
        self._commands = self.DeclareVectorInputPort("velocity_commands", 2 * count)
        self._valid = self.DeclareVectorInputPort("valid", count)
        self._pose_age = self.DeclareVectorInputPort("pose_age", count)
        self._arm_again = self.DeclareVectorInputPort("arm_again", count)
        blank = (math.inf, 0.0, 0.0, math.inf, -1.0, 0.0, 0.0)
        sizes = (4 * count, count, count, count, count, count, 2 * count)
        names = ("infrared_ranges", "battery", "link_quality", "age", "robot_state")
        names += ("robot_flags", "counts")
        self._states = [
            self.DeclareDiscreteState(state_vector(np.full(size, value)))
            for size, value in zip(sizes, blank, strict=True)
        ]
        for name, state in zip(names, self._states, strict=True):
            self.DeclareStateOutputPort(name, state)
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._sample)
        # Sending is a publish event: it does not change the sampled outputs within a period.
        self.DeclarePeriodicPublishEvent(period / repeats, offset, self._send)

    def get_velocity_commands_input_port(self):
        """Forward speeds and turn rates, size 2 N [m/s], [rad/s]."""
        return self._commands

    def get_valid_input_port(self):
        """Whether each robot's command is to be followed, size N."""
        return self._valid

    def get_pose_age_input_port(self):
        """Ages of the poses that the commands are made from, size N [s]; may be left open."""
        return self._pose_age

    def _sample(self, context: Context, discrete_state) -> EventStatus:
        link = self._link
        now = robot_reports(link.telemetry(), link.robots, time.monotonic())
        quality = np.array(link.health().quality)
        values = (now.infrared_ranges, now.battery, quality, now.age, now.robot_state)
        values += (now.robot_flags, now.counts)
        for state, value in zip(self._states, values, strict=True):
            discrete_state.set_value(state, value.ravel())
        return EventStatus.Succeeded()

    def _send(self, context: Context) -> EventStatus:
        commands = read(self._commands, context).reshape(-1, 2)
        follow = np.all(np.isfinite(commands), axis=1)
        if self._valid.HasValue(context):
            follow = follow & (read(self._valid, context) > 0.5)
        ages = np.zeros(len(follow))
        if self._pose_age.HasValue(context):
            ages = read(self._pose_age, context)
        # A command of unknown age must not be followed.
        follow = follow & np.isfinite(ages) & (ages >= 0)
        if self._arm_again.HasValue(context):
            again = read(self._arm_again, context) > 0.5
            if again.any():
                robots = zip(self._link.robots, again, strict=True)
                self._link.arm_again([robot for robot, wanted in robots if wanted])
        self._link.send_commands(commands, follow, float(ages[follow].max(initial=0.0)))
        return EventStatus.Succeeded()
