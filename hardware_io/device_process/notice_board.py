"""The newest of something, from one process to another, neither of which waits for the other."""

import mmap
import struct
import tempfile
import zlib
from typing import Any

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
