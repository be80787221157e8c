"""The ground that a machine covers on its way, cell by cell of a grid of stations.

Cell k is the way from station k to station k + 1. The first and the last cell have no length: on
them the machine stands where it begins and where it ends. What a part of the machine (a header, a
body, a trailer) covers on a cell lies within the cell's margin of a convex polygon: the hull of the
part's corners at a few poses on the way. Between two of these poses, phi apart in heading, a corner
moves along an arc with the chord d, from which it departs by no more than d / 2 tan(phi / 4). Every
other point of the part is a weighted mean of its corners, and the hull is convex, so the margin is
enough for all.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...compiled import compiled
from ...errors import require, require_positive
from ..machines import CartOutline, convex_hull
from ..paths import MachinePath, poses_between

# Stations closer than this are one [m].
SAME = 1e-6


class Sweep(NamedTuple):
    """What a machine covers on the cells of its path.

    Attributes:
        stations: Where cells begin and end, shape (n + 1,) [m].
        points: Corners of all polygons, counterclockwise, shape (p, 2) [m].
        starts: Index of the first corner of each polygon in `points`, then their total number;
            cell k has the polygons k * parts to (k + 1) * parts - 1; shape (n * parts + 1,).
        parts: Number of polygons of a cell.
        margins: How far the ground covered on each cell reaches beyond its polygons, shape (n,)
            [m].
        discs: x, y, radius of a disc round the polygons of each cell, shape (n, 3) [m].
        polygon_discs: The same of each polygon, shape (n * parts, 3) [m].
    """

    stations: np.ndarray
    points: np.ndarray
    starts: np.ndarray
    parts: int
    margins: np.ndarray
    discs: np.ndarray
    polygon_discs: np.ndarray

    @property
    def cells(self) -> int:
        """Number of cells."""
        return len(self.margins)


def grid_stations(
    path: MachinePath,
    spacing: float = 1.0,
    stops: Sequence[float] | np.ndarray = (),
    moved: np.ndarray | None = None,
) -> np.ndarray:
    """Stations of a grid: evenly spaced ones, the path's cusps and its stops; both ends twice.

    Args:
        path: Where the machine drives.
        spacing: Longest cell [m].
        stops: Stations at which it stands for a reason of its own, shape (k,) [m].
        moved: Way on each piece of the path by which cells are measured, by default that of the
            reference point; see `outline_ways`; shape (p - 1,) for p poses [m].

    Returns:
        Never decreasing, shape (n + 1,) [m]; a path of no length has one cell.

    Raises:
        InvalidInput: The spacing is not positive, or a stop is not on the path.
    """
    require_positive("spacing", spacing)
    halts = np.asarray(stops, dtype=float)
    outside = halts[(halts < 0) | (halts > path.length)]
    require(not len(outside), "stops", f"be from 0 to {path.length:.6g} m", outside[:1])
    if path.length <= SAME:
        return np.zeros(2)
    kept = np.sort(np.concatenate([[0.0, path.length], halts, path.cusps]))
    kept = kept[np.append(True, np.diff(kept) > SAME)]
    if moved is None:
        even = path.stations_every(spacing)
    else:
        ways = np.append(0.0, np.cumsum(moved))
        count = max(1, int(np.ceil(ways[-1] / spacing - 1e-9)))
        even = np.interp(np.linspace(0.0, ways[-1], count + 1), ways, path.stations)
    near = _away(even, kept)
    return np.sort(np.concatenate([kept, even[near > SAME], [0.0, path.length]]))


def outline_ways(poses: np.ndarray, outline: Sequence[np.ndarray]) -> np.ndarray:
    """Bound on the way that any point of a machine moves between poses, shape (n - 1,) [m].

    In a turn the end of a header, and the tail, go much farther than the reference point: over an
    arc of length l that turns by phi a point (x, y) goes no more than |(l + phi |y|, phi x)|.

    Args:
        poses: Of the reference point, which moves along its heading, shape (n, 3).
        outline: Convex parts in its frame, each of shape (c, 2) [m].
    """
    turned = np.abs(np.diff(poses[:, 2]))
    lengths = np.hypot(*np.diff(poses[:, :2], axis=0).T) / np.sinc(turned / (2 * np.pi))
    x, y = np.abs(np.concatenate(outline)).T
    ways = np.hypot(lengths[:, None] + turned[:, None] * y, turned[:, None] * x)
    return ways.max(axis=1, initial=0.0)


def sweep_of(path: MachinePath, outline: Sequence[np.ndarray], stations: np.ndarray) -> Sweep:
    """What a rigid machine covers, such as a combine.

    Args:
        path: Of its reference point.
        outline: Its convex parts in the frame of that point, counterclockwise, each of shape
            (c, 2) [m], such as a `CombineOutline`.
        stations: Of the grid, from `grid_stations`, shape (n + 1,) [m].
    """
    at, first = _fine(path, stations)
    poses = path.pose_at(at)
    return _sweep(stations, first, [(part, poses) for part in outline])


def cart_sweep(
    path: MachinePath, trailer_poses: np.ndarray, outline: CartOutline, stations: np.ndarray
) -> Sweep:
    """What a tractor and its trailer cover.

    Args:
        path: Of the tractor's rear axle.
        trailer_poses: Of the trailer's axle at each pose of the path, theta continuous; in between
            the trailer is taken to move by a constant twist too, so they should be dense (0.5 m),
            shape (n, 3) [m], [m], [rad].
        outline: Of both.
        stations: Of the grid, from `grid_stations`, shape (n + 1,) [m].

    Raises:
        InvalidInput: There is not a pose of the trailer for each pose of the path.
    """
    require(
        trailer_poses.shape == path.poses.shape,
        "trailer_poses",
        f"have shape {path.poses.shape}",
        trailer_poses.shape,
    )
    at, first = _fine(path, stations)
    trailer = towed_poses(path, trailer_poses, at)
    return _sweep(
        stations, first, [(outline.tractor, path.pose_at(at)), (outline.trailer, trailer)]
    )


def towed_poses(path: MachinePath, poses: np.ndarray, stations: np.ndarray) -> np.ndarray:
    """Poses of something that moves by a constant twist while its leader drives a piece of a path.

    Args:
        path: Of the leader.
        poses: At the poses of the path, shape (n, 3) [m], [m], [rad].
        stations: Of the leader, on the path, shape (...) [m].

    Returns:
        Shape (..., 3) [m], [m], [rad].
    """
    if len(poses) == 1:
        return np.broadcast_to(poses[0], (*stations.shape, 3)).copy()
    piece, _, share = path.share_at(stations)
    begin, end = poses[piece], poses[piece + 1]
    chords = np.hypot(end[..., 0] - begin[..., 0], end[..., 1] - begin[..., 1])
    ways = chords / np.sinc((end[..., 2] - begin[..., 2]) / (2 * np.pi))
    return poses_between(begin, end, share, share * ways)


def _away(even: np.ndarray, kept: np.ndarray) -> np.ndarray:
    """Distance of each station to the nearest of those that are kept."""
    after = np.clip(np.searchsorted(kept, even), 1, len(kept) - 1)
    return np.minimum(np.abs(even - kept[after - 1]), np.abs(even - kept[after]))


def _fine(path: MachinePath, stations: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Stations of cells, their middles and the path's poses, and the numbers of those of cells.

    The twist is constant between any two of them.
    """
    middles = (stations[:-1] + stations[1:]) / 2
    at = np.unique(np.concatenate([stations, middles, path.stations]))
    return at, np.searchsorted(at, stations)


def _sweep(stations, first, parts) -> Sweep:
    count = len(stations) - 1
    margins = np.zeros(count)
    hulls, sizes = [], []
    for corners, poses in parts:
        points, starts, beyond = _hulls(np.ascontiguousarray(corners), poses, first)
        hulls.append(points)
        sizes.append(np.diff(starts))
        margins = np.maximum(margins, beyond)
    # Polygons were made part by part; they are put in order cell by cell.
    sizes = np.stack(sizes)
    begins = np.cumsum(sizes.ravel()) - sizes.ravel()
    order = np.arange(sizes.size).reshape(sizes.shape).T.ravel()
    starts = np.concatenate([[0], np.cumsum(sizes.ravel()[order])])
    taken = np.repeat(begins[order] - starts[:-1], np.diff(starts)) + np.arange(starts[-1])
    points = np.concatenate(hulls)[taken]
    polygon_discs = _discs(points, starts)
    discs = _discs(points, starts[:: len(parts)])
    return Sweep(stations, points, starts, len(parts), margins, discs, polygon_discs)


def _discs(points: np.ndarray, starts: np.ndarray) -> np.ndarray:
    """Discs round the middles of the boxes of groups of points, shape (q, 3) [m]."""
    low = np.minimum.reduceat(points, starts[:-1])
    high = np.maximum.reduceat(points, starts[:-1])
    middle = (low + high) / 2
    off = points - np.repeat(middle, np.diff(starts), axis=0)
    radius = np.maximum.reduceat(np.hypot(off[:, 0], off[:, 1]), starts[:-1])
    return np.column_stack([middle, radius])


@compiled
def _hulls(corners, poses, first):
    """Hull of the corners at all poses of each cell, and how far arcs reach beyond.

    Returns:
        Points, where those of each cell start, margins.
    """
    cells, size = len(first) - 1, len(corners)
    most = 0
    for k in range(cells):
        most = max(most, first[k + 1] - first[k] + 1)
    cloud = np.empty((most * size, 2))
    hull = np.empty((2 * most * size, 2))
    points = np.empty(((len(poses) + cells) * size, 2))
    starts = np.zeros(cells + 1, dtype=np.int64)
    margins = np.zeros(cells)
    for k in range(cells):
        count = 0
        for p in range(first[k], first[k + 1] + 1):
            x, y, theta = poses[p]
            c, s = np.cos(theta), np.sin(theta)
            for q in range(size):
                cloud[count, 0] = x + c * corners[q, 0] - s * corners[q, 1]
                cloud[count, 1] = y + s * corners[q, 0] + c * corners[q, 1]
                if p > first[k]:
                    chord = np.hypot(
                        cloud[count, 0] - cloud[count - size, 0],
                        cloud[count, 1] - cloud[count - size, 1],
                    )
                    beyond = chord / 2 * np.tan(abs(theta - poses[p - 1, 2]) / 4)
                    margins[k] = max(margins[k], beyond)
                count += 1
        size_of_hull = convex_hull(cloud, count, hull)
        points[starts[k] : starts[k] + size_of_hull] = hull[:size_of_hull]
        starts[k + 1] = starts[k] + size_of_hull
    return points[: starts[cells]].copy(), starts, margins
