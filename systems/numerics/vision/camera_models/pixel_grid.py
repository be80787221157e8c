"""The part that Mei's and Kannala and Brandt's cameras share: from a plane at depth 1 to pixels."""

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from ...errors import require, require_finite, require_positive

# What every camera on the grid fits, with units.
ON_THE_GRID: dict[str, str] = dict.fromkeys(("focal_x", "focal_y", "centre_x", "centre_y"), "px")


@dataclass(frozen=True, kw_only=True)
class PixelGrid:
    """Pixels of points (x, y) of the plane z = 1: u = f_x x + s y + u_0, v = f_y y + v_0.

    Raises:
        InvalidInput: A focal length or a size is not positive, or a number not finite.
    """

    # Units of the parameters that are fitted, by name and in order; the skew is kept as it is.
    UNITS: ClassVar[dict[str, str]] = ON_THE_GRID

    # In pixels for one unit of the plane.
    focal_x: float
    focal_y: float
    # Where the axis meets the picture, in pixels.
    centre_x: float
    centre_y: float
    # Of the picture, in pixels.
    width: int
    height: int
    # Columns that one unit of y adds, in pixels; 0 for axes at right angles.
    skew: float = 0.0

    def __post_init__(self) -> None:
        require_positive("focal_x", self.focal_x)
        require_positive("focal_y", self.focal_y)
        for name in ("centre_x", "centre_y", "skew"):
            require_finite(name, getattr(self, name))
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


def require_size(width: int, height: int) -> None:
    """Refuse a width or a height of a picture that is no positive whole number of pixels."""
    for name, value in (("width", width), ("height", height)):
        whole = isinstance(value, int) and not isinstance(value, bool)
        require(whole and value > 0, name, "be a positive whole number", value)
