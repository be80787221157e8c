"""The work station's end of the radio: commands out, telemetry in, emergency stop."""

import os
import threading
import time
from collections.abc import Callable, Sequence

import numpy as np

from ...systems.numerics.errors import require_non_negative
from ..links.link_record import LinkRecord, Progress
from ..links.robot_link import OLDEST_POSES, LinkHealth, RobotLink, RobotReport
from .frames import FrameError, decode, encode
from .messages import (
    MODULUS,
    MOST_ENTRIES,
    Acknowledgement,
    AnyFrame,
    Arm,
    Command,
    Entry,
    Form,
    Heartbeat,
    Kind,
    Stop,
    Telemetry,
)
from .xbee_port import XBeePort

BAUD_RATE = 57600
# Between one try and the next [s]. A stop may lose several frames in a row and still be in time; an
# arm is in no hurry.
_RETRY = {Kind.STOP: 0.02, Kind.ARM: 0.08}


class RadioLink(RobotLink):
    """Commands to a team of robots and telemetry from them, by one XBee module.

    An arm also opens a new session. Robots stop by themselves when they hear nothing for 170 ms.

    Args:
        port: Serial device of the module, as /dev/ttyUSB0.
        robots: Their numbers, in the order of the commands; 0 to 254.
        baud_rate: Of the module.
        unicast: Send each robot a frame of its own, which the modules acknowledge and repeat, once
            its address is known; else one frame goes to all and is not repeated.

    Raises:
        InvalidInput: A robot's number is not one, or comes twice.
        RadioError: On entering: no port, or no module that answers.
    """

    def __init__(
        self,
        port: str,
        robots: Sequence[int],
        *,
        baud_rate: int = BAUD_RATE,
        unicast: bool = False,
    ) -> None:
        super().__init__(robots)
        self._unicast = unicast
        self._module = XBeePort(port, baud_rate, self._take_payload, self._take_status)
        self._changed = threading.Condition(threading.RLock())
        self._session = int.from_bytes(os.urandom(2), "little")
        self._frames = 0
        self._stops = self._stops_at_arming = 0
        self._record = LinkRecord(self.robots)
        self._latest: dict[int, RobotReport] = {}
        self._addresses: dict[int, bytes] = {}
        self._acknowledged: set[tuple[Kind, int, int, int]] = set()
        self._awaited: set[int] = set()

    def connect(self) -> None:
        """Open the serial port, and wait for the module's answer."""
        self._module.__enter__()

    def close(self) -> None:
        """Close the serial port."""
        self._module.__exit__()

    def arm(self, timeout: float = 1.0) -> tuple[int, ...]:
        """Let the robots drive; returns those that have acknowledged it within a time [s].

        A `stop` in another thread ends it.

        Args:
            timeout: How long to wait [s].
        """
        with self._changed:
            self._session = (self._session + 1) % MODULUS
            self._frames = 0
            stops = self._stops_at_arming = self._stops
        return self._insist(Kind.ARM, timeout, lambda: self._stops == stops)

    def arm_again(self, robots: Sequence[int]) -> None:
        """Let robots drive again that were reset, or stopped by others.

        Nothing is sent once robots were stopped over this link.

        Args:
            robots: Their numbers.
        """
        with self._changed:
            if self._stops == self._stops_at_arming:
                for each in robots:
                    self._send(lambda each=each, **header: Arm(robot=each, **header))

    def stop(self, timeout: float = 0.5) -> tuple[int, ...]:
        """Emergency stop until `arm`; returns the robots that acknowledged it within a time [s].

        Args:
            timeout: How long to wait [s].
        """
        with self._changed:
            self._stops += 1
        return self._insist(Kind.STOP, timeout, lambda: True)

    def send(
        self, speeds: np.ndarray, turn_rates: np.ndarray, sequence: int, deadline: float
    ) -> None:
        """See `RobotLink`; frames have numbers of their own, among which stops and arms count.

        Args:
            speeds: Forward, shape (n,) [m/s].
            turn_rates: Shape (n,) [rad/s].
            sequence: Number of the command.
            deadline: As of `RobotLink` [s]: robots are told the age of the poses.

        Raises:
            RadioError: The module has gone.
        """
        age = OLDEST_POSES - (deadline - time.monotonic())
        self._send_entries(Form.TWIST, np.column_stack([speeds, turn_rates]), max(age, 0.0))

    def send_wheel_speeds(
        self, speeds: np.ndarray, valid: np.ndarray | None = None, age: float = 0.0
    ) -> None:
        """Send every robot the speeds of its left and right wheel, shape (n, 2) [m/s].

        Args:
            speeds: Shape (n, 2) [m/s].
            valid: To which robots, shape (n,); None: all.
            age: Of the poses that they were computed from [s].

        Raises:
            InvalidInput: As `RobotLink.send_commands`.
            RadioError: The module has gone.
        """
        require_non_negative("age", age)
        self._send_entries(Form.WHEELS, self.checked_commands(speeds, valid), age)

    def heartbeat(self) -> None:
        """Tell the robots that the work station is there; nothing moves."""
        self._send(lambda **header: Heartbeat(**header))

    def telemetry(self) -> dict[int, RobotReport]:
        """The latest report of every robot that was heard.

        What came later than round trips usually take counts as having come in time.
        """
        with self._changed:
            return dict(self._latest)

    def health(self) -> LinkHealth:
        """How the link has been."""
        with self._changed:
            return self._record.health(time.monotonic())

    def _send_entries(self, form: Form, numbers: np.ndarray, age: float) -> None:
        milli = np.clip(np.rint(1000 * numbers), -MODULUS // 2, MODULUS // 2 - 1).astype(int)
        entries = [Entry(r, int(a), int(b)) for r, (a, b) in zip(self.robots, milli, strict=True)]
        old = min(round(1000 * age), MODULUS - 1)
        size = 1 if self._unicast else MOST_ENTRIES
        for start in range(0, len(entries), size):
            part = tuple(entries[start : start + size])
            self._send(
                lambda part=part, **header: Command(form=form, age=old, entries=part, **header),
                part[0].robot if self._unicast else None,
            )

    def _send(self, make: Callable[..., AnyFrame], robot: int | None = None) -> int:
        """Send the frame that `make` makes of session and sequence; returns the latter."""
        with self._changed:
            self._frames = (self._frames + 1) % MODULUS
            frame = make(session=self._session, sequence=self._frames)
            address = self._addresses.get(robot) if robot is not None else None
            # A stop waits for nothing, nor does the next one for it.
            frame_id = self._module.send(encode(frame), address, urgent=isinstance(frame, Stop))
            if frame_id is None:
                return self._frames
            if address is not None:
                self._awaited.add(frame_id)
            now = time.monotonic()
            self._record.note_sent(frame.session, frame.sequence, robot, now)
            return self._frames

    def _insist(self, kind: Kind, timeout: float, goes_on: Callable[[], bool]) -> tuple[int, ...]:
        """Send a stop or an arm until all robots have acknowledged it, or time is up."""
        require_non_negative("timeout", timeout)
        make = Stop if kind == Kind.STOP else Arm
        end = time.monotonic() + timeout
        sent: list[tuple[int, int]] = []
        with self._changed:
            while goes_on():
                sequence = self._send(lambda **header: make(**header))
                sent.append((self._session, sequence))
                self._record.retried += len(sent) > 1
                pause = max(min(_RETRY[kind], end - time.monotonic()), 0.0)
                done = self._changed.wait_for(
                    lambda: not goes_on() or len(self._who(kind, sent)) == len(self.robots), pause
                )
                if done or time.monotonic() >= end:
                    break
            answered = self._who(kind, sent)
            self._record.acknowledged += len(answered)
            self._record.lost += len(self.robots) - len(answered)
            return answered

    def _who(self, kind: Kind, sent: list[tuple[int, int]]) -> tuple[int, ...]:
        """Robots that have acknowledged one of the frames, by session and sequence number."""
        return tuple(
            robot
            for robot in self.robots
            if any((kind, *each, robot) in self._acknowledged for each in sent)
        )

    def _take_payload(self, payload: bytes, address: bytes, rssi: int) -> None:
        now = time.monotonic()
        with self._changed:
            self._record.rssi = rssi
            try:
                frame = decode(payload)
            except FrameError:
                self._record.refused += 1
                return
            self._record.received += 1
            if isinstance(frame, Telemetry):
                self._addresses[frame.robot] = address
                late = self._record.note_progress(_progress(frame), now)
                self._latest[frame.robot] = _report(now - late, frame)
                self.on_report()
            elif isinstance(frame, Acknowledgement):
                what = (frame.kind, frame.session, frame.acknowledged, frame.robot)
                self._acknowledged.add(what)
                self._changed.notify_all()

    def _take_status(self, frame_id: int, delivered: bool) -> None:
        with self._changed:
            if frame_id in self._awaited:
                self._awaited.remove(frame_id)
                self._record.acknowledged += delivered
                self._record.lost += not delivered


def _report(time: float, telemetry: Telemetry) -> RobotReport:
    """What a frame reports, in SI units."""
    left, middle_left, middle_right, right = telemetry.ranges
    return RobotReport(
        time=time,
        state=telemetry.state,
        flags=telemetry.flags,
        counts=telemetry.counts,
        ranges=(left / 1000, middle_left / 1000, middle_right / 1000, right / 1000),
        battery=telemetry.battery / 1000,
    )


def _progress(telemetry: Telemetry) -> Progress:
    answered = (telemetry.session, telemetry.last_sequence)
    return Progress(telemetry.robot, *answered, telemetry.hold, telemetry.taken)
