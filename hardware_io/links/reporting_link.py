"""Links to robots whose reports tell their state, over an IP network or otherwise.

Stops and arms are repeated until the reports show their effect.
"""

import contextlib
import errno
import math
import socket
import threading
import time
from abc import abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from ...systems.numerics.errors import require, require_non_negative
from .link_record import LinkRecord, Progress
from .robot_link import OLDEST_POSES, LinkError, LinkHealth, RobotLink, RobotReport, RobotState


class What(Enum):
    """Kinds of orders to a robot."""

    HAIL = "to report"
    COMMAND = "to drive"
    STOP = "to stop until it is armed"
    ARM = "that it may drive"


@dataclass(frozen=True)
class Order:
    """A message to one robot.

    Attributes:
        what: Kind of order.
        sequence: Sequence number, rising; the same for all robots of one command.
        deadline: Latest time at which the robot may begin to obey, by time.monotonic [s].
        speed: Forward speed [m/s].
        turn_rate: Turn rate, left positive [rad/s].
    """

    what: What
    sequence: int
    deadline: float = math.inf
    speed: float = 0.0
    turn_rate: float = 0.0


@dataclass
class _Heard:
    """Newest report of one robot, when it came [s], and the last order that it had taken."""

    report: RobotReport | None = None
    came: float = -math.inf
    answers: float = math.inf


# Time between tries [s]: short for a stop, which must be in time even if several in a row are lost;
# an arm is in no hurry.
_RETRY = {What.STOP: 0.02, What.ARM: 0.08}
# States by which a report shows that a stop or an arm was taken.
_SHOWN = {
    What.STOP: {RobotState.STOPPED, RobotState.DISARMED},
    What.ARM: {RobotState.IDLE, RobotState.DRIVING, RobotState.LOST},
}


class ReportingLink(RobotLink):
    """Base of links whose robots report their state.

    A subclass opens and closes the connection, sends orders (`transmit`), and hands on reports
    (`heard`, `heard_nothing_of_use`). Commands are sent only while robots are armed; otherwise
    robots are asked for reports.

    Args:
        robots: Their numbers, in the order of the commands.
        session: Session of this link, for kinds that have one; it tells apart orders of the same
            number.
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
        """Send an order to a robot without waiting; it may be lost on its way.

        Args:
            robot: Its number.
            order: The order.

        Raises:
            LinkError: The link to the robots was lost.
        """

    def heard(self, robot: int, report: RobotReport, progress: Progress | None = None) -> None:
        """Take note of a report, which must be newer than those before.

        Args:
            robot: Its number; a robot that is not of this link is ignored.
            report: What it reports.
            progress: Which orders it has taken, if it reports that.
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
        """Take note of a message that was invalid, came twice, or was overtaken by newer ones."""
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
            deadline: As in `RobotLink` [s].
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
        """Whether the robots were armed over this link, and not stopped since."""
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


# The longest datagram that is read [bytes]: one Ethernet frame's.
_LONGEST = 1500
# How often the receiving thread looks whether the link was closed [s].
_LOOK = 0.1
# Errors of a network that is busy for a moment: the datagram is lost.
_BUSY = {errno.EAGAIN, errno.ENOBUFS, errno.EINTR}


class NoMessage(ValueError):
    """A datagram is not from a robot, is invalid, came twice, or was overtaken by a newer one."""


class DatagramLink(ReportingLink):
    """Orders and reports as datagrams (UDP), one socket for all robots.

    A subclass defines the bytes (`encode`, `decode`). Datagrams from other addresses than the
    robots' are refused. Nothing is encrypted or authenticated: anyone on the network can stop the
    robots, or drive them.

    Args:
        robots: Their numbers, in the order of the commands.
        addresses: Of each robot, as "192.168.1.21:5005".
        session: As in `ReportingLink`.

    Raises:
        InvalidInput: Addresses are malformed, repeated, or not one for each robot.
    """

    def __init__(self, robots: Sequence[int], addresses: Sequence[str], session: int = 0) -> None:
        super().__init__(robots, session)
        count = len(self.robots)
        wish = f"name {count} robots, as 192.168.1.21:5005"
        require(len(addresses) == count, "radio.addresses", wish, list(addresses) or "none")
        require(len(set(addresses)) == count, "radio.addresses", "differ", list(addresses))
        self._named = [_host_and_port(address) for address in addresses]
        self._addresses: dict[int, tuple[str, int]] = {}
        self._socket: socket.socket | None = None
        self._closing = threading.Event()
        self._thread: threading.Thread | None = None

    @abstractmethod
    def encode(self, robot: int, order: Order) -> bytes:
        """Encode an order; empty if there is nothing to send.

        Args:
            robot: Number of the robot.
            order: The order.
        """

    @abstractmethod
    def decode(self, robot: int, data: bytes) -> None:
        """Decode a datagram, and pass its report to `heard`.

        Args:
            robot: Number of the robot that has sent it.
            data: The datagram.

        Raises:
            NoMessage: It is invalid, came twice, or was overtaken.
        """

    def connect(self) -> None:
        """Look up the addresses, and open a socket.

        Raises:
            LinkError: An address is unknown.
        """
        for robot, (host, port) in zip(self.robots, self._named, strict=True):
            try:
                found = socket.getaddrinfo(host, port, socket.AF_INET, socket.SOCK_DGRAM)
            except OSError as error:
                raise LinkError(f"no robot {robot} at {host}:{port}: {error.strerror}") from None
            self._addresses[robot] = (str(found[0][4][0]), port)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.settimeout(_LOOK)
        self._closing.clear()
        self._thread = threading.Thread(target=self._listen, args=(self._socket,), daemon=True)
        self._thread.start()
        with contextlib.suppress(LinkError):
            self.heartbeat()

    def close(self) -> None:
        """End the thread that listens, and close the socket."""
        self._closing.set()
        if self._thread is not None:
            self._thread.join()
            self._thread = None
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def transmit(self, robot: int, order: Order) -> None:
        """See `ReportingLink`."""
        if self._socket is None:
            raise LinkError("the link is not open: use it in a `with` statement")
        data = self.encode(robot, order)
        if not data:
            return
        host, port = self._addresses[robot]
        try:
            self._socket.sendto(data, (host, port))
        except OSError as error:
            if error.errno not in _BUSY:
                raise LinkError(f"no way to {host}:{port}: {error.strerror}") from None

    def _listen(self, source: socket.socket) -> None:
        robots = {address: robot for robot, address in self._addresses.items()}
        while not self._closing.is_set():
            try:
                data, address = source.recvfrom(_LONGEST)
            except OSError:
                # Nothing came, or an ICMP error: an earlier datagram did not arrive.
                continue
            robot = robots.get(address)
            try:
                if robot is None:
                    raise NoMessage("from somebody else")
                self.decode(robot, data)
            except NoMessage:
                self.heard_nothing_of_use()


def _host_and_port(address: str) -> tuple[str, int]:
    host, _, port = address.rpartition(":")
    good = bool(host) and port.isascii() and port.isdigit() and 0 < int(port) < 1 << 16
    require(good, "radio.addresses", "be like 192.168.1.21:5005", address)
    return host, int(port)
