"""A run recorded as MCAP: our samples, bit-exact, and standard messages for other tools.

The file has the profile `ros2`. Its first channels are ours, in this order:

======= ================ ================================================================
channel topic            message
======= ================ ================================================================
1       /about           std_msgs/String: what a log says of itself, in JSON
2       /log/samples     time [s] and the samples of all ports in order, all float64
3       /log/memory      time [s] and what the diagram keeps, in order, all float64
4, ...  one a picture    sensor_msgs/CompressedImage: PNG; after them what other tools see
======= ================ ================================================================

The file defines the types of channels 2 and 3, with a field for each port. A chunk holds a second
of the run; each of the first two holds a copy of /about. After a damaged chunk, reading goes on at
the next intact one: chunks are found by their own bytes, not by the index or by lengths.
"""

import json
import re
import struct
import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np

from ...diagrams.outputs import RunRecord
from ...diagrams.rosbag.bag import CDR, RosBag, nanoseconds, require_mcap
from .log_records import ABOUT, LONGEST, MEMORY, PICTURE, SAMPLES, Record

MAGIC = b"\x89MCAP0\r\n"
_ABOUT, _SAMPLES, _MEMORY, _FIRST_PICTURE = 1, 2, 3, 4
_TOPICS = {_ABOUT: "/about", _SAMPLES: "/log/samples", _MEMORY: "/log/memory"}
# Opcodes of MCAP, and the head of a record.
_FOOTER, _MESSAGE, _CHUNK, _MESSAGE_INDEX, _DATA_END, _LAST_OPCODE = 2, 5, 6, 7, 15, 15
_HEAD = struct.Struct("<BQ")
# Head of a chunk: first and last time, size and checksum of its content; then its compression.
_CHUNK_HEAD = struct.Struct("<QQQI")
_ZSTD = struct.pack("<I", 4) + b"zstd"
_MESSAGE_HEAD = struct.Struct("<HIQQ")
# Sizes of the whole footer, and of the record that ends the data.
_FOOTER_SIZE, _DATA_END_SIZE = 29, 13


class Beside(Protocol):
    """Writes messages for other tools, in addition to the samples."""

    def begin(self, bag: RosBag) -> None:
        """Write what holds for the whole run."""
        ...

    def tick(self, bag: RosBag, time: float, samples: Mapping[str, np.ndarray]) -> None:
        """Write messages made from the samples of all ports at a time [s], each shape (size,)."""
        ...


class McapRunWriter(RunRecord):
    """Writes a log as MCAP: a crash of the program loses the last second of the run at most.

    Args:
        path: Path of the log; must not exist.
        ports: Sizes of the ports by name, in the order of the samples.
        pictures: Names of the ports of pictures.
        memory: Sizes of the diagram's states, kept from tick to tick, by the names of its systems.
        about: Further information on the run, ready for JSON.
        beside: Writes messages for other tools.

    Raises:
        InvalidInput: The file exists or cannot be written, or the extra is not installed.
    """

    def __init__(
        self,
        path: Path,
        *,
        ports: Mapping[str, int],
        pictures: tuple[str, ...] = (),
        memory: Mapping[str, int] | None = None,
        about: Mapping[str, Any] | None = None,
        beside: Beside | None = None,
    ) -> None:
        self.ports, self.pictures = dict(ports), tuple(pictures)
        self._sizes = {_SAMPLES: sum(self.ports.values()), _MEMORY: sum((memory or {}).values())}
        self._splits = np.cumsum(list(self.ports.values()))[:-1]
        self._beside = beside
        header = {
            "ports": self.ports,
            "pictures": self.pictures,
            "memory": dict(memory or {}),
            "about": about or {},
        }
        bag = self._bag = RosBag(path)
        bag.declare(_TOPICS[_ABOUT], "std_msgs/msg/String")
        bag.declare(_TOPICS[_SAMPLES], "sightfield/msg/Samples", _definition(self.ports))
        bag.declare(_TOPICS[_MEMORY], "sightfield/msg/Memory", _definition(memory or {}))
        for name in self.pictures:
            bag.declare(_topic(name), "sensor_msgs/msg/CompressedImage")
        # Twice, in a chunk each: without the header the samples could not be interpreted.
        for _ in range(2):
            bag.about(json.dumps(header))
            bag.flush()
        if beside is not None:
            beside.begin(bag)

    def samples(self, time: float, values: np.ndarray) -> None:
        """Write a sample of every port, joined in order, shape (sum of the sizes,).

        Args:
            time: [s].
            values: Shape (sum of the sizes,).
        """
        self._numbers(_SAMPLES, time, values)
        if self._beside is not None:
            columns = np.split(values, self._splits) if self.ports else []
            self._beside.tick(self._bag, time, dict(zip(self.ports, columns, strict=True)))

    def picture(self, time: float, port: str, png: bytes) -> None:
        """Write a picture that a port has shown from now on, as PNG.

        Args:
            time: [s].
            port: Its name.
            png: The picture's file.
        """
        self._bag.picture(_topic(port), time, port.partition(".")[0], png)

    def memory(self, time: float, values: np.ndarray) -> None:
        """Write the diagram's state after a tick, from which a replay can resume after damage.

        Args:
            time: [s].
            values: Shape (sum of the sizes,).
        """
        self._numbers(_MEMORY, time, values)

    def close(self) -> None:
        """See `RunRecord`."""
        self._bag.close()

    def leave(self) -> None:
        """See `RunRecord`."""
        self._bag.leave()

    def _numbers(self, channel: int, time: float, values: np.ndarray) -> None:
        assert values.shape == (self._sizes[channel],)
        body = struct.pack("<d", time) + values.astype("<f8").tobytes()
        self._bag.write(_TOPICS[channel], time, CDR + body)


def is_mcap(data: bytes) -> bool:
    """Whether a log is an MCAP file, even if its first bytes are damaged.

    Args:
        data: The log's bytes.
    """
    return data.startswith(MAGIC) or _ZSTD in data


class FoundRecords(NamedTuple):
    """What an MCAP log holds.

    Attributes:
        records: Records of the intact chunks, as in `log_records`.
        complete: Whether the writer closed it.
        damaged: Number of damaged chunks; 1 if only an index is damaged.
        unread: Bytes of an unfinished record at the end.
    """

    records: list[Record]
    complete: bool
    damaged: int
    unread: int


def read_mcap_records(data: bytes) -> FoundRecords:
    """Read all intact chunks of an MCAP log.

    Args:
        data: The log's bytes.

    Raises:
        InvalidInput: The extra is not installed.
    """
    require_mcap()
    found: list[Record] = []
    damaged, at, pictures = 0, len(MAGIC), 0
    # One chunk at a time: unpacked they are several times as large as the file.
    for number, chunk in enumerate(_chunks(data)):
        lost, at_end = _lost_within(data, at, chunk.start, header=number == 0)
        # A wrong length makes the gap uncountable: it counts as one chunk at least.
        damaged += max(lost, 0 if at_end else 1)
        at = chunk.end
        for record in _records_in(chunk, pictures):
            if record.kind == ABOUT:
                pictures = _number_of_pictures(record.body)
            found.append(record)
    # MCAP's times are whole nanoseconds: give each picture the exact time of its tick's samples.
    exact = {nanoseconds(each.time): each.time for each in found if each.kind == SAMPLES}
    found = [
        each._replace(time=exact.get(nanoseconds(each.time), each.time))
        if each.kind == PICTURE
        else each
        for each in found
    ]
    complete = data.endswith(MAGIC) or _footer_at(data, len(data) - _FOOTER_SIZE - len(MAGIC))
    if complete:
        lost, _ = _lost_within(data, at, len(data) - _FOOTER_SIZE - len(MAGIC))
        return FoundRecords(found, True, damaged + lost or int(not _sums_agree(data)), 0)
    lost, unread = _cut_off(data, at)
    return FoundRecords(found, False, damaged + lost, unread)


class _WholeChunk(NamedTuple):
    """A chunk whose checksum is right: its content, and its place in the file."""

    body: bytes
    start: int
    end: int


def _chunks(data: bytes) -> Iterator[_WholeChunk]:
    """Yield the intact chunks in order."""
    at, ahead = 0, _HEAD.size + _CHUNK_HEAD.size
    while (where := data.find(_ZSTD, at)) >= 0:
        chunk = _chunk_at(data, where - ahead) if where - ahead >= at else None
        if chunk is not None:
            yield chunk
        at = where + 1 if chunk is None else chunk.end


def _chunk_at(data: bytes, start: int) -> _WholeChunk | None:
    import zstandard

    opcode, length = _HEAD.unpack_from(data, start)
    head = start + _HEAD.size
    _, _, size, checksum = _CHUNK_HEAD.unpack_from(data, head)
    at, end = head + _CHUNK_HEAD.size + len(_ZSTD), head + length
    if opcode != _CHUNK or end > len(data) or at + 8 > end or size > LONGEST:
        return None
    (packed,) = struct.unpack_from("<Q", data, at)
    if at + 8 + packed != end:
        return None
    try:
        # Do not unpack a frame that claims another size.
        if zstandard.frame_content_size(data[at + 8 : end]) != size:
            return None
        body = zstandard.ZstdDecompressor().decompress(data[at + 8 : end], max_output_size=size)
    except zstandard.ZstdError:
        return None
    whole = len(body) == size and zlib.crc32(body) == checksum
    return _WholeChunk(body, start, end) if whole else None


def _number_of_pictures(header: bytes) -> int:
    """Number of picture ports by a log's header; 0 if the header is invalid."""
    try:
        return len(json.loads(header)["pictures"])
    except (ValueError, KeyError, TypeError, RecursionError):
        return 0


def _records_in(chunk: _WholeChunk, pictures: int) -> Iterator[Record]:
    """Yield our records in a chunk, for a log with this number of picture ports."""
    body, at = chunk.body, 0
    while at + _HEAD.size <= len(body):
        opcode, length = _HEAD.unpack_from(body, at)
        at, data = at + _HEAD.size + length, body[at + _HEAD.size : at + _HEAD.size + length]
        if opcode != _MESSAGE or len(data) < _MESSAGE_HEAD.size + len(CDR):
            continue
        channel, _, stamp, _ = _MESSAGE_HEAD.unpack_from(data)
        message = data[_MESSAGE_HEAD.size :]
        if channel == _ABOUT and len(message) > 8:
            yield Record(ABOUT, 0.0, message[8:-1], chunk.start, chunk.end)
        elif channel in (_SAMPLES, _MEMORY) and len(message) >= 12:
            (time,) = struct.unpack_from("<d", message, 4)
            kind = SAMPLES if channel == _SAMPLES else MEMORY
            yield Record(kind, time, message[12:], chunk.start, chunk.end)
        elif _FIRST_PICTURE <= channel < _FIRST_PICTURE + pictures:
            number = (channel - _FIRST_PICTURE).to_bytes(2, "little")
            yield Record(PICTURE, stamp * 1e-9, number + _png(message), chunk.start, chunk.end)


def _png(message: bytes) -> bytes:
    """PNG in a CompressedImage message, after the header's stamp and two aligned strings."""
    at = len(CDR) + 8
    for _ in range(2):
        at += 4 + int.from_bytes(message[at : at + 4], "little")
        at += -at % 4
    size = int.from_bytes(message[at : at + 4], "little")
    return message[at + 4 : at + 4 + size]


def _lost_within(data: bytes, at: int, end: int, *, header: bool = False) -> tuple[int, bool]:
    """Number of chunks in a gap between intact ones, and whether the records end with the gap."""
    lost = 0
    while at + _HEAD.size <= end:
        opcode, length = _HEAD.unpack_from(data, at)
        if not (opcode in (_CHUNK, _MESSAGE_INDEX) or (header and opcode == 1)):
            break
        lost += opcode == _CHUNK
        at += _HEAD.size + length
    return lost, at == end


def _cut_off(data: bytes, at: int) -> tuple[int, int]:
    """Number of damaged chunks after the last intact one, and bytes of an unfinished record."""
    lost = 0
    while at + _HEAD.size <= len(data):
        opcode, length = _HEAD.unpack_from(data, at)
        if not 0 < opcode <= _LAST_OPCODE:
            return lost + 1, 0
        if at + _HEAD.size + length > len(data):
            break
        lost += opcode == _CHUNK
        at += _HEAD.size + length
    return lost, max(len(data) - at, 0)


def _footer_at(data: bytes, at: int) -> bool:
    """Whether a valid footer is at this place, whatever comes after it."""
    if at < 0 or _HEAD.unpack_from(data, at) != (_FOOTER, 20):
        return False
    summary, _, checksum = struct.unpack_from("<QQI", data, at + _HEAD.size)
    return zlib.crc32(data[summary : at + 25]) == checksum


def _sums_agree(data: bytes) -> bool:
    """Whether footer and data checksum of a closed file are right."""
    footer = len(data) - _FOOTER_SIZE - len(MAGIC)
    if not (data.endswith(MAGIC) and _footer_at(data, footer)):
        return False
    (summary,) = struct.unpack_from("<Q", data, footer + _HEAD.size)
    end = summary - _DATA_END_SIZE
    said = struct.pack("<BQI", _DATA_END, 4, zlib.crc32(data[:end]))
    return data[end:summary] == said


def _topic(port: str) -> str:
    return "/" + port.replace(".", "/")


def _definition(sizes: Mapping[str, int]) -> str:
    """Definition of a ROS type with the time and float64 arrays: its CDR is the bare numbers."""
    taken = {"time": "float64 time"}
    for name, size in sizes.items():
        plain = re.sub("[^a-z0-9]+", "_", name.lower()).strip("_")
        field = plain if plain[:1].isalpha() else f"x_{plain}".rstrip("_")
        if field in taken:
            field += f"_{len(taken)}"
        if size:
            taken[field] = f"float64[{size}] {field}"
    return "\n".join(taken.values()) + "\n"
