"""The common interface of the links to all kinds of robots."""

import math
import sys
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from enum import IntEnum, IntFlag
from typing import Self

import numpy as np

from ...systems.numerics.errors import SightfieldError, require, require_non_negative

# Robots' numbers are below this: in frames with one byte for the number, 255 means all robots.
EVERYONE = 255
# Greatest age of the poses behind a command at which a robot may begin to follow it [s].
OLDEST_POSES = 0.3
# Python's thread switch interval inside `brisk_threads` [s].
_TURN = 1e-4


class LinkError(SightfieldError):
    """The link to the robots cannot be opened, or was lost."""


class RobotState(IntEnum):
    """What a robot is doing; only a driving robot's motors get power."""

    DISARMED = 0
    IDLE = 1
    DRIVING = 2
    LOST = 3
    STOPPED = 4


class RobotFlag(IntFlag):
    """What else a robot reports."""

    LOW_BATTERY = 1
    WATCHDOG_RESET = 2
    SATURATED = 4
    LEFT_STALLED = 8
    RIGHT_STALLED = 16


_NO_FLAGS = RobotFlag(0)


@dataclass(frozen=True, kw_only=True)
class RobotReport:
    """What a robot reports about itself.

    Attributes:
        time: When it reported, by time.monotonic [s].
        state: State of the robot.
        flags: Flags of what is wrong.
        counts: Counts of the left and the right encoder.
        ranges: Free distances before the four infrared sensors, from left to right [m]; infinite
            where it has none.
        battery: Battery voltage [V]; 0 if not reported.
    """

    time: float
    state: RobotState
    flags: RobotFlag = _NO_FLAGS
    counts: tuple[int, int] = (0, 0)
    ranges: tuple[float, float, float, float] = (math.inf, math.inf, math.inf, math.inf)
    battery: float = 0.0


@dataclass(frozen=True, kw_only=True)
class LinkHealth:
    """Statistics of a link since it was opened.

    Attributes:
        sent: Messages handed to the network or the module.
        acknowledged: Stops and arms that a robot has acknowledged, counted for every robot, and
            messages to a single robot that its module has acknowledged.
        retried: Stops and arms sent again.
        lost: Stops and arms that a robot never acknowledged in time, and messages to a single robot
            that its module did not acknowledge.
        received: Messages from robots.
        refused: Messages that were invalid, came twice, or were overtaken by newer ones.
        rssi: RSSI of the last message [dBm]; None before the first, and for links without RSSI.
        round_trip: Mean of the last round trips, without the time a robot held the answer [s]; None
            before the first, and if robots do not report which message they took.
        quality: Share of the messages lately sent to each robot that it has taken, 0 to 1, in the
            order of the link's robots; 0 for a robot not heard for a second, and if robots do not
            report how many messages they took.
    """

    sent: int
    acknowledged: int
    retried: int
    lost: int
    received: int
    refused: int
    rssi: int | None
    round_trip: float | None
    quality: tuple[float, ...]


class RobotLink(ABC):
    """Commands to a team of robots and reports from them; a context manager.

    Entering it connects, leaving it stops the robots and closes. Robots drive only after `arm`, and
    stop by themselves after the silence that their kind declares. All methods may be called from
    several threads.

    Args:
        robots: Their numbers, in the order of the commands; 0 to 254.

    Attributes:
        robots: The same, as a tuple.
        on_report: Called after each report, in the thread that received it, for callers that cannot
            poll. It must not block.

    Raises:
        InvalidInput: A robot's number is not one, or comes twice.
    """

    def __init__(self, robots: Sequence[int]) -> None:
        self.robots = require_robots(robots)
        self.on_report: Callable[[], object] = lambda: None
        self._counting = threading.Lock()
        self._sequence = 0

    def __enter__(self) -> Self:
        self.connect()
        return self

    def __exit__(self, *exception: object) -> None:
        try:
            self.stop(timeout=0.3)
        except LinkError:
            # Do not hide an earlier exception.
            if exception[0] is None:
                raise
        finally:
            self.close()

    @abstractmethod
    def connect(self) -> None:
        """Open the link to the robots; nothing moves.

        Raises:
            LinkError: It cannot be opened.
        """

    @abstractmethod
    def close(self) -> None:
        """Close the link; robots that were not stopped stop by themselves."""

    @abstractmethod
    def heartbeat(self) -> None:
        """Tell the robots that the work station is there, so that they report; nothing moves."""

    @abstractmethod
    def arm(self, timeout: float = 1.0) -> tuple[int, ...]:
        """Let the robots drive; returns those that have acknowledged it within a time [s].

        A `stop` in another thread ends it.

        Args:
            timeout: How long to wait [s].
        """

    @abstractmethod
    def arm_again(self, robots: Sequence[int]) -> None:
        """Let robots drive again that were reset, or stopped by others, without waiting.

        Nothing is sent once robots were stopped over this link.

        Args:
            robots: Their numbers.
        """

    @abstractmethod
    def stop(self, timeout: float = 0.5) -> tuple[int, ...]:
        """Emergency stop until `arm`; returns the robots that acknowledged it within a time [s].

        Args:
            timeout: How long to wait [s].
        """

    @abstractmethod
    def send(
        self, speeds: np.ndarray, turn_rates: np.ndarray, sequence: int, deadline: float
    ) -> None:
        """Send every robot its forward speed and turn rate, checked by `send_commands`.

        Args:
            speeds: Forward, shape (n,) [m/s].
            turn_rates: Left positive, shape (n,) [rad/s].
            sequence: Number of the command; greater than those before.
            deadline: Latest time at which robots may begin to follow it, by time.monotonic [s]. If
                it has passed, the command only tells that the work station is there.

        Raises:
            LinkError: The link to the robots was lost.
        """

    @abstractmethod
    def telemetry(self) -> dict[int, RobotReport]:
        """The latest report of every robot that was heard."""

    @abstractmethod
    def health(self) -> LinkHealth:
        """How the link has been."""

    def send_commands(
        self, velocities: np.ndarray, valid: np.ndarray | None = None, age: float = 0.0
    ) -> int:
        """Send every robot its forward speed and turn rate.

        Args:
            velocities: Shape (n, 2) [m/s], [rad/s].
            valid: Whether each is to be followed, shape (n,); the others get a speed of zero.
            age: Age of the poses they were computed from [s]; robots follow none older than 0.3 s.

        Returns:
            Number of the command.

        Raises:
            InvalidInput: Shapes do not fit, or a valid number is not finite.
            LinkError: The link to the robots was lost.
        """
        velocities = self.checked_commands(velocities, valid)
        require_non_negative("age", age)
        sequence = self.next_sequence()
        deadline = time.monotonic() + OLDEST_POSES - age
        self.send(velocities[:, 0], velocities[:, 1], sequence, deadline)
        return sequence

    def checked_commands(self, velocities: np.ndarray, valid: np.ndarray | None) -> np.ndarray:
        """Check commands; returns them with zeros where they are not valid, shape (n, 2).

        Args:
            velocities, valid: As in `send_commands`.

        Raises:
            InvalidInput: Shapes do not fit, or a valid number is not finite.
        """
        count = len(self.robots)
        numbers = np.asarray(velocities, dtype=float)
        require(numbers.shape == (count, 2), "velocities", f"have shape ({count}, 2)", numbers)
        follow = np.ones(count, bool) if valid is None else np.asarray(valid, dtype=bool)
        require(follow.shape == (count,), "valid", f"have shape ({count},)", follow)
        numbers = np.where(follow[:, None], numbers, 0.0)
        require(bool(np.isfinite(numbers).all()), "velocities", "be finite", numbers)
        return numbers

    def next_sequence(self) -> int:
        """Number for the next message: from 1 on, one more each time."""
        with self._counting:
            self._sequence += 1
            return self._sequence


@contextmanager
def brisk_threads() -> Iterator[None]:
    """Let threads that receive interrupt a busy one after a tenth of a millisecond.

    By default Python lets them wait for 5 ms, which would delay a report or a stop.
    """
    before = sys.getswitchinterval()
    sys.setswitchinterval(_TURN)
    try:
        yield
    finally:
        sys.setswitchinterval(before)


def require_robots(robots: Sequence[int]) -> tuple[int, ...]:
    """Check the numbers of a team's robots, and return them as a tuple.

    Args:
        robots: 0 to 254, each once, one at least.

    Raises:
        InvalidInput: They are not.
    """
    team = tuple(robots)
    require(len(team) > 0, "robots", "be one at least", robots)
    for robot in team:
        whole = isinstance(robot, int) and not isinstance(robot, bool)
        good = whole and 0 <= robot < EVERYONE
        require(good, "robots", f"be a whole number 0 to {EVERYONE - 1}", robot)
    require(len(set(team)) == len(team), "robots", "differ", robots)
    return team
