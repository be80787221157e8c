"""The cart seen from above, for pictures: tractor, drawbar, trailer, and what they sweep."""

from itertools import pairwise

import numpy as np
import shapely

from ....systems.numerics.planning.plan import TrailerPath
from ....systems.numerics.planning.trailer import Trailer, trailer_pose

# Width of both bodies, in trailer lengths.
_WIDTH = 0.42


def tractor_shape(trailer: Trailer) -> shapely.Polygon:
    """The tractor about its rear axle, facing along x, with a narrower bonnet in front [m]."""
    size = trailer.length
    cab, bonnet = _WIDTH / 2 * size, _WIDTH / 3 * size
    return shapely.Polygon(
        [
            (-0.12 * size, -cab),
            (0.18 * size, -cab),
            (0.18 * size, -bonnet),
            (0.45 * size, -bonnet),
            (0.5 * size, 0.0),
            (0.45 * size, bonnet),
            (0.18 * size, bonnet),
            (0.18 * size, cab),
            (-0.12 * size, cab),
        ]
    )


def trailer_shape(trailer: Trailer) -> shapely.Polygon:
    """The trailer about its axle, facing along x [m]."""
    size = trailer.length
    return shapely.box(-0.28 * size, -_WIDTH / 2 * size, 0.58 * size, _WIDTH / 2 * size)


def drawbar_shape(trailer: Trailer) -> shapely.Polygon:
    """From the trailer's body to the hitch, in the trailer's frame [m]."""
    size = trailer.length
    return shapely.box(0.58 * size, -0.025 * size, size, 0.025 * size)


def swept_area(path: TrailerPath, trailer: Trailer) -> shapely.Geometry:
    """What tractor and trailer cover on their way [m]."""
    # Close enough together that the outline looks smooth.
    count = max(
        2, round(float(path.times[-1] - path.times[0]) * trailer.speed / trailer.length * 12)
    )
    times = np.linspace(path.times[0], path.times[-1], count)
    x, y, theta, beta = (np.interp(times, path.times, column) for column in path.states.T)
    towed = trailer_pose(x, y, theta, beta, trailer)
    covered = []
    for shape, poses in ((tractor_shape(trailer), (x, y, theta)), (trailer_shape(trailer), towed)):
        placed = [_placed(shape, *pose) for pose in zip(*poses, strict=True)]
        # From each place to the next, so that there are no notches between them.
        covered += [
            shapely.convex_hull(shapely.union(one, other)) for one, other in pairwise(placed)
        ]
    return shapely.simplify(shapely.union_all(covered), 0.002 * trailer.length)


def _placed(shape: shapely.Polygon, x: float, y: float, angle: float) -> shapely.Polygon:
    c, s = np.cos(angle), np.sin(angle)
    return shapely.transform(shape, lambda at: at @ np.array([[c, s], [-s, c]]) + [x, y])
