"""What every model of a central camera offers: all its rays meet in one point.

The camera frame is that of OpenCV: x to the picture's right, y down in the picture, z along the
ray of the optical axis. A mirror swaps left and right, so that the frame of a camera that looks
into ONE mirror is left-handed: angles to the axis and azimuths in the picture are right, but a
turn from the picture's right to its bottom is counter-clockwise as the robot stands.

Pixels are (column, row), whole numbers at the centres of the pixels.
"""

from typing import Protocol, Self

import numpy as np


class CameraModel(Protocol):
    """A central camera, as frozen numbers.

    `vector` holds what a calibration fits, in the order of `names`; `with_vector` puts other
    numbers in their place.
    """

    @property
    def width(self) -> int:
        """Of the picture, in pixels."""
        ...

    @property
    def height(self) -> int:
        """Of the picture, in pixels."""
        ...

    @property
    def names(self) -> tuple[str, ...]:
        """Of the parameters, with their units in brackets."""
        ...

    @property
    def vector(self) -> np.ndarray:
        """The parameters, shape (p,), in the units of `names`."""
        ...

    def with_vector(self, values: np.ndarray) -> Self:
        """The same camera with other parameters.

        Args:
            values: Shape (p,), in the units of `names`.
        """
        ...

    def project(self, points: np.ndarray) -> np.ndarray:
        """Where points appear.

        Args:
            points: In the camera frame, shape (n, 3), in any one unit.

        Returns:
            Pixels, shape (n, 2), which may lie outside the picture; NaN where the model does not
            show the point at all.
        """
        ...

    def rays(self, pixels: np.ndarray) -> np.ndarray:
        """Where pixels look.

        Args:
            pixels: (column, row), shape (n, 2).

        Returns:
            Unit vectors in the camera frame, shape (n, 3); NaN where the model has no ray.
        """
        ...


def in_picture(camera: CameraModel, pixels: np.ndarray) -> np.ndarray:
    """Whether pixels lie in the picture, shape (n, 2) -> (n,); False where they are NaN."""
    last = np.array([camera.width, camera.height]) - 0.5
    return np.all((pixels >= -0.5) & (pixels < last), axis=1)


def angle_between(rays: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Angles between unit vectors, exact for small ones too.

    Args:
        rays, others: Shapes (n, 3).

    Returns:
        Shape (n,) [rad].
    """
    half = 0.5 * np.linalg.norm(rays - others, axis=1)
    return 2 * np.arcsin(np.minimum(half, 1.0))
