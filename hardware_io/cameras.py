"""Pictures of cameras: devices, network streams and folders of pictures, into a diagram."""

import re
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import cv2
import numpy as np
from pydrake.systems.framework import LeafSystem
from pydrake.systems.sensors import ImageRgba8U

from ..systems.drake_parts import AbstractValue, state_vector
from ..systems.numerics.errors import InvalidInput, require, require_positive
from ..systems.numerics.station.channel import freshness


@dataclass(frozen=True, eq=False)
class Frame:
    """A picture and the time at which it came.

    Attributes:
        picture: Shape (height, width, 4), uint8: red, green, blue, opacity.
        stamp: Time at which it came, by `time.monotonic()` [s].
    """

    picture: np.ndarray
    stamp: float


class FrameSource(Protocol):
    """Something that takes pictures."""

    def read(self) -> Frame | None:
        """Return the newest picture without waiting; None before the first."""
        ...

    def close(self) -> None:
        """Let go of the camera."""
        ...


class NoCamera:
    """Stand-in for a missing camera: it never gives a picture."""

    def read(self) -> Frame | None:
        """See `FrameSource`."""
        return None

    def close(self) -> None:
        """Nothing is held."""


def without_password(place: str) -> str:
    """Mask name, password and parameters in a camera's address, so that it can be shown.

    Args:
        place: Camera, as "0" or "rtsp://name:password@camera/stream?token=secret".
    """
    scheme, mark, rest = place.partition("://")
    if not mark:
        return place
    # A password may have any character that its camera takes, "@" and "/" among them.
    before, at, after = rest.rpartition("@")
    address = f"***@{after}" if at and before else rest
    return f"{scheme}://{re.sub(r'[?#;].*', '?***', address, flags=re.DOTALL)}"


# How long a camera that gives no picture is left alone before it is asked again [s].
_PAUSE = 0.05


class OpenCvCapture:
    """Reads a camera in a thread, so that the newest picture is always at hand.

    Args:
        place: Number of a device, as "0", its path, or an address, as "rtsp://camera/stream".

    Raises:
        InvalidInput: It cannot be opened.
    """

    def __init__(self, place: str) -> None:
        # OpenCV's own warnings would only repeat the error below.
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


_KINDS = {".png", ".jpg", ".jpeg", ".bmp"}


class PictureFolder:
    """Shows the pictures of a folder one after the other, in the order of their names, and stops.

    The last picture then grows old, like that of a camera that has failed.

    Args:
        folder: Folder with the pictures.
        rate: Pictures a second [1/s].
        clock: Clock that times the pictures, starting now [s].

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


@dataclass(frozen=True, eq=False)
class _Held:
    picture: np.ndarray


class CameraPort(LeafSystem):
    """Samples a camera periodically; outputs the picture, its age and whether it is still valid.

    Before the first picture has come, `image` is one black pixel.

    .. pydrake_system::

        name: CameraPort
        input_ports: []
        output_ports:
        - image
        - valid
        - age
        - stamp

    =====  ===========  ====  =======  ===========
    port   size         unit  frame    feedthrough
    =====  ===========  ====  =======  ===========
    image  ImageRgba8U  -     picture  -
    valid  1            -     -        -
    age    1            s     -        -
    stamp  1            s     -        -
    =====  ===========  ====  =======  ===========

    `stamp` is the diagram's time at which the picture came, minus infinity if none did.

    Source: the cameras of Zhang 2014, 2.2.4.1 and 2.3.4.

    Args:
        source: The camera.
        period: Time between samples [s].
        stale_after: Age up to which a picture is valid [s].
        clock: The clock of the source's stamps [s].

    Raises:
        InvalidInput: A number is not positive.
    """

    def __init__(
        self,
        source: FrameSource,
        *,
        period: float,
        stale_after: float,
        clock: Callable[[], float] = time.monotonic,
    ):
        super().__init__()
        require_positive("period", period)
        require_positive("stale_after", stale_after)
        self._source, self._clock, self._limit = source, clock, float(stale_after)
        black = np.zeros((1, 1, 4), dtype=np.uint8)
        black[..., 3] = 255
        self._picture = self.DeclareAbstractState(AbstractValue.Make(_Held(black)))
        # valid, age, stamp.
        self._times = self.DeclareDiscreteState(state_vector(np.array([0.0, np.inf, -np.inf])))
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._sample)
        self.DeclareAbstractOutputPort(
            "image",
            lambda: AbstractValue.Make(ImageRgba8U(1, 1)),
            self._calc_image,
            prerequisites_of_calc={self.abstract_state_ticket(self._picture)},
        )
        for k, name in enumerate(("valid", "age", "stamp")):
            self.DeclareVectorOutputPort(
                name, 1, self._time_calc(k), {self.discrete_state_ticket(self._times)}
            )

    def _time_calc(self, k: int):
        return lambda context, output: output.set_value(
            context.get_discrete_state(self._times).value()[k : k + 1]
        )

    def _sample(self, context, state):
        frame = self._source.read()
        if frame is None:
            return
        valid, ages = freshness(self._clock(), np.array([frame.stamp]), self._limit)
        state.get_mutable_abstract_state(self._picture).set_value(_Held(frame.picture))
        state.get_mutable_discrete_state(self._times).set_value(
            np.array([valid[0], ages[0], context.get_time() - ages[0]])
        )

    def _calc_image(self, context, output):
        picture = context.get_abstract_state(self._picture).get_value().picture
        image = ImageRgba8U(picture.shape[1], picture.shape[0])
        data: Any = image.mutable_data
        data[:] = picture
        output.set_value(image)
