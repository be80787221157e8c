"""What every model of a central camera offers, and the parts that several of them share.

All rays of a central camera meet in one point.


The camera frame is that of OpenCV: x to the picture's right, y down in the picture, z along the
ray of the optical axis. A mirror swaps left and right, so that the frame of a camera that looks
into ONE mirror is left-handed: angles to the axis and azimuths in the picture are right, but a
turn from the picture's right to its bottom is counter-clockwise as the robot stands.

Pixels are (column, row), whole numbers at the centres of the pixels.

The part that Mei's and Kannala and Brandt's cameras share: from a plane at depth 1 to pixels.

Inverses of curves that rise, for radii and angles of lenses.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import ClassVar, Protocol, Self

import numpy as np

from ...checked import Checked, Finite, Positive
from ...errors import require, require_finite


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


# What every camera on the grid fits, with units.
ON_THE_GRID: dict[str, str] = dict.fromkeys(("focal_x", "focal_y", "centre_x", "centre_y"), "px")


@dataclass(frozen=True, kw_only=True)
class PixelGrid(Checked):
    """Pixels of points (x, y) of the plane z = 1: u = f_x x + s y + u_0, v = f_y y + v_0.

    Raises:
        InvalidInput: A focal length or a size is not positive, or a number not finite.
    """

    # Units of the parameters that are fitted, by name and in order; the skew is kept as it is.
    UNITS: ClassVar[dict[str, str]] = ON_THE_GRID

    # In pixels for one unit of the plane.
    focal_x: Positive
    focal_y: Positive
    # Where the axis meets the picture, in pixels.
    centre_x: Finite
    centre_y: Finite
    # Of the picture, in pixels.
    width: int
    height: int
    # Columns that one unit of y adds, in pixels; 0 for axes at right angles.
    skew: Finite = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        require_near_picture("centre_x, centre_y", self.centre_x, self.centre_y)
        require_size(self.width, self.height)

    @property
    def names(self) -> tuple[str, ...]:
        """Of the parameters, with their units; the skew is kept as it is."""
        return tuple(f"{name} [{unit}]" for name, unit in self.UNITS.items())

    @property
    def vector(self) -> np.ndarray:
        """The parameters, shape (p,), in the units of `names`."""
        return np.array([getattr(self, name) for name in self.UNITS])

    def with_vector(self, values: np.ndarray) -> Self:
        """The same camera with other values of the parameters, shape (p,), as in `names`."""
        return replace(self, **dict(zip(self.UNITS, np.asarray(values).tolist(), strict=True)))

    @property
    def matrix(self) -> np.ndarray:
        """Camera matrix as in OpenCV, shape (3, 3), in pixels."""
        return np.array(
            [
                [self.focal_x, self.skew, self.centre_x],
                [0.0, self.focal_y, self.centre_y],
                [0.0, 0.0, 1.0],
            ]
        )

    def to_pixels(self, plane: np.ndarray) -> np.ndarray:
        """Pixels of points of the plane, shape (n, 2) -> (n, 2)."""
        x, y = np.asarray(plane, dtype=float).T
        column = self.focal_x * x + self.skew * y + self.centre_x
        return np.stack([column, self.focal_y * y + self.centre_y], axis=1)

    def to_plane(self, pixels: np.ndarray) -> np.ndarray:
        """Points of the plane that pixels show, shape (n, 2) -> (n, 2)."""
        column, row = np.asarray(pixels, dtype=float).T
        y = (row - self.centre_y) / self.focal_y
        x = (column - self.centre_x - self.skew * y) / self.focal_x
        return np.stack([x, y], axis=1)


# Of a picture: more pixels than any camera has, and what can be worked on in a few GB.
MOST_PIXELS = 50_000_000
# Where an axis may meet the plane of the picture [px].
_FARTHEST_CENTRE = 1e6


def require_size(width: int, height: int) -> None:
    """Refuse pictures without pixels, and those with more than any camera takes.

    Args:
        width, height: Of the picture, in pixels.

    Raises:
        InvalidInput: They are no positive whole numbers, or more than MOST_PIXELS together.
    """
    for name, value in (("width", width), ("height", height)):
        whole = isinstance(value, int) and not isinstance(value, bool)
        require(whole and value > 0, name, "be a positive whole number", value)
    words = f"be at most {MOST_PIXELS:,} pixels"
    require(width * height <= MOST_PIXELS, "width * height", words, width * height)


def require_near_picture(name: str, column: float, row: float) -> None:
    """Refuse places that are not finite, or so far from a picture that digits are lost.

    Args:
        name: Of the parameter, for the message.
        column, row: The place, in pixels.

    Raises:
        InvalidInput: It is.
    """
    for value in (column, row):
        require_finite(name, value)
        words = f"be at most {_FARTHEST_CENTRE:g} px from the picture"
        require(abs(value) <= _FARTHEST_CENTRE, name, words, value)


# A table this fine leaves Newton's method a few steps.
_TABLE = 65
_STEPS = 60


def invert_rising(
    curve: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]],
    values: np.ndarray,
    end: float,
) -> np.ndarray:
    """Where a curve that rises from 0 takes given values: Newton's method, kept in brackets.

    Args:
        curve: Values and slopes, shapes (n,), at arguments of shape (n,).
        values: Shape (n,), in the unit of the curve.
        end: Of the arguments, which begin at 0, in their unit [-].

    Returns:
        Arguments, shape (n,); NaN where the curve does not reach the value before its end.
    """
    grid = np.linspace(0.0, end, _TABLE)
    heights, _ = curve(grid)
    reached = (values >= heights[0]) & (values <= heights[-1])
    wanted = np.where(reached, values, heights[0])
    found = np.interp(wanted, heights, grid)
    low, high = np.zeros_like(found), np.full_like(found, end)
    for _ in range(_STEPS):
        value, slope = curve(found)
        over = value > wanted
        low, high = np.where(over, low, found), np.where(over, found, high)
        with np.errstate(divide="ignore", invalid="ignore"):
            stepped = found - (value - wanted) / slope
        inside = (stepped >= low) & (stepped <= high)
        new = np.where(inside, stepped, 0.5 * (low + high))
        moved = np.abs(new - found)
        found = new
        if not moved.size or moved.max() <= 1e-15 * end:
            break
    return np.where(reached, found, np.nan)


def first_root(coefficients: list[float]) -> float:
    """Least positive real root of a polynomial, infinite if there is none.

    Args:
        coefficients: Of the powers 0, 1, ..., in units of the argument's powers [-].
    """
    # A coefficient below the least of doubles that can be divided by is none.
    roots = np.polynomial.Polynomial(coefficients).trim(1e-200).roots()
    real = roots[np.abs(roots.imag) <= 1e-9 * np.abs(roots)].real
    return float(min(real[real > 0], default=math.inf))
