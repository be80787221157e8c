"""A camera that OpenCV can open: a device of this machine, or a stream of the network."""

import threading
import time

import cv2

from ...systems.numerics.errors import InvalidInput
from .camera_address import without_password
from .frame_source import Frame

# How long a camera that gives no picture is left alone before it is asked again [s].
_PAUSE = 0.05


class OpenCvCapture:
    """Pictures of a camera, taken by a thread, so that the newest is always at hand.

    Args:
        place: Number of a device, as "0", its path, or an address, as "rtsp://camera/stream".

    Raises:
        InvalidInput: It cannot be opened.
    """

    def __init__(self, place: str) -> None:
        # OpenCV's own warnings would say the same again, in more lines.
        level = cv2.utils.logging.getLogLevel()
        cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
        try:
            self._capture = cv2.VideoCapture(int(place) if place.isdigit() else place)
        finally:
            cv2.utils.logging.setLogLevel(level)
        if not self._capture.isOpened():
            raise InvalidInput(
                "`omni_camera.place` must be a camera that OpenCV can open; got "
                f"{without_password(place)}"
            )
        # A stream's old pictures are worth nothing.
        self._capture.set(cv2.CAP_PROP_BUFFERSIZE, 1)
        self._frame: Frame | None = None
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        while not self._ended.is_set():
            came, picture = self._capture.read()
            if came:
                self._frame = Frame(cv2.cvtColor(picture, cv2.COLOR_BGR2RGBA), time.monotonic())
            else:
                self._ended.wait(_PAUSE)

    def read(self) -> Frame | None:
        """See `FrameSource`."""
        return self._frame

    def close(self) -> None:
        """End the thread and let go of the camera."""
        self._ended.set()
        self._thread.join(timeout=5.0)
        if not self._thread.is_alive():
            self._capture.release()
