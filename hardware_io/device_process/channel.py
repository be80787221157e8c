"""How a controller and the process that drives its robots talk, without ever waiting.

Words go by a socket; the newest of something by memory that both share.
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
        kind: Of the robots, by name.
        fleet: They, and how they are reached.
        path: Where Python finds modules.
    """

    kind: str
    fleet: RobotFleet
    path: tuple[str, ...]


@dataclass(frozen=True)
class Drive:
    """Drive, until something else is said.

    Attributes:
        speeds: Of each robot [m/s].
        turn_rates: Of each [rad/s].
        deadline: When robots may begin to at the latest, by time.monotonic [s].
    """

    speeds: tuple[float, ...]
    turn_rates: tuple[float, ...]
    deadline: float


@dataclass(frozen=True)
class Ask:
    """Do something that is answered.

    Attributes:
        number: Of the question.
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
    """To a question; number 0 to the first word.

    Attributes:
        number: Of the question.
        robots: That have done it.
        failure: Why it cannot be done, or empty.
        misused: Whether that is the fault of who asks.
    """

    number: int
    robots: tuple[int, ...] = ()
    failure: str = ""
    misused: bool = False


@dataclass(frozen=True)
class Notice:
    """How things stand.

    Attributes:
        time: By time.monotonic [s]; no two notices are alike.
        reports: The latest of every robot that was heard.
        health: Of the link.
        failure: Why it has gone, or empty.
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
    """One end of a pair of sockets; messages are Python's own, since both ends are one program.

    Args:
        end: A connected stream socket.
    """

    def __init__(self, end: socket.socket) -> None:
        end.setblocking(False)
        self._end = end
        # What the other side has not taken of a message, and what has come of one.
        self._rest, self._came = b"", b""
        self._sending = threading.Lock()

    def offer(self, message: Any) -> bool:
        """Send a message, at once; False: the other side takes nothing now, and it is dropped.

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
        """Messages that have come, after a wait until there is one; for one thread.

        Args:
            patience: How long to wait [s].

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
        """Go; the other side sees it."""
        self._end.close()

    def _push(self, data: bytes) -> bool:
        """Whether all of it was taken; what was not is kept for the next time."""
        try:
            taken = self._end.send(data)
        except BlockingIOError:
            taken = 0
        except OSError:
            raise Ended from None
        self._rest = data[taken:]
        return not self._rest


# Of the whole: the number of the newest notice. Of each place: the number of the notice there,
# its length and its checksum.
_NEWEST, _HEAD = struct.Struct("<Q"), struct.Struct("<QII")
# For a notice [bytes]: the reports of a team take some thousands. A reader is overtaken when all
# places have been written since it began.
_PLACE, _PLACES = 1 << 16, 8
_SIZE = _NEWEST.size + _PLACES * (_HEAD.size + _PLACE)
# How often a reader tries again that was overtaken.
_TRIES = 50


class NoticeBoard:
    """A piece of memory that one process writes and others read.

    Notices go to eight places in turn, with number and checksum: a reader that is overtaken sees
    that, and looks again. A writer that dies in the middle leaves the notice before.

    Attributes:
        file: Number of the open file behind it, which a child process may be given.

    Args:
        file: Of a board that another process made; None: a new one.
    """

    def __init__(self, file: int | None = None) -> None:
        self._own: Any = None
        if file is None:
            # Open as long as the board is.
            self._own = tempfile.TemporaryFile()  # noqa: SIM115
            self._own.truncate(_SIZE)
        self.file = int(self._own.fileno() if file is None else file)
        self._memory = mmap.mmap(self.file, _SIZE)
        self._number = self._newest()

    def write(self, notice: bytes) -> None:
        """Put up a notice in place of the last; for one thread of one process.

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
        """The newest notice; None: there is none, or all were overtaken."""
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
        """Let go of it."""
        self._memory.close()
        if self._own is not None:
            self._own.close()

    def _newest(self) -> int:
        return _NEWEST.unpack(self._memory[: _NEWEST.size])[0]

    @staticmethod
    def _place(number: int) -> int:
        return _NEWEST.size + number % _PLACES * (_HEAD.size + _PLACE)
