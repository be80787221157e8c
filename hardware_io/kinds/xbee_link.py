"""The work station's end of the radio: commands out, telemetry in, emergency stop.

Frames are payloads of an XBee module (802.15.4, API mode), which digi-xbee drives.
"""

import contextlib
import logging
import math
import os
import termios
import threading
import time
from collections.abc import Callable, Sequence

import numpy as np
from digi.xbee.devices import Raw802Device
from digi.xbee.exception import XBeeException
from digi.xbee.models.address import XBee64BitAddress
from digi.xbee.models.status import TransmitStatus
from digi.xbee.packets.base import XBeeAPIPacket
from digi.xbee.packets.raw import RX64Packet, TX64Packet, TXStatusPacket
from serial import SerialException, SerialTimeoutException

from ...systems.numerics.errors import require_non_negative
from ..links.link_record import LinkRecord, Progress
from ..links.robot_link import OLDEST_POSES, LinkError, LinkHealth, RobotLink, RobotReport
from .xbee_frames import (
    MODULUS,
    MOST_ENTRIES,
    Acknowledgement,
    AnyFrame,
    Arm,
    Command,
    Entry,
    Form,
    FrameError,
    Heartbeat,
    Kind,
    Stop,
    Telemetry,
    decode,
    encode,
)

# How long a module may take to answer when it is opened [s].
_PATIENCE = 3
# How long the serial line may take to accept a frame, which lasts some 20 ms on the line [s].
_WRITE_TIMEOUT = 0.1
# Most frames that the module has not confirmed; more would wait in buffers, and arrive too old.
_MOST_UNCONFIRMED = 4
# If the module confirms no frame for this long, it is given up [s].
_SILENCE = 0.5


class RadioError(LinkError):
    """No radio, no module that answers, or a module that went away."""


class XBeePort:
    """A serial port with an XBee module, which sends and receives payloads; a context manager.

    Args:
        port: Serial device, as /dev/ttyUSB0.
        baud_rate: Baud rate of the module.
        on_payload: Called with payload, 64-bit address of the sender and RSSI [dBm], in a thread
            of digi-xbee.
        on_status: Called with a frame id and whether the payload was delivered.
    """

    def __init__(
        self,
        port: str,
        baud_rate: int,
        on_payload: Callable[[bytes, bytes, int], None],
        on_status: Callable[[int, bool], None],
    ) -> None:
        self.port = port
        self._baud_rate = baud_rate
        self._on_payload, self._on_status = on_payload, on_status
        self._device: Raw802Device | None = None
        # Sending times of the unconfirmed frames, by id [s].
        self._unconfirmed: dict[int, float] = {}
        self._confirmed = -math.inf

    def __enter__(self) -> "XBeePort":
        # Without logging set up, digi-xbee would print on stderr what it also raises.
        logging.getLogger("digi").addHandler(logging.NullHandler())
        device = Raw802Device(self.port, self._baud_rate, _sync_ops_timeout=_PATIENCE)
        try:
            device.open()
        except SerialException as error:
            raise RadioError(f"no radio at {self.port}: {_reason(error)}") from None
        except XBeeException as error:
            device.close()
            raise RadioError(
                f"no 802.15.4 XBee module in API mode answers at {self.port} with "
                f"{self._baud_rate} baud: {_reason(error)}"
            ) from None
        # Do not wait long on a line that accepts nothing.
        if device.serial_port is not None:
            device.serial_port.write_timeout = _WRITE_TIMEOUT
        device.add_packet_received_callback(self._receive)
        self._device = device
        return self

    def __exit__(self, *_: object) -> None:
        device, self._device = self._device, None
        if device is not None:
            device.del_packet_received_callback(self._receive)
            with contextlib.suppress(SerialException, OSError, termios.error):
                if device.serial_port is not None:
                    device.serial_port.reset_output_buffer()
            device.close()

    def send(
        self, payload: bytes, address: bytes | None = None, *, urgent: bool = False
    ) -> int | None:
        """Hand a payload to the module, for one 64-bit address or for all; returns its frame id.

        While the module has not confirmed four frames, only urgent ones are sent. None is returned
        if the frame was not sent, or the line did not accept it in time.

        Raises:
            RadioError: The port is not open, its module has gone, or has confirmed no frame for
                half a second.
        """
        device = self._device
        if device is None:
            raise RadioError(f"the radio at {self.port} is not open: use it in a `with` statement")
        to = XBee64BitAddress(address) if address else XBee64BitAddress.BROADCAST_ADDRESS
        now = time.monotonic()
        if not (urgent or self._has_room(now)):
            return None
        frame_id = device.get_next_frame_id()
        self._unconfirmed[frame_id] = now
        try:
            device.send_packet(TX64Packet(frame_id, to, 0, rf_data=payload))
        except SerialTimeoutException:
            # No error yet: this thread may have been late. A dead line shows by confirming nothing.
            return None
        except (XBeeException, SerialException, OSError) as error:
            raise RadioError(f"the radio at {self.port} has gone: {_reason(error)}") from None
        return frame_id

    def _has_room(self, now: float) -> bool:
        """Whether one more frame may be under way."""
        sent = list(self._unconfirmed.values())
        if len(sent) < _MOST_UNCONFIRMED:
            return True
        if now - max(self._confirmed, min(sent)) <= _SILENCE:
            return False
        if self._confirmed < min(sent):
            raise RadioError(f"the radio at {self.port} has confirmed no frame for {_SILENCE} s")
        # Their confirmations were lost.
        self._unconfirmed.clear()
        return True

    def _receive(self, packet: XBeeAPIPacket) -> None:
        if isinstance(packet, RX64Packet):
            address = bytes(packet.x64bit_source_addr.address)
            self._on_payload(bytes(packet.rf_data or b""), address, -packet.rssi)
        elif isinstance(packet, TXStatusPacket):
            self._confirmed = time.monotonic()
            self._unconfirmed.pop(packet.frame_id, None)
            self._on_status(packet.frame_id, packet.transmit_status == TransmitStatus.SUCCESS)


def _reason(error: Exception) -> str:
    """First line of what an exception says."""
    return (str(error).splitlines() or [type(error).__name__])[0]


BAUD_RATE = 57600
# Time between tries [s]: short for a stop, which must be in time even if several frames in a row
# are lost; an arm is in no hurry.
_RETRY = {Kind.STOP: 0.02, Kind.ARM: 0.08}


class RadioLink(RobotLink):
    """Commands to a team of robots and telemetry from them, by one XBee module.

    An arm also opens a new session. Robots stop by themselves when they hear nothing for 170 ms.

    Args:
        port: Serial device of the module, as /dev/ttyUSB0.
        robots: Their numbers, in the order of the commands; 0 to 254.
        baud_rate: Of the module.
        unicast: Whether each robot gets a frame of its own, which the modules acknowledge and
            repeat once its address is known; otherwise one unrepeated frame goes to all.

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
        """See `RobotLink`; frames, stops and arms included, have their own sequence numbers.

        Args:
            speeds: Forward, shape (n,) [m/s].
            turn_rates: Shape (n,) [rad/s].
            sequence: Number of the command.
            deadline: As in `RobotLink` [s]; robots are told the age of the poses instead.

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

        A report whose round trip took longer than usual is dated back by the excess.
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
            # A stop is sent even while earlier frames are unconfirmed.
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
