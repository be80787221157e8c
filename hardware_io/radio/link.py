"""The work station's end of the radio: commands out, telemetry in, emergency stop."""

import os
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ...systems.numerics.errors import require, require_non_negative
from .frames import FrameError, decode, encode
from .link_record import LinkRecord, LinkStatistics
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
    require_robots,
)
from .xbee_port import RadioError, XBeePort

BAUD_RATE = 57600
# Between one try and the next [s]. A stop may lose several frames in a row and still be in time; an
# arm is in no hurry.
_RETRY = {Kind.STOP: 0.02, Kind.ARM: 0.08}


@dataclass(frozen=True)
class Receipt:
    """Telemetry with the time at which it came, by time.monotonic [s].

    What came later than round trips usually take counts as having come in time.
    """

    time: float
    telemetry: Telemetry


class RadioLink:
    """Commands to a team of robots and telemetry from them, by one XBee module.

    A context manager; leaving it stops the robots. All methods may be called from several threads.
    Robots drive only after `arm`, which also opens a new session, and stop by themselves when they
    hear nothing for 170 ms.

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
        self.robots = require_robots(robots)
        self._unicast = unicast
        self._module = XBeePort(port, baud_rate, self._take_payload, self._take_status)
        self._changed = threading.Condition(threading.RLock())
        self._session = int.from_bytes(os.urandom(2), "little")
        self._sequence = 0
        self._stops = self._stops_at_arming = 0
        self._record = LinkRecord(self.robots)
        self._latest: dict[int, Receipt] = {}
        self._addresses: dict[int, bytes] = {}
        self._acknowledged: set[tuple[Kind, int, int, int]] = set()
        self._awaited: set[int] = set()

    def __enter__(self) -> "RadioLink":
        self._module.__enter__()
        return self

    def __exit__(self, *exception: object) -> None:
        try:
            self.stop(timeout=0.3)
        except RadioError:
            # Not in the place of what went wrong before.
            if exception[0] is None:
                raise
        finally:
            self._module.__exit__(*exception)

    def arm(self, timeout: float = 1.0) -> tuple[int, ...]:
        """Let the robots drive; returns those that have acknowledged it within a time [s].

        A `stop` in another thread ends it.

        Args:
            timeout: How long to wait [s].
        """
        with self._changed:
            self._session = (self._session + 1) % MODULUS
            self._sequence = 0
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

    def send_commands(
        self,
        velocities: np.ndarray,
        valid: np.ndarray | None = None,
        age: float = 0.0,
    ) -> int:
        """Send every robot its forward speed and turn rate.

        Args:
            velocities: Shape (n, 2) [m/s], [rad/s].
            valid: Whether each is to be followed, shape (n,); the others get a speed of zero.
            age: Of the poses they were computed from [s]; robots follow none older than 0.3 s.

        Returns:
            Sequence number of the last frame.

        Raises:
            InvalidInput: Shapes do not fit, or a valid number is not finite.
            RadioError: The module has gone.
        """
        return self._send_entries(Form.TWIST, velocities, valid, age)

    def send_wheel_speeds(
        self, speeds: np.ndarray, valid: np.ndarray | None = None, age: float = 0.0
    ) -> int:
        """Send every robot the speeds of its left and right wheel, shape (n, 2) [m/s].

        Args:
            speeds: Shape (n, 2) [m/s].
            valid: To which robots, shape (n,); None: all.
            age: Of the poses that they were computed from [s].
        """
        return self._send_entries(Form.WHEELS, speeds, valid, age)

    def heartbeat(self) -> int:
        """Tell the robots that the work station is there; returns the sequence number."""
        return self._send(lambda **header: Heartbeat(**header))

    def telemetry(self) -> dict[int, Receipt]:
        """The latest report of every robot that was heard."""
        with self._changed:
            return dict(self._latest)

    def statistics(self) -> LinkStatistics:
        """How the link has been."""
        with self._changed:
            return self._record.statistics(time.monotonic())

    def _send_entries(
        self, form: Form, numbers: np.ndarray, valid: np.ndarray | None, age: float
    ) -> int:
        count = len(self.robots)
        numbers = np.asarray(numbers, dtype=float)
        require(numbers.shape == (count, 2), "velocities", f"have shape ({count}, 2)", numbers)
        valid = np.ones(count, bool) if valid is None else np.asarray(valid, dtype=bool)
        require(valid.shape == (count,), "valid", f"have shape ({count},)", valid)
        numbers = np.where(valid[:, None], numbers, 0.0)
        require(bool(np.isfinite(numbers).all()), "velocities", "be finite", numbers)
        require_non_negative("age", age)
        milli = np.clip(np.rint(1000 * numbers), -MODULUS // 2, MODULUS // 2 - 1).astype(int)
        entries = [Entry(r, int(a), int(b)) for r, (a, b) in zip(self.robots, milli, strict=True)]
        old = min(round(1000 * age), MODULUS - 1)
        size = 1 if self._unicast else MOST_ENTRIES
        sequence = 0
        for start in range(0, count, size):
            part = tuple(entries[start : start + size])
            sequence = self._send(
                lambda part=part, **header: Command(form=form, age=old, entries=part, **header),
                part[0].robot if self._unicast else None,
            )
        return sequence

    def _send(self, make: Callable[..., AnyFrame], robot: int | None = None) -> int:
        """Send the frame that `make` makes of session and sequence; returns the latter."""
        with self._changed:
            self._sequence = (self._sequence + 1) % MODULUS
            frame = make(session=self._session, sequence=self._sequence)
            address = self._addresses.get(robot) if robot is not None else None
            # A stop waits for nothing, nor does the next one for it.
            frame_id = self._module.send(encode(frame), address, urgent=isinstance(frame, Stop))
            if frame_id is None:
                return self._sequence
            if address is not None:
                self._awaited.add(frame_id)
            now = time.monotonic()
            self._record.note_sent(frame.session, frame.sequence, robot, now)
            return self._sequence

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
                late = self._record.note_telemetry(frame, now)
                self._latest[frame.robot] = Receipt(now - late, frame)
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
