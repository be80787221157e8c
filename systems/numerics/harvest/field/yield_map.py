"""Grain on a field: as much everywhere, or place by place."""

from dataclasses import dataclass

import numpy as np
import shapely

from ...errors import require, require_positive

# Between the places that a mean is taken over, as a part of the longer side of the ground [-].
FINE = 1 / 400


@dataclass(frozen=True, eq=False)
class YieldMap:
    """Grain in square cells, even within each; beyond them counts the nearest.

    Attributes:
        corner: x, y of the corner of the first cell, shape (2,) [m].
        side: Of a cell [m].
        values: Grain, rows from south to north, shape (rows, columns) [kg/m^2].

    Raises:
        InvalidInput: The side is not positive, there is no cell, or grain is negative or not
            finite.
    """

    corner: np.ndarray
    side: float
    values: np.ndarray

    def __post_init__(self) -> None:
        require_positive("side", self.side)
        require(self.values.ndim == 2 and self.values.size > 0, "values", "be cells", "none")
        sound = bool((np.isfinite(self.values) & (self.values >= 0)).all())
        require(sound, "yields", "be finite, zero or positive", "others")

    def at(self, points: np.ndarray) -> np.ndarray:
        """Grain at points, shape (n, 2) [m] -> (n,) [kg/m^2]."""
        column, row = np.floor((np.asarray(points) - self.corner) / self.side).T
        rows, columns = self.values.shape
        row, column = np.clip(row, 0, rows - 1), np.clip(column, 0, columns - 1)
        return self.values[row.astype(int), column.astype(int)]

    def on_cells(self, corner: np.ndarray, side: float, shape: tuple[int, int]) -> np.ndarray:
        """Grain at the middles of the cells of another grid, shape (rows, columns) [kg/m^2].

        Args:
            corner: x, y of the corner of its first cell, shape (2,) [m].
            side: Of its cells [m].
            shape: Their rows and columns.
        """
        places = []
        for axis, count in ((1, shape[0]), (0, shape[1])):
            middles = corner[axis] + side * (np.arange(count) + 0.5)
            numbers = np.floor((middles - self.corner[axis]) / self.side).astype(int)
            places.append(np.clip(numbers, 0, self.values.shape[1 - axis] - 1))
        return self.values[np.ix_(*places)]


def grain_on_cells(
    density: float | YieldMap, corner: np.ndarray, side: float, shape: tuple[int, int]
) -> np.ndarray:
    """Grain on each cell of a grid, shape (rows, columns) [kg].

    Args:
        density: Of the crop [kg/m^2].
        corner: x, y of the corner of the first cell, shape (2,) [m].
        side: Of the cells [m].
        shape: Their rows and columns.
    """
    if isinstance(density, YieldMap):
        return side**2 * density.on_cells(corner, side, shape)
    return np.full(shape, side**2 * density)


def mean_density(density: float | YieldMap, ground: shapely.Polygon) -> float:
    """Grain on the mean of some ground [kg/m^2].

    Args:
        density: Of the crop [kg/m^2].
        ground: What the mean is taken over.
    """
    if not isinstance(density, YieldMap):
        return density
    x_low, y_low, x_high, y_high = ground.bounds
    step = min(FINE * max(x_high - x_low, y_high - y_low), density.side / 2)
    step = max(step, FINE / 5 * max(x_high - x_low, y_high - y_low))
    x, y = np.meshgrid(np.arange(x_low, x_high, step), np.arange(y_low, y_high, step))
    places = np.column_stack([x.ravel(), y.ravel()]) + step / 2
    inside = shapely.contains_xy(ground, *places.T)
    return float(density.at(places[inside]).mean())
