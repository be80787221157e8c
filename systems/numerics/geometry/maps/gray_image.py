"""Reading the picture of a map, and refusing one that is not all there.

OpenCV fills what a truncated file lacks with zeros, which a map would show as walls. So the
length of a file is checked here against what its own header promises.
"""

import re
import zlib
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from ...errors import InvalidInput, require

PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"

# "P5 width height maxval", apart by white space and comments, then ONE white space.
_GAP = rb"(?:\s|#[^\r\n]*[\r\n])+"
_GRAYMAP_HEADER = re.compile(
    rb"P([25])" + _GAP + rb"(\d{1,9})" + _GAP + rb"(\d{1,9})" + _GAP + rb"(\d{1,9})\s"
)


@dataclass(frozen=True, eq=False)
class GrayImage:
    """A picture as brightness, its first row at the top.

    Attributes:
        channels: Colour channels, shape (rows, columns, k), k = 1 or 3, in [0, white].
        alpha: Opacity in [0, white], shape (rows, columns); None if the file has none.
        white: Value of a white pixel: 255, or what the file states.
    """

    channels: np.ndarray
    alpha: np.ndarray | None
    white: int


def read_gray_image(path: Path, name: str = "image") -> GrayImage:
    """Read a PGM (P2 or P5, 8 or 16 bits) or PNG file.

    Args:
        path: The file; what is in it decides, not its suffix.
        name: What to call it in an error.

    Raises:
        InvalidInput: Missing, another format, no pixels, truncated or damaged.
    """
    try:
        data = path.read_bytes()
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InvalidInput(f"`{name}` must be a readable file; got {path} ({reason})") from None
    if data[:2] in (b"P2", b"P5"):
        return _graymap(data, path, name)
    if data.startswith(PNG_SIGNATURE):
        return _png(data, path, name)
    start = data[:8].hex(" ") or "an empty file"
    raise InvalidInput(f"`{name}` must be a PGM or PNG picture; got {path}, which starts {start}")


def _graymap(data: bytes, path: Path, name: str) -> GrayImage:
    """Parse a portable graymap; see https://netpbm.sourceforge.net/doc/pgm.html."""
    header = _GRAYMAP_HEADER.match(data)
    if header is None:
        raise InvalidInput(f"`{name}` must have a PGM header; got {data[:40]!r} in {path}")
    kind, columns, rows, white = (int(group) for group in header.groups())
    require(columns > 0 and rows > 0, name, "have pixels", f"{columns} x {rows} in {path}")
    require(0 < white < 65536, name, "have a maxval in 1..65535", f"{white} in {path}")
    body = data[header.end() :]
    if kind == 2:
        plain = re.sub(rb"#[^\r\n]*", b"", body)
        if not re.fullmatch(rb"[\d\s]*", plain):
            raise InvalidInput(f"`{name}` must hold decimal pixels; got other text in {path}")
        pixels = np.array(plain.split(), dtype="S").astype(float)
    else:
        depth = 1 if white < 256 else 2
        # A line end after the last pixel is common and harmless.
        if len(body) > rows * columns * depth and body[rows * columns * depth :].isspace():
            body = body[: rows * columns * depth]
        pixels = np.frombuffer(body[: len(body) // depth * depth], f">u{depth}").astype(float)
    if len(pixels) != rows * columns:
        raise InvalidInput(
            f"`{name}` must hold the {columns} x {rows} pixels of its header; "
            f"got {len(pixels)} instead of {rows * columns} in {path}"
        )
    require(
        bool((pixels <= white).all()), name, f"stay within its maxval {white}", f"more in {path}"
    )
    return GrayImage(pixels.reshape(rows, columns, 1), None, white)


def _png(data: bytes, path: Path, name: str) -> GrayImage:
    """Decode a PNG file after checking that every chunk of it is there and whole."""
    fault = _png_fault(data)
    if fault:
        raise InvalidInput(f"`{name}` must be a whole PNG file; got {fault} in {path}")
    try:
        pixels = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    except cv2.error:
        pixels = None
    if pixels is None:
        raise InvalidInput(f"`{name}` must be a readable PNG file; got {path}")
    white = 255 if pixels.dtype == np.uint8 else 65535
    pixels = np.atleast_3d(pixels).astype(float)
    if pixels.shape[2] in (2, 4):
        return GrayImage(pixels[:, :, :-1], pixels[:, :, -1], white)
    return GrayImage(pixels, None, white)


def _png_fault(data: bytes) -> str:
    """What is wrong with the chunks of a PNG file (PNG specification, section 5); '' if nothing."""
    position, packed, kind = len(PNG_SIGNATURE), b"", b""
    while kind != b"IEND":
        length = int.from_bytes(data[position : position + 4], "big")
        kind = data[position + 4 : position + 8]
        body = data[position + 8 : position + 8 + length]
        check = data[position + 8 + length : position + 12 + length]
        if len(check) < 4:
            return "a truncated file"
        if zlib.crc32(kind + body) != int.from_bytes(check, "big"):
            return f"a damaged {kind!r} chunk"
        packed += body if kind == b"IDAT" else b""
        position += 12 + length
    unpacker = zlib.decompressobj()
    try:
        unpacker.decompress(packed)
    except zlib.error as error:
        return f"damaged pixels ({error})"
    return "" if unpacker.eof else "truncated pixels"
