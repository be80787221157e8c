"""The one interface behind which every camera stands."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np


@dataclass(frozen=True, eq=False)
class Frame:
    """A picture and when it came.

    Attributes:
        picture: Shape (height, width, 4), uint8: red, green, blue, opacity.
        stamp: By `time.monotonic()` [s].
    """

    picture: np.ndarray
    stamp: float


class FrameSource(Protocol):
    """Something that takes pictures."""

    def read(self) -> Frame | None:
        """The newest picture, at once; None before the first."""
        ...

    def close(self) -> None:
        """Let go of the camera."""
        ...


class NoCamera:
    """Where no camera is: no picture ever comes."""

    def read(self) -> Frame | None:
        """See `FrameSource`."""
        return None

    def close(self) -> None:
        """Nothing is held."""
