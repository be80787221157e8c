"""The serial side of an XBee module in API mode 2: frames, escaped, with their checksums.

A frame is 0x7E, u16 length (high byte first), data, and a checksum that makes the data's sum 0xFF
modulo 256; after the first byte 0x7E, 0x7D, 0x11 and 0x13 are sent as 0x7D and the byte with bit 5
flipped. Source: Digi, XBee/XBee-PRO RF Modules (802.15.4) user guide 90000982, chapter "API
operation".
"""

from collections.abc import Iterator

START, ESCAPE, FLIP = 0x7E, 0x7D, 0x20
_ESCAPED = frozenset((START, ESCAPE, 0x11, 0x13))
LONGEST = 128


def api_frame(data: bytes) -> bytes:
    """Bytes on the line of a frame with this data."""
    plain = len(data).to_bytes(2, "big") + data + bytes([0xFF - sum(data) % 256])
    line = bytearray([START])
    for byte in plain:
        line += bytes([ESCAPE, byte ^ FLIP]) if byte in _ESCAPED else bytes([byte])
    return bytes(line)


class ApiParser:
    """Finds frames in a stream; bytes that are no frame are passed over."""

    def __init__(self) -> None:
        self._plain: bytearray | None = None
        self._escaped = False

    def take(self, stream: bytes) -> Iterator[bytes]:
        """Data of each frame that these bytes end."""
        for byte in stream:
            if byte == START:
                self._plain, self._escaped = bytearray(), False
            elif self._plain is None:
                continue
            elif byte == ESCAPE:
                self._escaped = True
            else:
                self._plain.append(byte ^ FLIP if self._escaped else byte)
                self._escaped = False
                data = self._finished()
                if data is not None:
                    yield data

    def _finished(self) -> bytes | None:
        """Data of the frame, if it has all its bytes and the right sum."""
        plain = self._plain
        if plain is None or len(plain) < 2:
            return None
        length = int.from_bytes(plain[:2], "big")
        if not 0 < length <= LONGEST:
            self._plain = None
            return None
        if len(plain) < length + 3:
            return None
        self._plain = None
        return bytes(plain[2:-1]) if sum(plain[2:]) % 256 == 0xFF else None
