"""The unified model of Mei: mirrors that are parabolas or hyperbolas, and most wide lenses.

A point goes to the unit sphere, from there through a point xi above its centre to a plane, where
the lens distorts it:

    (x, y) = (X, Y) / (Z + xi |P|)
    x' = x L(r) + 2 p_1 x y + p_2 (r^2 + 2 x^2),    L(r) = 1 + k_1 r^2 + k_2 r^4 + k_3 r^6
    y' = y L(r) + 2 p_2 x y + p_1 (r^2 + 2 y^2),    r^2 = x^2 + y^2

and the camera matrix makes pixels of (x', y'). It is the model of OpenCV's `omnidir` and of
Kalibr's `omni-radtan`, both without k_3. A mirror that is a little off the lens's axis shows in
p_1 and p_2.

Source: Mei and Rives, "Single view point omnidirectional camera calibration from planar grids",
ICRA 2007; for xi of mirrors Barreto and Araujo, "Issues on the geometry of central catadioptric
image formation", CVPR 2001.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from ...errors import require_finite, require_non_negative, require_positive
from .pixel_grid import ON_THE_GRID, PixelGrid
from .rising import first_root, invert_rising

# Newton's method against tangential distortion, and how near it has to come.
_STEPS, _NEAR = 20, 1e-11


@dataclass(frozen=True, kw_only=True)
class MeiCamera(PixelGrid):
    """A central camera of the unified model.

    Raises:
        InvalidInput: A focal length or a size is not positive, xi is negative, or a number is not
            finite.
    """

    UNITS: ClassVar = {"xi": "-"} | ON_THE_GRID | dict.fromkeys(("k1", "k2", "k3", "p1", "p2"), "-")

    # Height of the second centre of projection above the sphere's, in its radii: 0 for a pinhole,
    # 1 for a parabolic mirror, between them for a hyperbolic one, above 1 for lenses.
    xi: float
    # Radial distortion [-].
    k1: float = 0.0
    k2: float = 0.0
    k3: float = 0.0
    # Tangential distortion [-].
    p1: float = 0.0
    p2: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        require_non_negative("xi", self.xi)
        for name in ("k1", "k2", "k3", "p1", "p2"):
            require_finite(name, getattr(self, name))

    @classmethod
    def of_hyperbolic_mirror(
        cls,
        *,
        foci: float,
        latus_rectum: float,
        focal_length: float,
        centre: tuple[float, float],
        width: int,
        height: int,
    ) -> "MeiCamera":
        """The camera whose pinhole is at one focus of a mirror and whose rays meet in the other.

        Args:
            foci: Distance between the foci of the hyperbola [m].
            latus_rectum: Width of the mirror at the height of its own focus [m].
            focal_length: Of the pinhole, in pixels.
            centre: Where the axis meets the picture (column, row), in pixels.
            width, height: Of the picture, in pixels.

        Raises:
            InvalidInput: A length is not positive.
        """
        for name, value in (("foci", foci), ("latus_rectum", latus_rectum)):
            require_positive(name, value)
        require_positive("focal_length", focal_length)
        long = math.hypot(foci, 0.5 * latus_rectum)
        focal = focal_length * 0.5 * latus_rectum / long
        return cls(
            xi=foci / long,
            focal_x=focal,
            focal_y=focal,
            centre_x=centre[0],
            centre_y=centre[1],
            width=width,
            height=height,
        )

    @property
    def least_z(self) -> float:
        """Of unit vectors to points that the model shows: those above this [-]."""
        return -self.xi if self.xi <= 1 else -1 / self.xi

    def project(self, points: np.ndarray) -> np.ndarray:
        """Pixels of points, shape (n, 3) -> (n, 2), as in `CameraModel`."""
        points = np.asarray(points, dtype=float).reshape(-1, 3)
        with np.errstate(divide="ignore", invalid="ignore"):
            x, y, z = (points / np.linalg.norm(points, axis=1, keepdims=True)).T
            plane = np.stack([x, y], axis=1) / (z + self.xi)[:, None]
            plane[~(z > self.least_z)] = np.nan
            plane[np.sum(plane**2, axis=1) > self._fold**2] = np.nan
        return self.to_pixels(self._distorted(plane)[0])

    def rays(self, pixels: np.ndarray) -> np.ndarray:
        """Rays of pixels, shape (n, 2) -> (n, 3), as in `CameraModel`."""
        plane = self._undistorted(self.to_plane(np.asarray(pixels, dtype=float).reshape(-1, 2)))
        square = np.sum(plane**2, axis=1)
        with np.errstate(invalid="ignore"):
            scale = (self.xi + np.sqrt(1 + (1 - self.xi**2) * square)) / (1 + square)
        return np.column_stack([scale[:, None] * plane, scale - self.xi])

    @cached_property
    def _fold(self) -> float:
        """Radius in the plane at which the radial distortion turns back [-]."""
        return math.sqrt(first_root([1.0, 3 * self.k1, 5 * self.k2, 7 * self.k3]))

    def _distorted(self, plane: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Distorted points of the plane, shape (n, 2), and the derivative, shape (n, 2, 2)."""
        x, y = plane.T
        square = x**2 + y**2
        k1, k2, k3 = self.k1, self.k2, self.k3
        radial = 1 + square * (k1 + square * (k2 + square * k3))
        growth = 2 * k1 + square * (4 * k2 + square * 6 * k3)
        p1, p2 = self.p1, self.p2
        moved = np.stack(
            [
                x * radial + 2 * p1 * x * y + p2 * (square + 2 * x**2),
                y * radial + 2 * p2 * x * y + p1 * (square + 2 * y**2),
            ],
            axis=1,
        )
        cross = growth * x * y + 2 * p1 * x + 2 * p2 * y
        slopes = np.empty((len(plane), 2, 2))
        slopes[:, 0, 0] = radial + growth * x**2 + 2 * p1 * y + 6 * p2 * x
        slopes[:, 0, 1] = slopes[:, 1, 0] = cross
        slopes[:, 1, 1] = radial + growth * y**2 + 2 * p2 * x + 6 * p1 * y
        return moved, slopes

    def _undistorted(self, wanted: np.ndarray) -> np.ndarray:
        """Points of the plane that the lens moves to given ones, shape (n, 2) -> (n, 2)."""
        size = np.linalg.norm(wanted, axis=1)
        largest = float(np.nanmax(size, initial=0.0)) or 1.0

        k1, k2, k3 = self.k1, self.k2, self.k3

        def radial(radius: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            square = radius**2
            value = 1 + square * (k1 + square * (k2 + square * k3))
            slope = 1 + square * (3 * k1 + square * (5 * k2 + square * 7 * k3))
            return radius * value, slope

        # To where the curve turns, or far enough.
        end = largest
        while end < self._fold and radial(np.array([end]))[0][0] < largest:
            end *= 2
        end = min(end, self._fold)
        # The radial part alone first: from there Newton's method is safe.
        tangential = self.p1 != 0 or self.p2 != 0
        start = invert_rising(radial, size, end)
        if tangential:
            # What lies just beyond the fold by its radius may be reached all the same.
            start = np.where(
                np.isnan(start) & (size < 1.05 * radial(np.array([end]))[0]), end, start
            )
        plane = wanted * (start / np.where(size > 0, size, 1.0))[:, None]
        if not tangential:
            return plane
        for _ in range(_STEPS):
            moved, slopes = self._distorted(plane)
            determinant = slopes[:, 0, 0] * slopes[:, 1, 1] - slopes[:, 0, 1] * slopes[:, 1, 0]
            determinant[determinant == 0] = np.nan
            miss = wanted - moved
            plane = plane + np.stack(
                [
                    (slopes[:, 1, 1] * miss[:, 0] - slopes[:, 0, 1] * miss[:, 1]) / determinant,
                    (slopes[:, 0, 0] * miss[:, 1] - slopes[:, 1, 0] * miss[:, 0]) / determinant,
                ],
                axis=1,
            )
            if not np.nanmax(np.abs(miss), initial=0.0) > 1e-15:
                break
        missed = np.linalg.norm(self._distorted(plane)[0] - wanted, axis=1)
        wrong = (missed > _NEAR * np.maximum(size, 1)) | (np.sum(plane**2, axis=1) > self._fold**2)
        plane[wrong] = np.nan
        return plane
