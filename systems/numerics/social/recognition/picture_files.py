"""Posted pictures as files in memory; a file may hold anything, not only a picture."""

from contextlib import suppress

import cv2
import numpy as np

from ...errors import InvalidInput, require
from ...vision.estimation.pictures import as_rgb, stated_size

_QUALITY = 92
# Larger files are refused [bytes].
LARGEST = 20_000_000


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
    size = stated_size(data)
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
