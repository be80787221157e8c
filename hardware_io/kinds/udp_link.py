"""The work station's end of datagrams to small boards on Wi-Fi: their layout, and the link.

Little-endian, every field at a multiple of its size, so that both are plain structures in C:

======  ======  ====================================================================
offset  type    order, to one robot: 28 bytes
======  ======  ====================================================================
0       u8 x 2  "SF"
2       u8      1, the version of this layout
3       u8      1 hail, 2 command, 3 stop, 4 arm
4       u32     session: drawn by the work station at its start, told by an arm
8       u32     sequence number of the work station, counted modulo 2^32
12      u32     deadline, by the robot's own clock [ms]; 0 in a hail and in a stop
16      i16     forward speed [mm/s]; 0 but in a command
18      i16     turn rate, left positive [mrad/s]; 0 but in a command
20      u16     number of the robot
22      u16     0
24      u32     CRC-32 (IEEE 802.3, as in zlib) of all bytes before it
======  ======  ====================================================================

======  =======  ===================================================================
offset  type     report, of one robot: 60 bytes
======  =======  ===================================================================
0       u8 x 2   "SF"
2       u8       1, the version of this layout
3       u8       5
4       u32      session that the robot listens to; 0 before it was armed
8       u32      sequence number of the robot, from 1 after each start
12      u32      the robot's clock [ms], counted modulo 2^32
16      u32      boot: drawn by the robot at its start
20      u32      sequence number of the last order that it took
24      i32 x 2  counts of the left and the right encoder
32      u16 x 4  infrared ranges, from left to right [mm]; 65535: none
40      u16      battery [mV]; 0: not known
42      u16      hold: since that order was taken [ms], 65535 at most
44      u16      orders taken, modulo 65536
46      u16      orders refused, modulo 65536
48      u16      silence after which the robot stops by itself [ms]
50      u16      number of the robot
52      u8       state: 0 disarmed, 1 idle, 2 driving, 3 lost, 4 stopped
53      u8       flags: 1 low battery, 2 reset by a watchdog, 4 motor saturated, 8 and
                 16 left and right motor cut off
54      u16      0
56      u32      CRC-32 of all bytes before it
======  =======  ===================================================================

A deadline is given by the robot's clock, known from its reports, so that a board can tell that an
order is late without synchronising its clock. Datagrams and messages correspond one to one.
"""

import os
import struct
import time
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from enum import IntEnum

import numpy as np

from ...systems.numerics.errors import SightfieldError, require
from ..links.link_record import Progress, RobotClock
from ..links.reporting_link import DatagramLink, NoMessage, Order, What
from ..links.robot_link import LinkError, RobotFlag, RobotReport, RobotState

MODULUS = 1 << 32
# Value of a range that is not measured [mm].
NO_RANGE = 65535

_MARK, _VERSION, _REPORT = b"SF", 1, 5
_HEAD = struct.Struct("<2sBB")
_ORDER = struct.Struct("<IIIhhHH")
_REPORT_BODY = struct.Struct("<IIIIIii4HHHHHHHBBH")
_SHORTS = ("battery", "hold", "taken", "refused", "silence", "robot")


class DatagramError(SightfieldError):
    """The bytes are not a valid datagram; the message says why."""


class OrderKind(IntEnum):
    """What a robot is told."""

    HAIL = 1
    COMMAND = 2
    STOP = 3
    ARM = 4


@dataclass(frozen=True, kw_only=True)
class OrderDatagram:
    """An order to a robot; fields as in the module's table.

    Attributes:
        kind: Kind of order.
        session, sequence, deadline: As in the table.
        speed: Forward speed [mm/s].
        turn_rate: Turn rate [mrad/s].
        robot: Number of the robot.

    Raises:
        InvalidInput: A number does not fit its field, or speeds are told without a command.
    """

    kind: OrderKind
    session: int
    sequence: int
    deadline: int = 0
    speed: int = 0
    turn_rate: int = 0
    robot: int

    def __post_init__(self) -> None:
        for name in ("session", "sequence", "deadline"):
            _require_within(name, getattr(self, name), 0, MODULUS - 1)
        for name in ("speed", "turn_rate"):
            _require_within(name, getattr(self, name), -(1 << 15), (1 << 15) - 1)
        _require_within("robot", self.robot, 0, (1 << 16) - 1)
        quiet = self.kind != OrderKind.COMMAND
        still = (self.speed, self.turn_rate) == (0, 0)
        require(still or not quiet, "speed", "be zero but in a command", self.speed)
        timeless = self.kind in (OrderKind.HAIL, OrderKind.STOP)
        require(self.deadline == 0 or not timeless, "deadline", "be zero here", self.deadline)


@dataclass(frozen=True, kw_only=True)
class ReportDatagram:
    """A report of a robot; fields as in the module's table.

    Attributes:
        session, sequence, clock, boot, last_sequence: As in the table.
        counts: Counts of the left and the right encoder.
        ranges: Ranges of the four sensors [mm].
        battery: Battery voltage [mV].
        hold, silence: As in the table [ms].
        taken, refused: Numbers of orders taken and refused.
        robot: Number of the robot.
        state: State of the robot.
        flags: Flags of what is wrong.

    Raises:
        InvalidInput: A number does not fit its field.
    """

    session: int
    sequence: int
    clock: int
    boot: int
    last_sequence: int
    counts: tuple[int, int]
    ranges: tuple[int, int, int, int]
    battery: int
    hold: int
    taken: int
    refused: int
    silence: int
    robot: int
    state: RobotState
    flags: RobotFlag

    def __post_init__(self) -> None:
        for name in ("session", "sequence", "clock", "boot", "last_sequence"):
            _require_within(name, getattr(self, name), 0, MODULUS - 1)
        for name in _SHORTS:
            _require_within(name, getattr(self, name), 0, (1 << 16) - 1)
        for count in self.counts:
            _require_within("counts", count, -(1 << 31), (1 << 31) - 1)
        for each in self.ranges:
            _require_within("ranges", each, 0, NO_RANGE)
        _require_within("flags", self.flags, 0, 255)


def encode_order(order: OrderDatagram) -> bytes:
    """The 28 bytes of an order."""
    body = _ORDER.pack(
        *(order.session, order.sequence, order.deadline),
        *(order.speed, order.turn_rate, order.robot, 0),
    )
    return _checked(_HEAD.pack(_MARK, _VERSION, order.kind) + body)


def encode_report(report: ReportDatagram) -> bytes:
    """The 60 bytes of a report."""
    body = _REPORT_BODY.pack(
        *(report.session, report.sequence, report.clock, report.boot, report.last_sequence),
        *(*report.counts, *report.ranges),
        *(getattr(report, name) for name in _SHORTS),
        *(report.state, report.flags, 0),
    )
    return _checked(_HEAD.pack(_MARK, _VERSION, _REPORT) + body)


def decode_order(data: bytes) -> OrderDatagram:
    """The order in a datagram.

    Args:
        data: The datagram.

    Raises:
        DatagramError: It is no order: wrong length, mark, version, kind or checksum, or a field
            whose value is refused.
    """
    kind, body = _body(data, _ORDER.size)
    *numbers, rest = _ORDER.unpack(body)
    names = [each.name for each in fields(OrderDatagram)][1:]
    try:
        require(rest == 0, "the last field", "be 0", rest)
        return OrderDatagram(kind=OrderKind(kind), **dict(zip(names, numbers, strict=True)))
    except ValueError as error:
        raise DatagramError(f"an order has a wrong field: {error}") from None


def decode_report(data: bytes) -> ReportDatagram:
    """The report in a datagram.

    Args:
        data: The datagram.

    Raises:
        DatagramError: It is no report, or a value is refused; see `decode_order`.
    """
    kind, body = _body(data, _REPORT_BODY.size)
    found = _REPORT_BODY.unpack(body)
    heads = ("session", "sequence", "clock", "boot", "last_sequence")
    numbers = dict(zip((*heads, *_SHORTS), (*found[:5], *found[11:17]), strict=True))
    try:
        require(kind == _REPORT, "kind", f"be {_REPORT}", kind)
        require(found[19] == 0, "the last field", "be 0", found[19])
        return ReportDatagram(
            **numbers,
            counts=(found[5], found[6]),
            ranges=(found[7], found[8], found[9], found[10]),
            state=RobotState(found[17]),
            flags=RobotFlag(found[18]),
        )
    except ValueError as error:
        raise DatagramError(f"a report has a wrong field: {error}") from None


def _checked(data: bytes) -> bytes:
    return data + zlib.crc32(data).to_bytes(4, "little")


def _body(data: bytes, size: int) -> tuple[int, bytes]:
    """Check length, mark, version and checksum of a datagram; returns its kind and body."""
    data = bytes(data)
    whole = _HEAD.size + size + 4
    if len(data) != whole:
        raise DatagramError(f"such a datagram has {whole} bytes; got {len(data)}")
    mark, version, kind = _HEAD.unpack_from(data)
    if (mark, version) != (_MARK, _VERSION):
        raise DatagramError(f"a datagram begins with SF and version 1; got {data[:3].hex()}")
    if zlib.crc32(data[:-4]) != int.from_bytes(data[-4:], "little"):
        raise DatagramError("the checksum of a datagram does not fit its bytes")
    return kind, data[_HEAD.size : -4]


def _require_within(name: str, value: int, low: int, high: int) -> None:
    whole = isinstance(value, int) and not isinstance(value, bool)
    require(whole and low <= value <= high, name, f"be a whole number {low} to {high}", value)


# Longest silence after which a board may stop by itself [s]; if one reports longer, `arm` fails.
SILENCE = 0.2
_KINDS = {
    What.HAIL: OrderKind.HAIL,
    What.COMMAND: OrderKind.COMMAND,
    What.STOP: OrderKind.STOP,
    What.ARM: OrderKind.ARM,
}


@dataclass
class _Clock:
    """What is known of a robot's clock since it was started."""

    boot: int
    sequence: int
    # Latest reading of its clock, unwrapped [ms].
    latest: int
    ours: RobotClock = field(default_factory=RobotClock)

    def note(self, came: float, clock: int) -> float:
        """Take note of a report; returns its delay relative to the fastest one [s]."""
        self.latest += _signed(clock - self.latest)
        return self.ours.late(came, 1e-3 * self.latest)

    def at(self, time: float) -> int:
        """Reading of the clock at a time, too low by the delay of the fastest report [ms]."""
        return round(1000 * (time - self.ours.behind)) % MODULUS


class UdpLink(DatagramLink):
    """Commands to small boards, a datagram to each, and their reports; see the module's tables.

    Args:
        robots: Their numbers, in the order of the commands.
        addresses: Of each, as "192.168.1.21:5005".

    Raises:
        InvalidInput: See `DatagramLink`.
    """

    def __init__(self, robots: Sequence[int], addresses: Sequence[str]) -> None:
        super().__init__(robots, addresses, session=int.from_bytes(os.urandom(4), "little") or 1)
        self._clocks: dict[int, _Clock] = {}
        self._earlier: set[tuple[int, int]] = set()
        self._slow: dict[int, int] = {}

    def arm(self, timeout: float = 1.0) -> tuple[int, ...]:
        """See `RobotLink`.

        Args:
            timeout: How long to wait [s].

        Raises:
            LinkError: A robot reports that it stops by itself only after a longer silence.
        """
        answered = super().arm(timeout)
        for robot, silence in self._slow.items():
            self.stop()
            raise LinkError(
                f"robot {robot} must stop by itself after {SILENCE:g} s of silence; it says "
                f"{silence / 1000:g} s"
            )
        return answered

    def encode(self, robot: int, order: Order) -> bytes:
        """See `DatagramLink`; a robot whose clock is not known yet is asked for it."""
        kind, deadline = _KINDS[order.what], 0
        if kind in (OrderKind.COMMAND, OrderKind.ARM):
            clock = self._clocks.get(robot)
            if clock is None:
                kind = OrderKind.HAIL
            else:
                deadline = clock.at(order.deadline)
        drives = kind == OrderKind.COMMAND
        return encode_order(
            OrderDatagram(
                kind=kind,
                session=self.session,
                sequence=order.sequence % MODULUS,
                deadline=deadline,
                speed=_milli(order.speed) if drives else 0,
                turn_rate=_milli(order.turn_rate) if drives else 0,
                robot=robot,
            )
        )

    def decode(self, robot: int, data: bytes) -> None:
        """See `DatagramLink`.

        Args:
            robot: Number of the robot.
            data: The datagram.
        """
        now = time.monotonic()
        try:
            report = decode_report(data)
        except DatagramError as error:
            raise NoMessage(str(error)) from None
        if report.robot != robot:
            raise NoMessage("from a robot of another number")
        with self._changed:
            late = self._note_clock(report, now)
            if not 0 < report.silence <= 1000 * SILENCE:
                self._slow[robot] = report.silence
            else:
                self._slow.pop(robot, None)
            answered = (report.session, report.last_sequence)
            progress = Progress(robot, *answered, report.hold, report.taken)
            self.heard(robot, _in_si(report, now - late), progress)

    def _note_clock(self, report: ReportDatagram, now: float) -> float:
        """Update the robot's clock by a report; returns how late the report is [s].

        Raises:
            NoMessage: It came twice, was overtaken, or is from before the robot's last start.
        """
        clock = self._clocks.get(report.robot)
        if clock is None or clock.boot != report.boot:
            if (report.robot, report.boot) in self._earlier:
                raise NoMessage("from before the robot's last start")
            if clock is not None:
                self._earlier.add((report.robot, clock.boot))
            clock = _Clock(report.boot, report.sequence, report.clock)
            self._clocks[report.robot] = clock
        elif _signed(report.sequence - clock.sequence) <= 0:
            raise NoMessage("not newer than the last one")
        clock.sequence = report.sequence
        return clock.note(now, report.clock)


def _signed(difference: int) -> int:
    """Difference of two numbers modulo 2^32, as a signed number from -2^31 on."""
    return (difference + MODULUS // 2) % MODULUS - MODULUS // 2


def _milli(value: float) -> int:
    return int(np.clip(round(1000 * value), -(1 << 15), (1 << 15) - 1))


def _in_si(report: ReportDatagram, time: float) -> RobotReport:
    ranges = [np.inf if each == NO_RANGE else each / 1000 for each in report.ranges]
    return RobotReport(
        time=time,
        state=report.state,
        flags=report.flags,
        counts=report.counts,
        ranges=(ranges[0], ranges[1], ranges[2], ranges[3]),
        battery=report.battery / 1000,
    )
