"""A link to robots each of which has an address on an IP network."""

import contextlib
import errno
import socket
import threading
from abc import abstractmethod
from collections.abc import Sequence

from ...systems.numerics.errors import require
from .reporting_link import Order, ReportingLink
from .robot_link import LinkError

# The longest datagram that is read [bytes]: one Ethernet frame's.
_LONGEST = 1500
# How often the receiving thread looks whether the link was closed [s].
_LOOK = 0.1
# Of a network that is busy for a moment: the datagram is lost.
_BUSY = {errno.EAGAIN, errno.ENOBUFS, errno.EINTR}


class NoMessage(ValueError):
    """A datagram that is none of a robot's, came twice, or was overtaken by a newer one."""


class DatagramLink(ReportingLink):
    """Orders and reports as datagrams (UDP), one socket for all robots.

    A kind says what the bytes are (`encode`, `decode`). Datagrams from other addresses than the
    robots' do not count. Nothing is encrypted and nobody's identity is proved: whoever is on the
    network can stop the robots, or drive them.

    Args:
        robots: Their numbers, in the order of the commands.
        addresses: Of each robot, as "192.168.1.21:5005".
        session: As of `ReportingLink`.

    Raises:
        InvalidInput: Addresses are none, too few, or come twice.
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
        """Bytes of an order; empty: there is nothing to send.

        Args:
            robot: Number of the robot.
            order: What it is told.
        """

    @abstractmethod
    def decode(self, robot: int, data: bytes) -> None:
        """Read a datagram, and hand on what it says by `heard`.

        Args:
            robot: Number of the robot that has sent it.
            data: The datagram.

        Raises:
            NoMessage: It is none, came twice, or was overtaken.
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
                # Nothing came, or word that a datagram did not arrive.
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
