"""The model of Kannala and Brandt for fisheye lenses: the radius is a polynomial of the angle.

    r(theta) = theta (1 + k_1 theta^2 + k_2 theta^4 + k_3 theta^6 + k_4 theta^8)

theta is the angle to the axis; the camera matrix makes pixels of r times the direction across it.
It is the model of OpenCV's `fisheye` and of Kalibr's `pinhole-equidistant`.

Source: Kannala and Brandt, "A generic camera model and calibration method for conventional,
wide-angle, and fish-eye lenses", PAMI 2006, without its asymmetric part.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from ...errors import require_finite
from .pixel_grid import ON_THE_GRID, PixelGrid
from .rising import first_root, invert_rising


@dataclass(frozen=True, kw_only=True)
class KannalaBrandtCamera(PixelGrid):
    """A fisheye camera; the focal lengths are pixels per radian near the axis.

    Raises:
        InvalidInput: A focal length or a size is not positive, or a number is not finite.
    """

    UNITS: ClassVar = ON_THE_GRID | {f"k{n}": f"1/rad^{2 * n}" for n in range(1, 5)}

    k1: float = 0.0  # [1/rad^2]
    k2: float = 0.0  # [1/rad^4]
    k3: float = 0.0  # [1/rad^6]
    k4: float = 0.0  # [1/rad^8]

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("k1", "k2", "k3", "k4"):
            require_finite(name, getattr(self, name))

    @cached_property
    def largest_angle(self) -> float:
        """To the axis, of rays that the model shows: where the radius turns back, or pi [rad]."""
        turn = first_root([1.0, 3 * self.k1, 5 * self.k2, 7 * self.k3, 9 * self.k4])
        return min(math.sqrt(turn), math.pi)

    def project(self, points: np.ndarray) -> np.ndarray:
        """Pixels of points, shape (n, 3) -> (n, 2), as in `CameraModel`."""
        x, y, z = np.asarray(points, dtype=float).reshape(-1, 3).T
        across = np.hypot(x, y)
        angle = np.arctan2(across, z)
        radius = np.where(angle <= self.largest_angle, self._curve(angle)[0], np.nan)
        # On the axis there is no direction across, and no radius either; behind, none is right.
        radius[(across == 0) & ~(z > 0)] = np.nan
        scale = radius / np.where(across > 0, across, 1.0)
        return self.to_pixels(np.stack([scale * x, scale * y], axis=1))

    def rays(self, pixels: np.ndarray) -> np.ndarray:
        """Rays of pixels, shape (n, 2) -> (n, 3), as in `CameraModel`."""
        plane = self.to_plane(np.asarray(pixels, dtype=float).reshape(-1, 2))
        radius = np.linalg.norm(plane, axis=1)
        angle = invert_rising(self._curve, radius, self.largest_angle)
        scale = np.sin(angle) / np.where(radius > 0, radius, 1.0)
        return np.column_stack([scale[:, None] * plane, np.cos(angle)])

    def _curve(self, angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Radius of angles and its slope, shapes (n,) [rad] -> (n,), (n,)."""
        s = angle**2
        value = 1 + s * (self.k1 + s * (self.k2 + s * (self.k3 + s * self.k4)))
        slope = 1 + s * (3 * self.k1 + s * (5 * self.k2 + s * (7 * self.k3 + s * 9 * self.k4)))
        return angle * value, slope
