"""A folder of pictures, played as if a camera took them."""

import time
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np

from ...systems.numerics.errors import InvalidInput, require, require_positive
from .frame_source import Frame

_KINDS = {".png", ".jpg", ".jpeg", ".bmp"}


class PictureFolder:
    """Shows the pictures of a folder one after the other, in the order of their names, and stops.

    The last picture grows old, as that of a camera does that has failed.

    Args:
        folder: With pictures.
        rate: Pictures a second [1/s].
        clock: By which they are shown, from this moment on [s].

    Raises:
        InvalidInput: The folder has no pictures, or one cannot be read; the rate is not positive.
    """

    def __init__(
        self, folder: Path, *, rate: float = 10.0, clock: Callable[[], float] = time.monotonic
    ) -> None:
        require_positive("omni_camera.rate", rate)
        files = sorted(folder.iterdir()) if folder.is_dir() else []
        self._files = [each for each in files if each.suffix.lower() in _KINDS]
        require(
            len(self._files) > 0, "omni_camera.place", "be a folder that holds pictures", folder
        )
        self._rate, self._clock, self._start = float(rate), clock, clock()
        self._shown: tuple[int, np.ndarray] = (0, _load(self._files[0]))

    def read(self) -> Frame | None:
        """See `FrameSource`."""
        elapsed = self._clock() - self._start
        number = min(int(elapsed * self._rate + 1e-9), len(self._files) - 1)
        if number != self._shown[0]:
            self._shown = (number, _load(self._files[number]))
        return Frame(self._shown[1], self._start + number / self._rate)

    def close(self) -> None:
        """Nothing is held."""


def _load(file: Path) -> np.ndarray:
    picture = cv2.imread(str(file), cv2.IMREAD_COLOR)
    if picture is None:
        raise InvalidInput(f"`omni_camera.place` must hold pictures that can be read; got {file}")
    return cv2.cvtColor(picture, cv2.COLOR_BGR2RGBA)
