"""Models of central cameras: Kannala and Brandt's, Mei's and Scaramuzza's.

The model of Kannala and Brandt for fisheye lenses: the radius is a polynomial of the angle.

    r(theta) = theta (1 + k_1 theta^2 + k_2 theta^4 + k_3 theta^6 + k_4 theta^8)

theta is the angle to the axis; the camera matrix makes pixels of r times the direction across it.
It is the model of OpenCV's `fisheye` and of Kalibr's `pinhole-equidistant`.

Source: Kannala and Brandt, "A generic camera model and calibration method for conventional,
wide-angle, and fish-eye lenses", PAMI 2006, without its asymmetric part.

The unified model of Mei: mirrors that are parabolas or hyperbolas, and most wide lenses.

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

The model of Scaramuzza, of mirrors and lenses: a ray's depth is a polynomial of its radius.

A pixel's offset from the centre, freed of a stretch, is (x, y) at the radius rho, and its ray

    (x, y, z),   z = -(a_0 + a_1 rho + a_2 rho^2 + ... + a_N rho^N)

in the frame of OpenCV; OCamCalib's own has x down, y right and z towards the viewer, hence the
sign. Pixels are made of it by (row, column) = [[c, d], [e, 1]] (y, x) + centre. Of c, d and e a
calibration fits c and e: d turns the camera about its axis, as its pose does.

Source: Scaramuzza, Martinelli and Siegwart, "A flexible technique for accurate omnidirectional
camera calibration and structure from motion", ICVS 2006; the letters are OCamCalib's.
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar, Self

import numpy as np

from ...checked import Checked, Finite, NonNegative
from ...errors import require, require_finite, require_positive
from .camera_model import (
    ON_THE_GRID,
    PixelGrid,
    first_root,
    invert_rising,
    require_near_picture,
    require_size,
)


@dataclass(frozen=True, kw_only=True)
class KannalaBrandtCamera(PixelGrid):
    """A fisheye camera; the focal lengths are pixels per radian near the axis.

    Raises:
        InvalidInput: A focal length or a size is not positive, or a number is not finite.
    """

    UNITS: ClassVar = ON_THE_GRID | {f"k{n}": f"1/rad^{2 * n}" for n in range(1, 5)}

    k1: Finite = 0.0  # [1/rad^2]
    k2: Finite = 0.0  # [1/rad^4]
    k3: Finite = 0.0  # [1/rad^6]
    k4: Finite = 0.0  # [1/rad^8]

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
    xi: NonNegative
    # Radial distortion [-].
    k1: Finite = 0.0
    k2: Finite = 0.0
    k3: Finite = 0.0
    # Tangential distortion [-].
    p1: Finite = 0.0
    p2: Finite = 0.0

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


@dataclass(frozen=True, kw_only=True)
class ScaramuzzaCamera(Checked):
    """A central camera whose rays are a polynomial of the radius.

    Raises:
        InvalidInput: The polynomial is shorter than a_0, a_1, a_2, its a_0 is not negative, the
            stretch cannot be undone, or a number is not finite.
    """

    # a_0 [px], a_1 [-], a_2 [1/px] and so on; a_0 < 0, and a_1 = 0 for mirrors and lenses that
    # are smooth on their axis.
    polynomial: tuple[float, ...]
    # Where the axis meets the picture, in pixels.
    centre_x: Finite
    centre_y: Finite
    # Of the picture, in pixels.
    width: int
    height: int
    # Rows and columns that one pixel down (c, e) and one to the right (d, 1) add [-].
    c: Finite = 1.0
    d: Finite = 0.0
    e: Finite = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        require(len(self.polynomial) >= 3, "polynomial", "have a_0, a_1, a_2", self.polynomial)
        for value in self.polynomial:
            require_finite("polynomial", value)
        require(self.polynomial[0] < 0, "polynomial", "begin with a_0 < 0", self.polynomial[0])
        require_near_picture("centre_x, centre_y", self.centre_x, self.centre_y)
        stretch = (self.c, self.d, self.e)
        require(self.c - self.d * self.e > 0, "c, d, e", "stretch a picture", stretch)
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
