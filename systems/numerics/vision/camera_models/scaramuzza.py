"""The model of Scaramuzza, of mirrors and lenses: a ray's depth is a polynomial of its radius.

A pixel's offset from the centre, freed of a stretch, is (x, y) at the radius rho, and its ray

    (x, y, z),   z = -(a_0 + a_1 rho + a_2 rho^2 + ... + a_N rho^N)

in the frame of OpenCV; OCamCalib's own has x down, y right and z towards the viewer, hence the
sign. Pixels are made of it by (row, column) = [[c, d], [e, 1]] (y, x) + centre. Of c, d and e a
calibration fits c and e: d turns the camera about its axis, as its pose does.

Source: Scaramuzza, Martinelli and Siegwart, "A flexible technique for accurate omnidirectional
camera calibration and structure from motion", ICVS 2006; the letters are OCamCalib's.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from ...errors import require, require_finite
from .pixel_grid import require_size
from .rising import first_root, invert_rising


@dataclass(frozen=True, kw_only=True)
class ScaramuzzaCamera:
    """A central camera whose rays are a polynomial of the radius.

    Raises:
        InvalidInput: The polynomial is shorter than a_0, a_1, a_2, its a_0 is not negative, the
            stretch cannot be undone, or a number is not finite.
    """

    # a_0 [px], a_1 [-], a_2 [1/px] and so on; a_0 < 0, and a_1 = 0 for mirrors and lenses that
    # are smooth on their axis.
    polynomial: tuple[float, ...]
    # Where the axis meets the picture, in pixels.
    centre_x: float
    centre_y: float
    # Of the picture, in pixels.
    width: int
    height: int
    # Rows and columns that one pixel down (c, e) and one to the right (d, 1) add [-].
    c: float = 1.0
    d: float = 0.0
    e: float = 0.0

    def __post_init__(self) -> None:
        require(len(self.polynomial) >= 3, "polynomial", "have a_0, a_1, a_2", self.polynomial)
        for value in self.polynomial:
            require_finite("polynomial", value)
        require(self.polynomial[0] < 0, "polynomial", "begin with a_0 < 0", self.polynomial[0])
        for name in ("centre_x", "centre_y", "c", "d", "e"):
            require_finite(name, getattr(self, name))
        require(self.c - self.d * self.e > 0, "c, d, e", "stretch a picture", self._stretch)
        require_size(self.width, self.height)

    @property
    def names(self) -> tuple[str, ...]:
        """Of the parameters, with their units; a_1 and d are kept as they are."""
        powers = [0, *range(2, len(self.polynomial))]
        units = ["px" if n == 0 else "1/px" if n == 2 else f"1/px^{n - 1}" for n in powers]
        terms = [f"a{n} [{unit}]" for n, unit in zip(powers, units, strict=True)]
        return (*terms, "centre_x [px]", "centre_y [px]", "c [-]", "e [-]")

    @property
    def vector(self) -> np.ndarray:
        """The parameters, shape (p,), in the units of `names`."""
        a0, _, *others = self.polynomial
        return np.array([a0, *others, self.centre_x, self.centre_y, self.c, self.e])

    def with_vector(self, values: np.ndarray) -> Self:
        """The same camera with other values of the parameters, shape (p,), as in `names`."""
        a0, *others, x, y, c, e = np.asarray(values).tolist()
        polynomial = (a0, self.polynomial[1], *others)
        return replace(self, polynomial=polynomial, centre_x=x, centre_y=y, c=c, e=e)

    @cached_property
    def rim(self) -> float:
        """Largest radius with a ray: the picture's farthest corner, or where angles turn back.

        Counted after the stretch is undone, in pixels.
        """
        right, bottom = self.width - 0.5, self.height - 0.5
        corners = np.array([[-0.5, -0.5], [right, -0.5], [right, bottom], [-0.5, bottom]])
        farthest = float(np.linalg.norm(self._offsets(corners), axis=1).max())
        # The angle grows while rho z' < z, with z = -f.
        turn = first_root([(n - 1) * a for n, a in enumerate(self.polynomial)])
        # The corner itself is not to be lost to rounding.
        return min(farthest * (1 + 1e-9), turn)

    @cached_property
    def largest_angle(self) -> float:
        """To the axis, at the rim [rad]."""
        return float(self._angle(np.array([self.rim]))[0][0])

    def project(self, points: np.ndarray) -> np.ndarray:
        """Pixels of points, shape (n, 3) -> (n, 2), as in `CameraModel`.

        The polynomial is inverted exactly, not by OCamCalib's second polynomial.
        """
        x, y, z = np.asarray(points, dtype=float).reshape(-1, 3).T
        across = np.hypot(x, y)
        # The zero vector has no direction; atan2 would call it the axis.
        angle = np.where((across > 0) | (z > 0), np.arctan2(across, z), np.nan)
        radius = invert_rising(self._angle, angle, self.rim)
        scale = radius / np.where(across > 0, across, 1.0)
        moved = np.stack([scale * y, scale * x], axis=1) @ self._stretch.T
        return moved[:, ::-1] + [self.centre_x, self.centre_y]

    def rays(self, pixels: np.ndarray) -> np.ndarray:
        """Rays of pixels, shape (n, 2) -> (n, 3), as in `CameraModel`."""
        offsets = self._offsets(np.asarray(pixels, dtype=float).reshape(-1, 2))
        radius = np.linalg.norm(offsets, axis=1)
        depth = -np.polynomial.polynomial.polyval(radius, self.polynomial)
        rays = np.column_stack([offsets, depth])
        rays[~(radius <= self.rim)] = np.nan
        return rays / np.linalg.norm(rays, axis=1, keepdims=True)

    @property
    def _stretch(self) -> np.ndarray:
        return np.array([[self.c, self.d], [self.e, 1.0]])

    def _offsets(self, pixels: np.ndarray) -> np.ndarray:
        """Offsets (right, down) from the centre without the stretch, shape (n, 2) -> (n, 2)."""
        away = pixels - [self.centre_x, self.centre_y]
        return np.linalg.solve(self._stretch, away[:, ::-1].T)[::-1].T

    def _angle(self, radius: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Angles to the axis [rad] and their slopes [rad/px] at radii [px], shapes (n,)."""
        evaluate = np.polynomial.polynomial.polyval
        depth = -evaluate(radius, self.polynomial)
        slope = -evaluate(radius, [n * a for n, a in enumerate(self.polynomial)][1:])
        return np.arctan2(radius, depth), (depth - radius * slope) / (radius**2 + depth**2)
