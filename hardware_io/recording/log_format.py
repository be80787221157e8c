"""How a run is written down: a line that says so, then records, each with its own checksum.

A record is its header, `HEADER`, and as many bytes as that says:

====== ======== ====================================================
bytes  type     what
====== ======== ====================================================
0-3    uint32   length of the body
4-7    uint32   CRC-32 of the rest of the header and the body
8      uint8    kind: 0 about, 1 samples, 2 picture, 3 end
9-16   float64  time in the diagram [s]
====== ======== ====================================================

All little-endian. The body of kind 0, which is first, is JSON; of kind 1 the samples of all ports
in the order that it names, float64; of kind 2 the number of the port, uint16, and a PNG picture;
of kind 3 nothing. What follows a record that is cut off or damaged is not read.
"""

import struct
import zlib
from collections.abc import Iterator
from typing import NamedTuple

MAGIC = b"sightfield run log, version 1\n"
HEADER = struct.Struct("<IIBd")
ABOUT, SAMPLES, PICTURE, END = range(4)
# No record is longer: a length beyond is damage.
_LONGEST = 1 << 26


class Record(NamedTuple):
    """One record.

    Attributes:
        kind: ABOUT, SAMPLES, PICTURE or END.
        time: In the diagram [s].
        body: As the kind says.
        end: Where it ends in the data.
    """

    kind: int
    time: float
    body: bytes
    end: int


def pack(kind: int, time: float, body: bytes) -> bytes:
    """A record as it is written."""
    rest = struct.pack("<Bd", kind, time) + body
    return struct.pack("<II", len(body), zlib.crc32(rest)) + rest


def records(data: bytes) -> Iterator[Record]:
    """The whole records of a log, up to the first that is not; none if it is no log.

    Args:
        data: The log's bytes.
    """
    if not data.startswith(MAGIC):
        return
    at = len(MAGIC)
    while at + HEADER.size <= len(data):
        length, checksum, kind, time = HEADER.unpack_from(data, at)
        end = at + HEADER.size + length
        if length > _LONGEST or end > len(data) or zlib.crc32(data[at + 8 : end]) != checksum:
            return
        yield Record(kind, time, data[at + HEADER.size : end], end)
        at = end
