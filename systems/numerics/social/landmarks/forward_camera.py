"""A level pinhole camera on a robot's axis, looking to its front."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...checked import Checked, Finite, Positive
from ...errors import require


@dataclass(frozen=True, kw_only=True)
class ForwardCamera(Checked):
    """Optics of a common agent's camera; pixels are square and the axis meets the middle.

    Frame: x to the right, y down, z forward. A pixel's centre has whole coordinates, the first
    being (0, 0) at the top left, as in OpenCV.

    Raises:
        InvalidInput: A number is out of its range.
    """

    # Size of a picture [px].
    width: int = 640
    height: int = 480
    # Horizontal angle of view [rad].
    field_of_view: Finite = math.radians(65)
    # Of the lens above the floor [m].
    lens_height: Positive = 0.16
    # Pixels per metre on the image plane, k_ppm of (2.14).
    pixel_density: Positive = 1.6e5

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("width", "height"):
            size = getattr(self, name)
            require(isinstance(size, int) and size >= 16, name, "be at least 16 pixels", size)
        require(
            0 < self.field_of_view < math.pi,
            "field_of_view",
            "lie between 0 and pi rad",
            self.field_of_view,
        )

    @cached_property
    def focal_pixels(self) -> float:
        """Focal length, times the pixel density [px]."""
        return 0.5 * self.width / math.tan(0.5 * self.field_of_view)

    @cached_property
    def focal_length(self) -> float:
        """f of (2.14) and (2.15) [m]."""
        return self.focal_pixels / self.pixel_density

    @cached_property
    def centre(self) -> np.ndarray:
        """Where the axis meets the picture, shape (2,) [px]."""
        return np.array([0.5 * (self.width - 1), 0.5 * (self.height - 1)])

    @cached_property
    def matrix(self) -> np.ndarray:
        """Of the projection, shape (3, 3) [px]."""
        cx, cy = self.centre
        return np.array([[self.focal_pixels, 0, cx], [0, self.focal_pixels, cy], [0, 0, 1]])


def project_forward(camera: ForwardCamera, pose: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Where points of the world appear in a picture.

    Args:
        camera: Its optics.
        pose: Of the camera's robot: x, y [m], heading [rad], shape (3,).
        points: x, y and height, shape (n, 3) [m].

    Returns:
        Column and row, shape (n, 2) [px]; NaN for points beside or behind the lens.
    """
    x, y, heading = pose
    cos, sin = math.cos(heading), math.sin(heading)
    east, north = points[:, 0] - x, points[:, 1] - y
    depth = cos * east + sin * north
    right = sin * east - cos * north
    down = camera.lens_height - points[:, 2]
    scale = np.full(len(points), math.nan)
    np.divide(camera.focal_pixels, depth, out=scale, where=depth > 1e-9)
    return camera.centre + np.column_stack([right, down]) * scale[:, None]
