"""Posted pictures as files in memory; a file may hold anything, not only a picture."""

import struct
from contextlib import suppress

import cv2
import numpy as np

from ...errors import InvalidInput, require
from ...vision.estimation.pictures import as_rgb

_QUALITY = 92
# Larger files are refused [bytes].
LARGEST = 20_000_000
# JPEG's segments that hold the picture's size, and those without a length field.
_SIZES = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
_BARE = frozenset({0x01, *range(0xD0, 0xD9)})


def encode_picture(picture: np.ndarray) -> bytes:
    """A JPEG file of a picture: red, green, blue, shape (height, width, 3), uint8.

    Raises:
        InvalidInput: Not a picture.
    """
    bgr = cv2.cvtColor(as_rgb(picture), cv2.COLOR_RGB2BGR)
    done, data = cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])
    require(done, "picture", "be one that JPEG can hold", picture.shape)
    return data.tobytes()


def decode_picture(data: bytes, width: int, height: int) -> np.ndarray:
    """Decode red, green, blue of a PNG or JPEG file, shape (height, width, 3), uint8.

    The size is checked before decoding, so that a small file cannot fill the memory.

    Args:
        data: The file.
        width, height: Size that the picture must have [px].

    Raises:
        InvalidInput: Not a whole PNG or JPEG file, or a picture of another size.
    """
    require(isinstance(data, bytes), "picture", "be the bytes of a file", type(data).__name__)
    require(len(data) <= LARGEST, "picture", f"have at most {LARGEST} bytes", len(data))
    size = _size(data)
    if size is None:
        raise InvalidInput(f"`picture` must be a whole PNG or JPEG file; got {len(data)} bytes")
    got = f"{size[0]} x {size[1]}"
    require(size == (width, height), "picture", f"be {width} x {height} pixels", got)
    decoded = None
    with suppress(cv2.error):
        # Ignore the EXIF orientation: pixels are used as they are stored.
        flags = cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION
        decoded = cv2.imdecode(np.frombuffer(data, np.uint8), flags)
    if decoded is None or decoded.shape != (height, width, 3) or decoded.dtype != np.uint8:
        raise InvalidInput("`picture` must decode to 8-bit colours; got one that does not")
    return cv2.cvtColor(decoded, cv2.COLOR_BGR2RGB)


def _size(data: bytes) -> tuple[int, int] | None:
    """Width and height that a whole file states [px]; None if it is cut short or no picture."""
    if data.startswith(b"\x89PNG\r\n\x1a\n") and data[12:16] == b"IHDR" and len(data) >= 24:
        width, height = struct.unpack(">II", data[16:24])
        return (width, height) if data.rfind(b"IEND") > data.rfind(b"IDAT") > 0 else None
    # Coded data never holds a marker, so the end of the image comes after the last scan's start.
    if data.startswith(b"\xff\xd8") and data.rfind(b"\xff\xd9") > data.rfind(b"\xff\xda") > 0:
        return _jpeg_size(data)
    return None


def _jpeg_size(data: bytes) -> tuple[int, int] | None:
    """Width and height from a JPEG's frame header; None if it has none before its pixels."""
    at = 2
    while at + 9 <= len(data):
        if data[at] != 0xFF:
            return None
        marker = data[at + 1]
        if marker in _SIZES:
            height, width = struct.unpack(">HH", data[at + 5 : at + 9])
            return width, height
        if marker == 0xDA:
            return None
        if marker == 0xFF:
            at += 1
        elif marker in _BARE:
            at += 2
        else:
            at += 2 + struct.unpack(">H", data[at + 2 : at + 4])[0]
    return None
