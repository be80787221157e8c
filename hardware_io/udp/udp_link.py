"""The work station's end of the datagrams to small boards."""

import os
import time
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ..links.datagram_link import DatagramLink, NoMessage
from ..links.link_record import Progress
from ..links.reporting_link import Order, What
from ..links.robot_clock import RobotClock
from ..links.robot_link import LinkError, RobotReport
from .datagrams import (
    MODULUS,
    NO_RANGE,
    DatagramError,
    OrderDatagram,
    OrderKind,
    ReportDatagram,
    decode_report,
    encode_order,
)

# After which silence boards stop by themselves [s]; one that says it takes longer is not armed.
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
    # Of its clock, unwrapped [ms].
    latest: int
    ours: RobotClock = field(default_factory=RobotClock)

    def note(self, came: float, clock: int) -> float:
        """Take note of a report; returns by how much it was later than the fastest [s]."""
        self.latest += _signed(clock - self.latest)
        return self.ours.late(came, 1e-3 * self.latest)

    def at(self, time: float) -> int:
        """What the clock shows at a time, or less: by the fastest report's way [ms]."""
        return round(1000 * (time - self.ours.behind)) % MODULUS


class UdpLink(DatagramLink):
    """Commands to small boards, a datagram to each, and their reports; see `datagrams`.

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
            LinkError: A robot says that it would go on for longer in silence than it may.
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
        """How late a report is [s].

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
    """A difference of two numbers that go round, from -2^31 on."""
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
