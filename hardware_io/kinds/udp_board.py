"""Reference program in Python of a small board on Wi-Fi, to be ported to the real board."""

import math
from dataclasses import dataclass

from ..emulation.stand_in_laboratory import Sensed
from ..links.robot_link import RobotFlag, RobotState
from .udp_link import (
    MODULUS,
    NO_RANGE,
    DatagramError,
    OrderDatagram,
    OrderKind,
    ReportDatagram,
    decode_order,
    encode_report,
)

# Between two reports [s].
_REPORT_PERIOD = 0.05
# A deadline further ahead than this must come from another clock, and is refused [ms].
_FURTHEST = 1000
_LOW_BATTERY = 6.6
_ARMED = (RobotState.IDLE, RobotState.DRIVING, RobotState.LOST)


@dataclass
class _Order:
    """The last that was taken, and when [s]."""

    session: int = 0
    sequence: int = 0
    time: float = -math.inf


class UdpBoard:
    """A board's program: states and rules are those of the XBee robots' firmware (docs/radio.md).

    A stop is taken from anybody, however old it is. Arms and commands count only if they are newer
    than the last order taken of their session, and come before their deadline. A command that comes
    later only proves that the work station is there; an arm that comes later is ignored.

    Args:
        robot: Its number.
        silence: Silence after which it stops by itself [s].
        boot: Random number drawn at its start.
        start: First value of its clock, which wraps around [ms].
    """

    def __init__(self, robot: int, silence: float, *, boot: int, start: int = 0) -> None:
        self._robot, self._silence = robot, silence
        self._boot, self._start = boot, start
        self.state = RobotState.DISARMED
        self._last, self._commanded = _Order(), -math.inf
        self._targets = (0.0, 0.0)
        self._taken = self._refused = self._sequence = 0
        self._next_report, self._asked = 0.0, False

    def take(self, payload: bytes, now: float) -> None:
        """Take a datagram.

        Args:
            payload: What came.
            now: Since the laboratory began [s].
        """
        try:
            order = decode_order(payload)
        except DatagramError:
            self._refused += 1
            return
        if order.robot != self._robot:
            self._refused += 1
            return
        ours = self._last.session == order.session and order.session != 0
        newer = 0 < (order.sequence - self._last.sequence) % MODULUS < MODULUS // 2
        self._asked |= order.kind != OrderKind.COMMAND
        if order.kind == OrderKind.STOP:
            if newer or not ours:
                self._note(order, now)
            self.state, self._commanded = RobotState.STOPPED, -math.inf
        elif order.kind == OrderKind.ARM:
            if (newer or not ours) and self._is_in_time(order, now):
                self._note(order, now)
                self.state, self._commanded = RobotState.IDLE, -math.inf
        elif order.kind == OrderKind.COMMAND and ours and newer:
            self._note(order, now)
            if self.state in _ARMED and self._is_in_time(order, now):
                self._targets, self._commanded = (order.speed / 1000, order.turn_rate / 1000), now

    def targets(self, now: float) -> tuple[float, float] | None:
        """Forward speed [m/s] and turn rate [rad/s]; None: the motors are cut.

        Args:
            now: Since the laboratory began [s].
        """
        if self.state in _ARMED:
            if now - self._last.time >= self._silence:
                self.state = RobotState.LOST
            elif now - self._commanded < self._silence:
                self.state = RobotState.DRIVING
            else:
                self.state = RobotState.IDLE
        return self._targets if self.state == RobotState.DRIVING else None

    def reports(self, now: float, sensed: Sensed) -> list[bytes]:
        """Reports that are due: twenty times a second, and at once to whoever asks.

        Args:
            now: Since the laboratory began [s].
            sensed: By its sensors.
        """
        if now < self._next_report and not self._asked:
            return []
        self._asked = False
        self._next_report = max(self._next_report + _REPORT_PERIOD, now)
        self._sequence += 1
        hold = min(round(1000 * min(now - self._last.time, 65.535)), 65535)
        low = RobotFlag.LOW_BATTERY if sensed.battery < _LOW_BATTERY else RobotFlag(0)
        ranges = [round(1000 * each) if each < 65 else NO_RANGE for each in sensed.ranges]
        report = ReportDatagram(
            session=self._last.session,
            sequence=self._sequence % MODULUS,
            clock=self._clock(now),
            boot=self._boot,
            last_sequence=self._last.sequence,
            counts=sensed.counts,
            ranges=(ranges[0], ranges[1], ranges[2], ranges[3]),
            battery=round(1000 * sensed.battery),
            hold=hold,
            taken=self._taken % 65536,
            refused=self._refused % 65536,
            silence=round(1000 * self._silence),
            robot=self._robot,
            state=self.state,
            flags=low,
        )
        return [encode_report(report)]

    def _clock(self, now: float) -> int:
        return (round(1000 * now) + self._start) % MODULUS

    def _is_in_time(self, order: OrderDatagram, now: float) -> bool:
        left = (order.deadline - self._clock(now) + MODULUS // 2) % MODULUS - MODULUS // 2
        return 0 <= left <= _FURTHEST

    def _note(self, order: OrderDatagram, now: float) -> None:
        self._last = _Order(order.session, order.sequence, now)
        self._taken += 1
