"""The one interface behind which every kind of robots stands."""

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

# No robot has a number from here on: 255 means all of them, where frames have a byte for it.
EVERYONE = 255
# How old the poses may be from which a command was computed when a robot begins to follow it [s].
OLDEST_POSES = 0.3
# How long a thread of Python goes on when another wants to [s].
_TURN = 1e-4


class LinkError(SightfieldError):
    """The way to the robots cannot be opened, or has gone."""


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
    """What a robot says about itself.

    Attributes:
        time: When it said it, by time.monotonic [s].
        state: It is in.
        flags: Of what is wrong.
        counts: Of the left and the right encoder.
        ranges: Free ways before the four infrared sensors, from left to right [m]; infinite where
            it has none.
        battery: [V]; 0 where it says nothing of it.
    """

    time: float
    state: RobotState
    flags: RobotFlag = _NO_FLAGS
    counts: tuple[int, int] = (0, 0)
    ranges: tuple[float, float, float, float] = (math.inf, math.inf, math.inf, math.inf)
    battery: float = 0.0


@dataclass(frozen=True, kw_only=True)
class LinkHealth:
    """How a link has been since it was opened.

    Attributes:
        sent: Messages handed to the network or the module.
        acknowledged: Stops and arms that a robot has acknowledged, counted for every robot, and
            messages to a single robot that its module has acknowledged.
        retried: Stops and arms sent again.
        lost: Stops and arms that a robot never acknowledged in time, and messages to a single robot
            that its module did not acknowledge.
        received: Messages from robots.
        refused: Messages that were none, came twice, or were overtaken by newer ones.
        rssi: Of the last message [dBm], None before the first and where there is no radio to ask.
        round_trip: Mean of the last ones, without the time a robot held the answer [s]; None before
            the first, and where robots do not say what they answer.
        quality: Part of what was sent to each robot lately that it has taken, 0 to 1, in the order
            of the link's robots; 0 where none has been heard for a second, and where robots do not
            say what they take.
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
        on_report: Called after each report, in whatever thread took it; for who cannot wait until
            it looks for one. It must not wait itself.

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
            # Not in the place of what went wrong before.
            if exception[0] is None:
                raise
        finally:
            self.close()

    @abstractmethod
    def connect(self) -> None:
        """Open the way to the robots; nothing moves.

        Raises:
            LinkError: There is none.
        """

    @abstractmethod
    def close(self) -> None:
        """Let go of it; robots that were not stopped stop by themselves."""

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
            deadline: When robots may begin to follow it at the latest, by time.monotonic [s]; it
                may have passed, and then the command only tells that the work station is there.

        Raises:
            LinkError: The way to the robots has gone.
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
            age: Of the poses they were computed from [s]; robots follow none older than 0.3 s.

        Returns:
            Number of the command.

        Raises:
            InvalidInput: Shapes do not fit, or a valid number is not finite.
            LinkError: The way to the robots has gone.
        """
        velocities = self.checked_commands(velocities, valid)
        require_non_negative("age", age)
        sequence = self.next_sequence()
        deadline = time.monotonic() + OLDEST_POSES - age
        self.send(velocities[:, 0], velocities[:, 1], sequence, deadline)
        return sequence

    def checked_commands(self, velocities: np.ndarray, valid: np.ndarray | None) -> np.ndarray:
        """Commands with zeros where they are not to be followed, shape (n, 2).

        Args:
            velocities, valid: As of `send_commands`.

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
    """Threads that receive take turns with a busy one after a tenth of a millisecond.

    Python has them wait for 5 ms, and a report or a stop would.
    """
    before = sys.getswitchinterval()
    sys.setswitchinterval(_TURN)
    try:
        yield
    finally:
        sys.setswitchinterval(before)


def require_robots(robots: Sequence[int]) -> tuple[int, ...]:
    """Numbers of a team's robots, as a tuple.

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
