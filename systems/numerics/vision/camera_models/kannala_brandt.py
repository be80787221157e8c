"""The model of Kannala and Brandt for fisheye lenses: the radius is a polynomial of the angle.

    r(theta) = theta (1 + k_1 theta^2 + k_2 theta^4 + k_3 theta^6 + k_4 theta^8)

theta is the angle to the axis; the camera matrix makes pixels of r times the direction across it.
It is the model of OpenCV's `fisheye` and of Kalibr's `pinhole-equidistant`.

Source: Kannala and Brandt, "A generic camera model and calibration method for conventional,
wide-angle, and fish-eye lenses", PAMI 2006, without its asymmetric part.
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from ...errors import require_finite
from .pixel_grid import PixelGrid
from .rising import first_root, invert_rising

_FITTED = ("focal_x", "focal_y", "centre_x", "centre_y", "k1", "k2", "k3", "k4")
_UNITS = ("px", "px", "px", "px", "1/rad^2", "1/rad^4", "1/rad^6", "1/rad^8")


@dataclass(frozen=True, kw_only=True)
class KannalaBrandtCamera(PixelGrid):
    """A fisheye camera; the focal lengths are pixels per radian near the axis.

    Raises:
        InvalidInput: A focal length or a size is not positive, or a number is not finite.
    """

    k1: float = 0.0  # [1/rad^2]
    k2: float = 0.0  # [1/rad^4]
    k3: float = 0.0  # [1/rad^6]
    k4: float = 0.0  # [1/rad^8]

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("k1", "k2", "k3", "k4"):
            require_finite(name, getattr(self, name))

    @property
    def names(self) -> tuple[str, ...]:
        """Of the parameters, with their units; the skew is kept as it is."""
        return tuple(f"{name} [{unit}]" for name, unit in zip(_FITTED, _UNITS, strict=True))

    @property
    def vector(self) -> np.ndarray:
        """The parameters, shape (8,), in the units of `names`."""
        return np.array([getattr(self, name) for name in _FITTED])

    def with_vector(self, values: np.ndarray) -> Self:
        """The same camera with other values of the parameters, shape (8,), as in `names`."""
        return replace(self, **dict(zip(_FITTED, np.asarray(values).tolist(), strict=True)))

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
