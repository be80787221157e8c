"""Where a pursuer would lose an evader some day, by the solved visibility game."""

from collections.abc import Callable

import numpy as np
import shapely

from ...systems.numerics.errors import InvalidInput
from ...systems.numerics.tracking.visibility_game.guaranteed_times import GuaranteedTimes


def losing_strips(
    table: GuaranteedTimes,
    visibility_polygon: Callable[[np.ndarray], np.ndarray],
    pursuer: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Strips of cells in a pursuer's sight from which an evader escapes in the end.

    Args:
        table: The game, solved.
        visibility_polygon: From a point to what it sees, shape (n, 2) [m].
        pursuer: Shape (2,) [m].

    Returns:
        x_min, y_min, x_max, y_max of each strip, along x, of cells that are kept equally long,
        shape (k, 4) [m]; and for how long, shape (k,) [s]. None where the pursuer cannot be.
    """
    try:
        times = table.times_from(pursuer)
    except InvalidInput:
        return np.zeros((0, 4)), np.zeros(0)
    grid = table.evader_grid
    points = grid.points
    seen = shapely.Polygon(visibility_polygon(pursuer))
    shapely.prepare(seen)
    losing = np.isfinite(times)
    losing[losing] = shapely.contains_xy(seen, points[losing])
    kept = np.where(losing, times, -1.0)
    # A strip begins and ends where the time changes along a row.
    edges = np.ones((grid.rows, grid.columns + 1), dtype=bool)
    edges[:, 1:-1] = kept[:, 1:] != kept[:, :-1]
    rows, columns = np.nonzero(edges)
    within = rows[1:] == rows[:-1]
    row, first, last = rows[:-1][within], columns[:-1][within], columns[1:][within]
    lost = kept[row, first] >= 0.0
    row, first, last = row[lost], first[lost], last[lost]
    half = 0.5 * grid.spacing
    low, high = grid.at(row, first) - half, grid.at(row, last - 1) + half
    return np.column_stack([low, high]), kept[row, first]
