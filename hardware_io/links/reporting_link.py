"""A link to robots whose reports say what they do: stops and arms are repeated until they show."""

import math
import threading
import time
from abc import abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from ...systems.numerics.errors import require_non_negative
from .link_record import LinkRecord, Progress
from .robot_link import OLDEST_POSES, LinkHealth, RobotLink, RobotReport, RobotState


class What(Enum):
    """What a robot is told."""

    HAIL = "to report"
    COMMAND = "to drive"
    STOP = "to stop until it is armed"
    ARM = "that it may drive"


@dataclass(frozen=True)
class Order:
    """A message to one robot.

    Attributes:
        what: It is told.
        sequence: Number; greater than those before. Robots of one command get the same.
        deadline: When it may begin to do so at the latest, by time.monotonic [s].
        speed: Forward [m/s].
        turn_rate: Left positive [rad/s].
    """

    what: What
    sequence: int
    deadline: float = math.inf
    speed: float = 0.0
    turn_rate: float = 0.0


@dataclass
class _Heard:
    """Of one robot: its newest report, when that came [s], and the order that it answers."""

    report: RobotReport | None = None
    came: float = -math.inf
    answers: float = math.inf


# Between one try and the next [s]. A stop may be lost several times in a row and still be in time;
# an arm is in no hurry.
_RETRY = {What.STOP: 0.02, What.ARM: 0.08}
# What a report shows of one that was taken.
_SHOWN = {
    What.STOP: {RobotState.STOPPED, RobotState.DISARMED},
    What.ARM: {RobotState.IDLE, RobotState.DRIVING, RobotState.LOST},
}


class ReportingLink(RobotLink):
    """What links have in common whose robots report their state.

    A kind opens and closes its way to the robots, sends orders (`transmit`), and hands on what it
    hears (`heard`, `heard_nothing_of_use`). Commands go out only while robots are armed; otherwise
    robots are asked for reports.

    Args:
        robots: Their numbers, in the order of the commands.
        session: Of this link, where robots are told; orders of one number differ by it.
    """

    def __init__(self, robots: Sequence[int], session: int = 0) -> None:
        super().__init__(robots)
        self.session = session
        self._changed = threading.Condition(threading.RLock())
        self._record = LinkRecord(self.robots)
        self._heard = {robot: _Heard() for robot in self.robots}
        self._stops, self._stops_at_arming = 0, -1

    @abstractmethod
    def transmit(self, robot: int, order: Order) -> None:
        """Send an order to a robot, at once; it may be lost on its way.

        Args:
            robot: Its number.
            order: What it is told.

        Raises:
            LinkError: The way to the robots has gone.
        """

    def heard(self, robot: int, report: RobotReport, progress: Progress | None = None) -> None:
        """Take note of a report, which is newer than those before.

        Args:
            robot: Its number; others than those of the link do not count.
            report: What it says.
            progress: Which orders it has taken, where it says so.
        """
        with self._changed:
            known = self._heard.get(robot)
            if known is None:
                self._record.refused += 1
                return
            self._record.received += 1
            known.report, known.came = report, time.monotonic()
            if progress is not None:
                ours = progress.session == self.session
                known.answers = progress.last_sequence if ours else -math.inf
                self._record.note_progress(progress, known.came)
            self._changed.notify_all()
            self.on_report()

    def heard_nothing_of_use(self) -> None:
        """Take note of a message that was none, came twice, or was overtaken by newer ones."""
        with self._changed:
            self._record.refused += 1

    def heartbeat(self) -> None:
        """Ask every robot for a report; nothing moves."""
        for robot in self.robots:
            self.transmit(robot, Order(What.HAIL, self.next_sequence()))

    def arm(self, timeout: float = 1.0) -> tuple[int, ...]:
        """See `RobotLink`.

        Args:
            timeout: How long to wait [s].
        """
        with self._changed:
            stops = self._stops_at_arming = self._stops
        return self._insist(What.ARM, timeout, lambda: self._stops == stops)

    def arm_again(self, robots: Sequence[int]) -> None:
        """See `RobotLink`.

        Args:
            robots: Their numbers.
        """
        for robot in robots:
            with self._changed:
                if self._is_armed():
                    self._send_to(robot, What.ARM)

    def stop(self, timeout: float = 0.5) -> tuple[int, ...]:
        """See `RobotLink`.

        Args:
            timeout: How long to wait [s].
        """
        with self._changed:
            self._stops += 1
        return self._insist(What.STOP, timeout, lambda: True)

    def send(
        self, speeds: np.ndarray, turn_rates: np.ndarray, sequence: int, deadline: float
    ) -> None:
        """See `RobotLink`.

        Args:
            speeds: Shape (n,) [m/s].
            turn_rates: Shape (n,) [rad/s].
            sequence: Number of the command.
            deadline: As of `RobotLink` [s].
        """
        with self._changed:
            if not self._is_armed():
                self.heartbeat()
                return
            self._record.note_sent(self.session, sequence, None, time.monotonic())
            for robot, speed, rate in zip(self.robots, speeds, turn_rates, strict=True):
                order = Order(What.COMMAND, sequence, deadline, float(speed), float(rate))
                self.transmit(robot, order)

    def telemetry(self) -> dict[int, RobotReport]:
        """The latest report of every robot that was heard."""
        with self._changed:
            reports = {robot: known.report for robot, known in self._heard.items()}
        return {robot: report for robot, report in reports.items() if report is not None}

    def health(self) -> LinkHealth:
        """How the link has been."""
        with self._changed:
            return self._record.health(time.monotonic())

    def _is_armed(self) -> bool:
        """Whether robots were armed over this link, and not stopped since."""
        return self._stops == self._stops_at_arming

    def _send_to(self, robot: int, what: What) -> int:
        sequence, now = self.next_sequence(), time.monotonic()
        deadline = now + OLDEST_POSES if what == What.ARM else math.inf
        self._record.note_sent(self.session, sequence, robot, now)
        self.transmit(robot, Order(what, sequence, deadline))
        return sequence

    def _insist(self, what: What, timeout: float, goes_on: Callable[[], bool]) -> tuple[int, ...]:
        """Send a stop or an arm to each robot until its reports show it, or time is up."""
        require_non_negative("timeout", timeout)
        began = time.monotonic()
        end, first = began + timeout, dict[int, int]()

        def shows(robot: int) -> bool:
            known = self._heard[robot]
            if known.report is None or known.came <= began or robot not in first:
                return False
            return known.report.state in _SHOWN[what] and known.answers >= first[robot]

        with self._changed:
            while goes_on():
                for robot in self.robots:
                    if not shows(robot):
                        self._record.retried += robot in first
                        sequence = self._send_to(robot, what)
                        first.setdefault(robot, sequence)
                pause = max(min(_RETRY[what], end - time.monotonic()), 0.0)
                done = self._changed.wait_for(
                    lambda: not goes_on() or all(map(shows, self.robots)), pause
                )
                if done or time.monotonic() >= end:
                    break
            answered = tuple(filter(shows, self.robots))
            self._record.acknowledged += len(answered)
            self._record.lost += len(self.robots) - len(answered)
            return answered
