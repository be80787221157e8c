"""Where on Earth a field lies: its own metres, and the coordinates of the file it came from."""

from dataclasses import dataclass

import numpy as np

from ...errors import require, require_finite
from ...geometry.world_files import from_local_plane, local_plane


@dataclass(frozen=True)
class Place:
    """Where the zero of a field's metres lies.

    Attributes:
        origin: Its longitude and latitude (WGS 84), x is east and y north of it; None: it is not
            known where the field lies [degrees].
        offset: Where nobody knows, its coordinates in the field's file [m].

    Raises:
        InvalidInput: The origin is not on the globe, or at a pole.
    """

    origin: tuple[float, float] | None = None
    offset: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        if self.origin is not None:
            for value in self.origin:
                require_finite("origin", value)
            fits = abs(self.origin[0]) <= 180 and abs(self.origin[1]) < 89
            require(fits, "origin", "be a longitude and a latitude in degrees", self.origin)

    @property
    def geographic(self) -> bool:
        """Whether it is known where the field lies."""
        return self.origin is not None

    def outwards(self, points: np.ndarray) -> np.ndarray:
        """Points of the field as its file has them.

        Args:
            points: Shape (n, 2) [m].

        Returns:
            Longitude and latitude, shape (n, 2) [degrees], or metres.
        """
        points = np.asarray(points, dtype=float)
        if self.origin is None:
            return points + np.array(self.offset)
        return from_local_plane(points, np.array(self.origin))

    def inwards(self, points: np.ndarray) -> np.ndarray:
        """Points of a file in the field's metres; the inverse of `outwards`.

        Args:
            points: Longitude and latitude, shape (n, 2) [degrees], or metres.

        Returns:
            Shape (n, 2) [m].
        """
        points = np.asarray(points, dtype=float)
        if self.origin is None:
            return points - np.array(self.offset)
        return local_plane(points, np.array(self.origin))
