"""What slow solutions of the visibility game share."""

from collections.abc import Callable

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.geometry.edge_index import EdgeIndex, point_is_free
from sightfield.systems.numerics.geometry.segment_sight import are_clear, segment_is_clear


def _seen_at_walls(
    index: EdgeIndex, places: np.ndarray, points: np.ndarray, spacing: float, reach: float
) -> np.ndarray:
    """Whether places see the feet of points on walls nearer than a cell, from behind these walls.

    Shape (n, m). Walls that are shorter or thinner than two steps do not count; the longest step
    is `reach` cells.
    """

    def is_left(start, end, point):
        ring = shapely.LinearRing([start, end, point])
        return shapely.Polygon(ring).area > 1e-12 and bool(shapely.is_ccw(ring))

    seen = np.ones((len(places), len(points)), dtype=bool)
    for start, end in index.edges[:, 2:].reshape(-1, 2, 2):
        wall = shapely.LineString([start, end])
        if wall.length < 2 * reach * spacing:
            continue
        inwards = np.array([end[1] - start[1], start[0] - end[0]]) / wall.length
        behind = np.array([is_left(end, start, p) for p in places])
        for k, point in enumerate(points):
            along = wall.project(shapely.Point(point))
            foot = shapely.get_coordinates(wall.interpolate(along))[0]
            near = np.hypot(*(foot - point)) < spacing * (1 - 1e-9)
            beside = 1e-9 < along < wall.length - 1e-9 and is_left(start, end, point)
            if not (near and beside):
                continue
            thick = not point_is_free(index, *(foot + 2 * reach * spacing * inwards))
            if thick and segment_is_clear(index, *point, *foot):
                clear = are_clear(index, places, np.tile(foot, (len(places), 1)))
                seen[:, k] &= clear | ~behind
    return seen


@pytest.fixture(scope="session")
def seen_at_walls() -> Callable[[EdgeIndex, np.ndarray, np.ndarray, float, float], np.ndarray]:
    """Whether places see the feet of points on walls nearer than a cell, from behind them."""
    return _seen_at_walls
