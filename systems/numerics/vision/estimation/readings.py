"""What was measured in calibration pictures, and the error of a model on it."""

from dataclasses import dataclass

import numpy as np

from ...errors import require

INCH = 0.0254
# The distances of 2.2.4.2: 15, 20, ... 60 inches [m].
THESIS_DISTANCES = tuple(inches * INCH for inches in range(15, 61, 5))
# An empirical curve needs a parabola and one more.
_MIN_DISTANCES = 4


@dataclass(frozen=True, kw_only=True)
class Readings:
    """Where shells stood and where they were seen, a row per picture.

    Attributes:
        distance: True distance from the mirror's axis to the shell's near side, shape (n,) [m].
        bearing: True bearing from the robot's front, counter-clockwise, shape (n,) [rad].
        pixels: Near point of the bottom edge in the picture (column, row), shape (n, 2).

    Raises:
        InvalidInput: Shapes differ, or a number is not finite.
    """

    distance: np.ndarray
    bearing: np.ndarray
    pixels: np.ndarray

    def __post_init__(self) -> None:
        count = len(self.distance)
        shapes = (self.distance.shape, self.bearing.shape, self.pixels.shape)
        require(
            shapes == ((count,), (count,), (count, 2)),
            "readings",
            "hold a distance, a bearing and a pixel per picture",
            shapes,
        )
        for name in ("distance", "bearing", "pixels"):
            finite = np.isfinite(getattr(self, name)).all()
            require(bool(finite), f"readings.{name}", "be finite", "something that is not")
        require(bool(np.all(self.distance > 0)), "readings.distance", "be positive", "less")
        different = len(self.distances)
        require(
            different >= _MIN_DISTANCES,
            "readings",
            f"hold at least {_MIN_DISTANCES} different distances",
            different,
        )

    @property
    def distances(self) -> np.ndarray:
        """The different distances, rising, shape (m,) [m]."""
        return np.unique(self.distance)

    def means(self, values: np.ndarray) -> np.ndarray:
        """Means over the directions at each of `distances`, shape (n,) -> (m,).

        Args:
            values: One for each picture, any unit, shape (n,).
        """
        return np.array([values[self.distance == each].mean() for each in self.distances])


@dataclass(frozen=True, kw_only=True)
class ErrorCurve:
    """How a model errs at each distance, over all directions.

    Attributes:
        distance: True distances, shape (m,) [m].
        pixel_radius: Mean p, shape (m,) [px].
        mean_error: True distance less the mean estimate, e of (2.8); its size is Figure 2.11;
            shape (m,) [m].
        spread: Standard deviation of the estimates over the directions, Figure 2.12;
            shape (m,) [m].
        rms: Root of the mean square error, both together, shape (m,) [m].
    """

    distance: np.ndarray
    pixel_radius: np.ndarray
    mean_error: np.ndarray
    spread: np.ndarray
    rms: np.ndarray

    @property
    def mean_absolute_error(self) -> float:
        """Mean of Figure 2.11 over the distances [m]."""
        return float(np.abs(self.mean_error).mean())


def error_curve(readings: Readings, radius: np.ndarray, estimate: np.ndarray) -> ErrorCurve:
    """Compare estimates with the truth.

    Args:
        readings: The truth, n rows.
        radius: Pixel radius of each reading, shape (n,) [px].
        estimate: Estimated distance of each reading, shape (n,) [m].
    """
    error = readings.distance - estimate
    mean = readings.means(error)
    rms = np.sqrt(readings.means(error**2))
    return ErrorCurve(
        distance=readings.distances,
        pixel_radius=readings.means(radius),
        mean_error=mean,
        spread=np.sqrt(np.maximum(rms**2 - mean**2, 0.0)),
        rms=rms,
    )
