"""Non-blocking communication between a controller and the process that drives its robots.

Messages go through a socket; the newest state goes through shared memory.
"""

import mmap
import pickle
import select
import socket
import struct
import tempfile
import threading
import zlib
from dataclasses import dataclass
from typing import Any

from ..kinds.robot_kind import RobotFleet
from ..links.robot_link import LinkHealth, RobotReport


@dataclass(frozen=True)
class Open:
    """Open the link.

    Attributes:
        kind: Name of the kind of robots.
        fleet: The robots, and how they are reached.
        path: Python's module search path (`sys.path`).
    """

    kind: str
    fleet: RobotFleet
    path: tuple[str, ...]


@dataclass(frozen=True)
class Drive:
    """Drive until the next message says otherwise.

    Attributes:
        speeds: Forward speed of each robot [m/s].
        turn_rates: Turn rate of each robot [rad/s].
        deadline: Latest time at which robots may begin to follow, by time.monotonic [s].
    """

    speeds: tuple[float, ...]
    turn_rates: tuple[float, ...]
    deadline: float


@dataclass(frozen=True)
class Ask:
    """Do something, and send an `Answer`.

    Attributes:
        number: Number of the question.
        what: "arm" or "stop".
        timeout: How long robots may take [s].
    """

    number: int
    what: str
    timeout: float


@dataclass(frozen=True)
class Hail:
    """Let robots report."""


@dataclass(frozen=True)
class ArmAgain:
    """Let robots drive again.

    Attributes:
        robots: Their numbers.
    """

    robots: tuple[int, ...]


@dataclass(frozen=True)
class Close:
    """Close the link, and end."""


@dataclass(frozen=True)
class Answer:
    """Answer to a question; number 0 answers the first message, `Open`.

    Attributes:
        number: Number of the question.
        robots: Robots that have done it.
        failure: Why it cannot be done, or empty.
        misused: Whether the failure is due to invalid input by the caller.
    """

    number: int
    robots: tuple[int, ...] = ()
    failure: str = ""
    misused: bool = False


@dataclass(frozen=True)
class Notice:
    """State of the link and its robots.

    Attributes:
        time: Time of writing, by time.monotonic [s]; it makes every notice differ from the last.
        reports: The latest report of every robot that was heard.
        health: Health of the link.
        failure: Why the link has failed, or empty.
    """

    time: float
    reports: dict[int, RobotReport]
    health: LinkHealth
    failure: str = ""


_LENGTH = struct.Struct("<I")
_CHUNK = 1 << 16


class Ended(Exception):
    """The other side has gone."""


class Channel:
    """One end of a pair of sockets; messages are pickled, since both ends are the same program.

    Args:
        end: A connected stream socket.
    """

    def __init__(self, end: socket.socket) -> None:
        end.setblocking(False)
        self._end = end
        # The unsent rest of an outgoing message, and the received part of an incoming one.
        self._rest, self._came = b"", b""
        self._sending = threading.Lock()

    def offer(self, message: Any) -> bool:
        """Send a message without waiting; False: the other side's buffer is full, it is dropped.

        Raises:
            Ended: The other side has gone.
        """
        data = pickle.dumps(message)
        with self._sending:
            if self._rest and not self._push(self._rest):
                return False
            self._push(_LENGTH.pack(len(data)) + data)
            return True

    def receive(self, patience: float) -> list[Any]:
        """Return the messages that have come, waiting for data; to be called from one thread only.

        Args:
            patience: How long to wait at most [s].

        Raises:
            Ended: The other side has gone.
        """
        if select.select([self._end], [], [], patience)[0]:
            try:
                data = self._end.recv(_CHUNK)
            except BlockingIOError:
                data = None
            except OSError:
                data = b""
            if data == b"":
                raise Ended
            self._came += data or b""
        found = []
        while len(self._came) >= _LENGTH.size:
            end = _LENGTH.size + _LENGTH.unpack_from(self._came)[0]
            if len(self._came) < end:
                break
            found.append(pickle.loads(self._came[_LENGTH.size : end]))
            self._came = self._came[end:]
        return found

    def close(self) -> None:
        """Close the socket; the other side then raises `Ended`."""
        self._end.close()

    def _push(self, data: bytes) -> bool:
        """Send data and keep the rest for the next time; returns whether all of it was sent."""
        try:
            taken = self._end.send(data)
        except BlockingIOError:
            taken = 0
        except OSError:
            raise Ended from None
        self._rest = data[taken:]
        return not self._rest


# The board begins with the number of the newest notice. Each place begins with the number of the
# notice there, its length and its checksum.
_NEWEST, _HEAD = struct.Struct("<Q"), struct.Struct("<QII")
# Room for a notice [bytes], of which the reports of a team take some thousands, and number of
# places. A reader is overtaken when all places have been written since it began.
_PLACE, _PLACES = 1 << 16, 8
_SIZE = _NEWEST.size + _PLACES * (_HEAD.size + _PLACE)
# How often a reader tries at most when it is overtaken.
_TRIES = 50


class NoticeBoard:
    """Shared memory that one process writes and others read.

    Notices go to eight places in turn, with number and checksum, by which a reader notices that it
    was overtaken, and reads again. If a writer dies while writing, the previous notice remains.

    Attributes:
        file: Descriptor of the file behind it, which can be passed to a child process.

    Args:
        file: Descriptor of a board that another process made; None: make a new one.
    """

    def __init__(self, file: int | None = None) -> None:
        self._own: Any = None
        if file is None:
            # The file stays open as long as the board.
            self._own = tempfile.TemporaryFile()  # noqa: SIM115
            self._own.truncate(_SIZE)
        self.file = int(self._own.fileno() if file is None else file)
        self._memory = mmap.mmap(self.file, _SIZE)
        self._number = self._newest()

    def write(self, notice: bytes) -> None:
        """Replace the last notice by a new one; to be called from one thread of one process only.

        Raises:
            ValueError: It is longer than 64 kB.
        """
        if len(notice) > _PLACE:
            raise ValueError(f"a notice must have {_PLACE} bytes at most; got {len(notice)}")
        number = self._number + 1
        at = self._place(number)
        head = _HEAD.pack(number, len(notice), zlib.crc32(notice))
        self._memory[at + _HEAD.size : at + _HEAD.size + len(notice)] = notice
        self._memory[at : at + _HEAD.size] = head
        self._memory[: _NEWEST.size] = _NEWEST.pack(number)
        self._number = number

    def read(self) -> bytes | None:
        """Return the newest notice; None: there is none, or every try was overtaken."""
        for _ in range(_TRIES):
            number = self._newest()
            if number == 0:
                return None
            at = self._place(number)
            found, length, checksum = _HEAD.unpack(self._memory[at : at + _HEAD.size])
            if found == number and length <= _PLACE:
                notice = self._memory[at + _HEAD.size : at + _HEAD.size + length]
                if zlib.crc32(notice) == checksum:
                    return notice
        return None

    def close(self) -> None:
        """Release the memory and, if this board made it, the file."""
        self._memory.close()
        if self._own is not None:
            self._own.close()

    def _newest(self) -> int:
        return _NEWEST.unpack(self._memory[: _NEWEST.size])[0]

    @staticmethod
    def _place(number: int) -> int:
        return _NEWEST.size + number % _PLACES * (_HEAD.size + _PLACE)
