"""Pictures as arrays and as files: what counts as one, and what is refused."""

import struct
import zlib
from contextlib import suppress
from pathlib import Path

import cv2
import numpy as np

from ...errors import InvalidInput, require
from ...files import read_input
from ..camera_models.camera_model import MOST_PIXELS

SUFFIXES = (".png", ".jpg", ".jpeg")


def as_rgb(picture: np.ndarray, name: str = "picture") -> np.ndarray:
    """The colours of a picture, shape (height, width, 3), uint8; an alpha channel is left out.

    Args:
        picture: Red, green, blue and perhaps alpha, shape (height, width, 3 or 4), uint8.
        name: What errors call it.

    Raises:
        InvalidInput: Another type or shape, or no pixels.
    """
    array = np.asarray(picture)
    require(array.dtype == np.uint8, name, "hold 8-bit values (uint8)", array.dtype)
    right = array.ndim == 3 and array.shape[2] in (3, 4) and array.size > 0
    require(right, name, "have the shape (height, width, 3 or 4)", array.shape)
    if array.shape[2] == 3:
        return np.ascontiguousarray(array)
    return cv2.cvtColor(np.ascontiguousarray(array), cv2.COLOR_RGBA2RGB)


def has_contrast(picture: np.ndarray) -> bool:
    """Whether not all pixels are equal.

    Args:
        picture: Shape (height, width, 3).
    """
    # A few pixels settle it for every real picture.
    return any(bool(np.any(pixels != picture[0, 0])) for pixels in (picture[::16, ::16], picture))


def require_size(picture: np.ndarray, width: int, height: int, name: str = "picture") -> None:
    """Refuse a picture of another size than the camera's [px].

    Args:
        picture: Shape (height, width, 3).
        width, height: Of the camera's pictures [px].
        name: Of the parameter, for the message.

    Raises:
        InvalidInput: It has another size.
    """
    got = f"{picture.shape[1]} x {picture.shape[0]}"
    require(picture.shape[:2] == (height, width), name, f"be {width} x {height} pixels", got)


def require_contrast(picture: np.ndarray, name: str = "picture") -> None:
    """Refuse a picture that is all one colour: a covered lens, an unplugged camera.

    Args:
        picture: Shape (height, width, 3).
        name: Of the parameter, for the message.

    Raises:
        InvalidInput: All pixels are equal.
    """
    got = f"one colour, {picture[0, 0].tolist()}"
    require(has_contrast(picture), name, "show something", got)


def load_picture(path: str | Path) -> np.ndarray:
    """Read a PNG or JPEG file as red, green, blue, shape (height, width, 3), uint8.

    Raises:
        InvalidInput: No file there, another format, a file that is cut short, damaged or does not
            decode, too many pixels, or another depth than 8 bits.
    """
    path = Path(path)
    require(path.suffix.lower() in SUFFIXES, "picture", f"end in {', '.join(SUFFIXES)}", path)
    data = read_input("picture", path)
    size = stated_size(data)
    if size is None:
        raise InvalidInput(f"`picture` must be a whole PNG or JPEG file; got {path}")
    words, (width, height) = f"have at most {MOST_PIXELS:,} pixels", size
    require(width * height <= MOST_PIXELS, "picture", words, f"{path}, {width} x {height}")
    decoded = None
    with suppress(cv2.error):
        decoded = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    if decoded is None:
        raise InvalidInput(f"`picture` must decode; got {path}")
    require(decoded.dtype == np.uint8, "picture", "hold 8-bit values (uint8)", decoded.dtype)
    require(decoded.ndim == 3, "picture", "have colours", f"{path}, which is grey")
    code = cv2.COLOR_BGRA2RGB if decoded.shape[2] == 4 else cv2.COLOR_BGR2RGB
    return cv2.cvtColor(decoded, code)


def save_picture(path: Path, picture: np.ndarray) -> None:
    """Write a picture as a PNG file.

    Args:
        path: Of the file.
        picture: Shape (height, width, 3), uint8.

    Raises:
        InvalidInput: Not a picture.
        OSError: The file cannot be written.
    """
    _, data = cv2.imencode(".png", cv2.cvtColor(as_rgb(picture), cv2.COLOR_RGB2BGR))
    # OpenCV does not tell when it writes a part only, because the disk is full.
    path.write_bytes(data.tobytes())


# Sizes are read before pixels, because a small file may hold a picture that fills the memory. The
# decoder fills what is missing of a file that is cut short with grey, and says nothing.
_PNG = b"\x89PNG\r\n\x1a\n"
# JPEG's segments that hold the picture's size, and markers without a length.
_SIZES = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
_BARE = frozenset({0x01, *range(0xD0, 0xD9)})


def stated_size(data: bytes) -> tuple[int, int] | None:
    """Width and height that a whole PNG or JPEG file states [px]; None for any other file.

    Args:
        data: The bytes of the file.
    """
    return _png_size(data) if data.startswith(_PNG) else _jpeg_size(data)


def _png_size(data: bytes) -> tuple[int, int] | None:
    """Width and height [px], None for a file that is not whole: a chunk is missing or damaged."""
    size, at, held = None, len(_PNG), False
    while at + 12 <= len(data):
        (length,) = struct.unpack_from(">I", data, at)
        end = at + 8 + length
        kind, body = data[at + 4 : at + 8], data[at + 4 : end]
        if data[end : end + 4] != struct.pack(">I", zlib.crc32(body)):
            return None
        if kind == b"IHDR" and length == 13:
            size = struct.unpack_from(">II", data, at + 8)
        held = held or kind == b"IDAT"
        if kind == b"IEND":
            return size if held else None
        at = end + 4
    return None


def _jpeg_size(data: bytes) -> tuple[int, int] | None:
    """Width and height [px], None for a file that does not end as its format says, or is none."""
    # Coded data never holds a marker, so the end of the image comes after the last scan's start.
    whole = data.startswith(b"\xff\xd8") and data.rfind(b"\xff\xd9") > data.rfind(b"\xff\xda") > 0
    at = 2
    while whole and at + 9 <= len(data) and data[at] == 0xFF:
        marker = data[at + 1]
        if marker in _SIZES:
            height, width = struct.unpack_from(">HH", data, at + 5)
            return width, height
        if marker == 0xDA:
            return None
        # Markers may be filled up with bytes that are all ones.
        length = 2 + struct.unpack_from(">H", data, at + 2)[0]
        at += 1 if marker == 0xFF else 2 if marker in _BARE else length
    return None
