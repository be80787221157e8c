"""A picture that was read, with what was recognised in it drawn over it."""

import cv2
import numpy as np

from ....systems.numerics.errors import InvalidInput
from ....systems.numerics.social.landmarks.forward_camera import ForwardCamera
from ....systems.numerics.social.localisation.location import Reading
from ....systems.numerics.social.network.interface import Picture
from ....systems.numerics.social.recognition.picture_files import decode_picture
from ....systems.numerics.social.recognition.references import MARKER

_MARKER, _LANDMARK, _SHADE = (230, 40, 40), (40, 190, 70), (20, 22, 28)
# Shown instead of what is no picture.
_BLANK = 90


def picture_pixels(picture: Picture, camera: ForwardCamera) -> np.ndarray:
    """Red, green, blue, shape (height, width, 3); plain gray for what is no picture."""
    try:
        return decode_picture(picture.data, camera.width, camera.height)
    except InvalidInput:
        return np.full((camera.height, camera.width, 3), _BLANK, dtype=np.uint8)


def draw_reading(reading: Reading, camera: ForwardCamera) -> np.ndarray:
    """Outline landmarks green and markers red, with their matches, and say what came of it.

    Returns:
        Red, green, blue, shape (height, width, 3), uint8.
    """
    image = picture_pixels(reading.picture, camera).copy()
    thick = max(camera.width // 160, 1)
    size = camera.width / 700
    named: set[int] = set()
    for each in reading.recognition.detections:
        colour = _MARKER if each.subject == MARKER else _LANDMARK
        outline = np.rint(np.clip(each.corners, -4 * camera.width, 4 * camera.width))
        cv2.polylines(image, [outline.astype(np.int32)], True, colour, thick, cv2.LINE_AA)
        for x, y in np.rint(each.pixels).astype(int).tolist():
            cv2.circle(image, (x, y), thick, colour, -1, cv2.LINE_AA)
        if each.subject in named:
            continue
        named.add(each.subject)
        name = "evader" if each.subject == MARKER else f"landmark {each.subject}"
        x, y = outline.min(axis=0).astype(int).tolist()
        at = (min(max(x, 4), camera.width - 8), max(y - 3 * thick, int(24 * size)))
        _write(image, name, at, size, colour)
    words = reading.location.outcome.words
    _write(image, words, (8, camera.height - 12), 1.3 * size, (255, 255, 255))
    return image


def _write(
    image: np.ndarray, words: str, at: tuple[int, int], size: float, colour: tuple[int, int, int]
) -> None:
    for tint, width in ((_SHADE, 4), (colour, 1)):
        thick = max(round(width * size), 1)
        cv2.putText(image, words, at, cv2.FONT_HERSHEY_SIMPLEX, size, tint, thick, cv2.LINE_AA)
