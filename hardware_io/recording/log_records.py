"""A log that is written while the run goes on, and is intact up to the moment of a crash.

A record is its header, `HEADER`, and as many bytes as that says:

====== ======== ====================================================
bytes  type     what
====== ======== ====================================================
0-3    uint32   length of the body
4-7    uint32   CRC-32 of the rest of the header and the body
8      uint8    kind: 0 about, 1 samples, 2 picture, 3 end, 4 memory
9-16   float64  time in the diagram [s]
====== ======== ====================================================

All little-endian. Kind 0 comes first, twice, and its body is JSON. The body of kind 1 is the
samples of all ports in the order named in the JSON, float64; of kind 2 the number of the port,
uint16, and a PNG picture; of kind 3 nothing; of kind 4 the diagram's state, kept from tick to tick,
in the order named in the JSON, float64. After a damaged record, reading goes on at the next intact
one.
"""

import json
import os
import struct
import time
import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...diagrams.outputs import RunRecord, open_record
from ...systems.numerics.errors import InvalidInput

MAGIC = b"sightfield run log, version 1\n"
HEADER = struct.Struct("<IIBd")
ABOUT, SAMPLES, PICTURE, END, MEMORY = range(5)
# Greatest length of a body; a larger one means damage [bytes].
LONGEST = 1 << 26
# Number of bytes searched at a time for the next intact record.
_STRETCH = 1 << 20


class Record(NamedTuple):
    """One record.

    Attributes:
        kind: ABOUT, SAMPLES, PICTURE, END or MEMORY.
        time: Time in the diagram [s].
        body: Content, according to the kind.
        start: Where it starts in the data.
        end: Where it ends.
    """

    kind: int
    time: float
    body: bytes
    start: int
    end: int


def pack(kind: int, time: float, body: bytes) -> bytes:
    """A record as it is written."""
    rest = struct.pack("<Bd", kind, time) + body
    return struct.pack("<II", len(body), zlib.crc32(rest)) + rest


def records(data: bytes) -> Iterator[Record]:
    """Yield the intact records of a log, from the first of kind ABOUT on; none if it is no log.

    Args:
        data: The log's bytes.
    """
    at = len(MAGIC) if data.startswith(MAGIC) else 0
    begun = False
    while at < len(data):
        record = _record_at(data, at)
        if record is None or not (begun or record.kind == ABOUT):
            record = _next_record(data, at + 1, begun)
        if record is None:
            return
        begun = True
        yield record
        at = record.end


def lost_records(data: bytes, found: list[Record], sizes: Mapping[int, int]) -> tuple[int, int]:
    """Least number of damaged records, and number of bytes of an unfinished record at the end.

    Args:
        data: The log's bytes.
        found: Its intact records.
        sizes: Sizes of bodies, for kinds whose bodies are all of one size.
    """
    lost, at = 0, 0 if found[0].start < len(MAGIC) or not data.startswith(MAGIC) else len(MAGIC)
    for record in found:
        lost += _records_within(data, at, record.start)
        at = record.end
    if _is_cut_off(data, at, sizes):
        return lost, len(data) - at
    return lost + _records_within(data, at, len(data)), 0


def _record_at(data: bytes, at: int) -> Record | None:
    """The intact record that starts at this place; None if there is none."""
    if at + HEADER.size > len(data):
        return None
    length, checksum, kind, time = HEADER.unpack_from(data, at)
    end = at + HEADER.size + length
    if length > LONGEST or end > len(data) or kind > MEMORY:
        return None
    if zlib.crc32(memoryview(data)[at + 8 : end]) != checksum:
        return None
    return Record(kind, time, data[at + HEADER.size : end], at, end)


def _next_record(data: bytes, at: int, begun: bool) -> Record | None:
    """The first intact record that starts at this place or later."""
    for start in _headers(data, at, begun):
        record = _record_at(data, start)
        if record is not None:
            return record
    return None


def _headers(data: bytes, at: int, begun: bool) -> Iterator[int]:
    """Places where a header may start: its kind is valid, and its length fits the kind."""
    last = len(data) - HEADER.size
    while at <= last:
        count = min(_STRETCH, last + 1 - at)
        part = np.frombuffer(data, dtype=np.uint8, count=count + 8, offset=at)
        length = np.zeros(count, dtype=np.int64)
        for k in range(4):
            length += part[k : k + count].astype(np.int64) << 8 * k
        kind = part[8 : 8 + count]
        if begun:
            fits = ((kind == SAMPLES) | (kind == MEMORY)) & (length > 0) & (length % 8 == 0)
            fits |= ((kind == PICTURE) & (length > 2)) | ((kind == END) & (length == 0))
        else:
            fits = (kind == ABOUT) & (length > 0)
        room = last - at - np.arange(count)
        for where in np.flatnonzero(fits & (length <= np.minimum(LONGEST, room))):
            yield at + int(where)
        at += count


def _records_within(data: bytes, start: int, end: int) -> int:
    """Number of records in a damaged stretch, by their headers if those are consistent, or one."""
    count, at = 0, start
    while at + HEADER.size <= end:
        length = HEADER.unpack_from(data, at)[0]
        at += HEADER.size + length
        count += 1
    return count if at == end else 1


def _is_cut_off(data: bytes, at: int, sizes: Mapping[int, int]) -> bool:
    """Whether the log ends within a record that starts here and seems otherwise undamaged."""
    if at + HEADER.size > len(data):
        return at < len(data)
    length, _, kind, _ = HEADER.unpack_from(data, at)
    fits = kind == PICTURE or sizes.get(kind) == length
    return fits and length <= LONGEST and at + HEADER.size + length > len(data)


# Interval of syncs to disk: what a failure of the machine itself may lose [s].
_SYNC_PERIOD = 1.0


class RunWriter(RunRecord):
    """Writes a log, each record at once: a crash of the program loses none of them.

    Args:
        path: Path of the log; must not exist.
        ports: Sizes of the ports by name, in the order of the samples.
        pictures: Names of the ports of pictures.
        memory: Sizes of the diagram's states, kept from tick to tick, by the names of its systems.
        about: Further information on the run, ready for JSON.

    Raises:
        InvalidInput: The file exists, or cannot be written.
    """

    def __init__(
        self,
        path: Path,
        *,
        ports: Mapping[str, int],
        pictures: tuple[str, ...] = (),
        memory: Mapping[str, int] | None = None,
        about: Mapping[str, Any] | None = None,
    ) -> None:
        self.path = path
        self.ports = dict(ports)
        self.pictures = tuple(pictures)
        self._size = sum(self.ports.values())
        self._synced = time.monotonic()
        self._file = open_record(path, buffered=False)
        self._memory_size = sum((memory or {}).values())
        header = {
            "ports": self.ports,
            "pictures": self.pictures,
            "memory": dict(memory or {}),
            "about": about or {},
        }
        # Twice: without the header the samples could not be interpreted.
        self._write(MAGIC + 2 * pack(ABOUT, 0.0, json.dumps(header).encode()))

    def samples(self, time: float, values: np.ndarray) -> None:
        """Write a sample of every port, joined in order, shape (sum of the sizes,).

        Args:
            time: [s].
            values: Shape (sum of the sizes,).
        """
        assert values.shape == (self._size,)
        self._write(pack(SAMPLES, time, values.astype("<f8").tobytes()))

    def picture(self, time: float, port: str, png: bytes) -> None:
        """Write a picture that a port has shown from now on, as PNG.

        Args:
            time: [s].
            port: Its name.
            png: The picture's file.
        """
        number = self.pictures.index(port).to_bytes(2, "little")
        self._write(pack(PICTURE, time, number + png))

    def memory(self, time: float, values: np.ndarray) -> None:
        """Write the diagram's state after a tick, from which a replay can resume after damage.

        Args:
            time: [s].
            values: Shape (sum of the sizes,).
        """
        assert values.shape == (self._memory_size,)
        self._write(pack(MEMORY, time, values.astype("<f8").tobytes()))

    def close(self) -> None:
        """See `RunRecord`."""
        if not self._file.closed:
            self._write(pack(END, 0.0, b""))
            os.fsync(self._file.fileno())
            self._file.close()

    def leave(self) -> None:
        """See `RunRecord`."""
        self._file.close()

    def _write(self, data: bytes) -> None:
        view = memoryview(data)
        try:
            # An unbuffered file may write only a part at a time.
            while view:
                view = view[self._file.write(view) :]
            if time.monotonic() - self._synced > _SYNC_PERIOD:
                os.fsync(self._file.fileno())
                self._synced = time.monotonic()
        except OSError as error:
            raise InvalidInput(
                f"`log` must be on a disk with room; got {self.path} ({error.strerror})"
            ) from None
