"""Messages between two processes of this machine, sent without ever waiting."""

import pickle
import select
import socket
import struct
import threading
from typing import Any

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
