"""Pictures as arrays and as files: what counts as one, and what is refused."""

from contextlib import suppress
from pathlib import Path

import cv2
import numpy as np

from ...errors import InvalidInput, require

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
        InvalidInput: No file there, another format, a file that is cut short or does not decode,
            or a picture of another depth than 8 bits.
    """
    path = Path(path)
    require(path.suffix.lower() in SUFFIXES, "picture", f"end in {', '.join(SUFFIXES)}", path)
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InvalidInput(f"`picture` must be readable; got {path} ({error.strerror})") from None
    require(_is_whole(data), "picture", "be a whole PNG or JPEG file", path)
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


def _is_whole(data: bytes) -> bool:
    """Whether a file ends as its format says.

    The decoder fills the rest of a file that is cut short with grey and says nothing.
    """
    if data.startswith(b"\x89PNG"):
        return data.rfind(b"IEND") > data.rfind(b"IDAT") > 0
    # Coded data never holds a marker, so the end of the image comes after the last scan's start.
    return data.startswith(b"\xff\xd8") and data.rfind(b"\xff\xd9") > data.rfind(b"\xff\xda") > 0
