"""A world: one free region of the plane, with polygonal holes.

The free region is closed. Every ring is stored so that free space lies to the LEFT of each of
its directed edges: the boundary runs counter-clockwise, obstacles run clockwise.

Obstacles are grown with mitred corners (the orange boxes of Zhang 2014, 2.2.8). These contain the
exact rounded offset, so that a centre outside them is at least the radius from every obstacle.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
import shapely
from scipy.spatial import KDTree
from shapely.geometry.base import BaseGeometry

from ..errors import InvalidInput, require, require_non_negative

# Farthest coordinate. Beyond it a wall cannot be told from a crack, and fourth powers soon
# overflow [m].
FARTHEST = 1e12

# A vertex this close to the line of its neighbours, relative to the ring's size, is collinear.
COLLINEAR = 1e-9


def ring_area(ring: np.ndarray) -> float:
    """Signed area of a ring, positive when counter-clockwise, shape (n, 2) [m] -> [m^2]."""
    # Relative to a vertex, so that a far origin costs no digits.
    x, y = (ring - ring[0]).T
    return 0.5 * float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))


def clean_ring(name: str, ring: object) -> np.ndarray:
    """Return a ring as a counter-clockwise float array without repeated or collinear vertices.

    Args:
        name: Name of the ring in error messages.
        ring: Vertices in order, shape (n, 2) [m]; the first may be repeated at the end.

    Raises:
        InvalidInput: Not an array of points, not finite, without area, or crossing itself.
    """
    try:
        points = np.array([list(p) for p in ring], dtype=float)  # type: ignore[union-attr]  # what cannot be iterated is refused below
    except (TypeError, ValueError):
        raise InvalidInput(f"`{name}` must be a list of [x, y] points; got {ring!r}") from None
    require(
        points.ndim == 2 and points.shape[1] == 2,
        name,
        "be a list of [x, y] points",
        "no points" if points.size == 0 else f"an array of shape {points.shape}",
    )
    require(bool(np.isfinite(points).all()), name, "have finite coordinates", points.tolist())
    near = bool((np.abs(points) <= FARTHEST).all())
    require(near, name, f"have coordinates within {FARTHEST:g} m", points.tolist())
    original = points
    points = _drop_redundant(points)
    require(len(points) >= 3, name, "enclose an area", original.tolist())
    outline = shapely.Polygon(points)
    if not outline.is_valid:
        raise InvalidInput(
            f"`{name}` must not cross itself; got {shapely.is_valid_reason(outline)}"
        )
    return points if ring_area(points) > 0 else points[::-1].copy()


def _drop_redundant(points: np.ndarray) -> np.ndarray:
    """Drop repeated and collinear vertices until none is left."""
    size = float(np.hypot(*np.ptp(points, axis=0)))
    while len(points) >= 3:
        before = np.roll(points, 1, axis=0)
        after = np.roll(points, -1, axis=0)
        chord = after - before
        length = np.hypot(*chord.T)
        offset = points - before
        height = np.abs(chord[:, 0] * offset[:, 1] - chord[:, 1] * offset[:, 0])
        height = height / np.where(length > 0, length, 1.0)
        repeated = np.hypot(*offset.T) <= COLLINEAR * size
        # A spike that doubles back has height 0 too, but its tip lies beyond both neighbours;
        # the validity check reports it later.
        between = np.einsum("ij,ij->i", offset, points - after) <= 0
        redundant = repeated | ((height <= COLLINEAR * size) & between)
        if not redundant.any():
            break
        # One at a time in each run: a neighbour of a dropped vertex is tested again.
        keep = ~redundant | np.roll(redundant, 1)
        if redundant.all():
            keep[:] = True
            keep[::2] = False
        points = points[keep]
    return points


# Two points of a world closer than this, relative to its size, are one point.
RELATIVE_TOLERANCE = 1e-9

# An area smaller than this, relative to the world's, is rounding.
NEGLIGIBLE = 1e-12


@dataclass(frozen=True, eq=False)
class Corners:
    """Reflex vertices of a free region: the places behind which something can hide.

    The frame of each corner is the one of the corner game: edge A lies along the frame's
    negative x axis, edge B at the polar angle `angles` - pi, and the obstacle between them.

    Attributes:
        points: Positions, shape (k, 2) [m].
        angles: Interior angle of the obstacle at each corner, in (0, pi), shape (k,) [rad].
        headings: World heading of each frame's positive x axis, shape (k,) [rad].
        lengths: Of edge A and edge B, shape (k, 2) [m].
    """

    points: np.ndarray
    angles: np.ndarray
    headings: np.ndarray
    lengths: np.ndarray

    def __len__(self) -> int:
        return len(self.points)


@dataclass(frozen=True, eq=False)
class World:
    """A closed free region with holes. Build one with `make_world` or `world_from_polygon`.

    Attributes:
        boundary: Outer ring, counter-clockwise, shape (n, 2) [m].
        obstacles: Holes, each clockwise, shape (m, 2) [m].
    """

    boundary: np.ndarray
    obstacles: tuple[np.ndarray, ...]

    @cached_property
    def rings(self) -> tuple[np.ndarray, ...]:
        """The boundary, then the obstacles."""
        return (self.boundary, *self.obstacles)

    @cached_property
    def edges(self) -> np.ndarray:
        """Walls, x0 y0 x1 y1 with free space on the left, ring by ring, shape (k, 4) [m]."""
        return np.vstack([np.hstack([ring, np.roll(ring, -1, axis=0)]) for ring in self.rings])

    @cached_property
    def polygon(self) -> shapely.Polygon:
        """The free region as a Shapely polygon."""
        polygon = shapely.Polygon(self.boundary, list(self.obstacles))
        if polygon.is_valid:
            return polygon
        # A corner that touches an edge may lie behind it, up to rounding.
        outline, *areas = _with_common_vertices([shapely.Polygon(ring) for ring in self.rings])
        free = _free_region(outline, areas)
        return free if isinstance(free, shapely.Polygon) else polygon

    @cached_property
    def bounds(self) -> np.ndarray:
        """[x_min, y_min, x_max, y_max] [m]."""
        return np.concatenate([self.boundary.min(axis=0), self.boundary.max(axis=0)])

    @cached_property
    def size(self) -> float:
        """Side of the square of the same area as the boundary encloses [m]."""
        return math.sqrt(ring_area(self.boundary))

    @cached_property
    def tolerance(self) -> float:
        """Depth to which a line may enter an obstacle and still count as touching it [m].

        It is relative to the size of the world, so that results do not depend on scale or pose,
        and never below the rounding error of coordinates far from the origin.
        """
        return _tolerance(self.boundary)

    @cached_property
    def free_area(self) -> float:
        """Area of the free region [m^2]."""
        return float(sum(ring_area(ring) for ring in self.rings))

    @cached_property
    def vertex_count(self) -> int:
        """Number of vertices of all rings."""
        return sum(len(ring) for ring in self.rings)

    @cached_property
    def corners(self) -> Corners:
        """Every reflex vertex of the free region, ring by ring."""
        points, angles, headings, lengths = [], [], [], []
        for ring in self.rings:
            after = np.roll(ring, -1, axis=0) - ring
            before = np.roll(ring, 1, axis=0) - ring
            # Free space is swept counter-clockwise from `after` to `before`; the obstacle's
            # wedge from `before`, which is edge A, to `after`, which is edge B.
            wedge = np.arctan2(
                before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0],
                np.einsum("ij,ij->i", before, after),
            )
            reflex = (wedge > 0) & (wedge < np.pi)
            points.append(ring[reflex])
            angles.append(wedge[reflex])
            headings.append(np.arctan2(-before[reflex, 1], -before[reflex, 0]))
            both = np.column_stack([np.hypot(*before.T), np.hypot(*after.T)])
            lengths.append(both[reflex])
        parts = (points, angles, headings, lengths)
        return Corners(*(np.concatenate(part) for part in parts))


def make_world(boundary: object, obstacles: Iterable[object] = ()) -> World:
    """Make a world from rings in any vertex order, checking that they bound one free region.

    Obstacles that overlap, or touch along an edge, are merged. Rings closer to each other than the
    world's tolerance count as touching. Obstacles that touch in a point stay separate. Repeated and
    collinear vertices are dropped.

    Args:
        boundary: Outer ring, shape (n, 2) [m]; may be non-convex.
        obstacles: Sequence of rings inside it, each shape (m, 2) [m].

    Raises:
        InvalidInput: A ring has fewer than three corners, is not finite or crosses itself; an
            obstacle leaves the boundary; or the free region is not connected, as when obstacles
            close off a part of it.
    """
    rings = [clean_ring("boundary", boundary)]
    rings += [clean_ring(f"obstacles[{i}]", ring) for i, ring in enumerate(obstacles)]
    outline, *areas = _with_common_vertices([shapely.Polygon(ring) for ring in rings])
    for i, area in enumerate(areas):
        require(
            area.difference(outline).area <= NEGLIGIBLE * outline.area,
            f"obstacles[{i}]",
            "lie inside the boundary",
            np.round(rings[1 + i], 6).tolist(),
        )
    return world_from_polygon(_free_region(outline, areas))


def _with_common_vertices(areas: list[shapely.Polygon]) -> list[shapely.Polygon]:
    """Snap polygons that touch, so that they share exactly the same vertices there.

    A vertex that lies on another ring only up to rounding would leave a crack in their union, or
    not, depending on how the world is rotated.

    Args:
        areas: The first one's ring is the boundary of a world.
    """
    tolerance = _tolerance(shapely.get_coordinates(areas[0]))
    rings = np.array([area.exterior for area in areas], dtype=object)
    close = shapely.STRtree(rings).query(rings, predicate="dwithin", distance=tolerance)
    touching = np.unique(close[0, close[0] != close[1]])
    if len(touching) == 0:
        return areas
    points = np.unique(shapely.get_coordinates(rings[touching]), axis=0)
    # Of several vertices at one point the first is kept.
    first = np.ones(len(points), dtype=bool)
    for i, j in sorted(KDTree(points).query_pairs(tolerance)):
        first[j] &= not first[i]
    common = shapely.MultiPoint(points[first])
    snapped = list(areas)
    for k in touching:
        moved = shapely.snap(areas[k], common, tolerance)
        # A polygon hardly larger than the tolerance would collapse: it is left as it is.
        if isinstance(moved, shapely.Polygon) and moved.is_valid and not moved.is_empty:
            snapped[k] = moved
    return snapped


def _free_region(outline: shapely.Polygon, obstacles: list[shapely.Polygon]) -> BaseGeometry:
    """The outline without the obstacles: a polygon, or several if it falls apart."""
    free = outline.difference(shapely.union_all(obstacles))
    # Rounding may leave splinters where obstacles meet at a small angle.
    parts = [part for part in shapely.get_parts(free) if part.area > NEGLIGIBLE * outline.area]
    return parts[0] if len(parts) == 1 else free


def _tolerance(boundary: np.ndarray) -> float:
    """Tolerance of a world from its boundary, shape (n, 2) [m] -> [m]."""
    rounding = 64 * np.finfo(float).eps * float(np.abs(boundary).max())
    return max(RELATIVE_TOLERANCE * math.sqrt(abs(ring_area(boundary))), rounding)


def world_from_polygon(polygon: object) -> World:
    """Make a world from a Shapely polygon, its holes being the obstacles.

    Raises:
        InvalidInput: It is not one valid polygon with an area.
    """
    require(
        isinstance(polygon, shapely.Polygon) and not polygon.is_empty,
        "free region",
        "be one connected polygon",
        getattr(polygon, "geom_type", type(polygon).__name__)
        + (" (empty)" if getattr(polygon, "is_empty", False) else ""),
    )
    assert isinstance(polygon, shapely.Polygon)
    if not polygon.is_valid:
        raise InvalidInput(
            f"`free region` must be a valid polygon; got {shapely.is_valid_reason(polygon)}"
        )
    outer = clean_ring("boundary", polygon.exterior.coords)
    holes = [
        clean_ring(f"obstacles[{i}]", ring.coords)[::-1].copy()
        for i, ring in enumerate(polygon.interiors)
    ]
    return World(outer, tuple(holes))


def begin_leftmost(world: World) -> World:
    """The same world, with each ring starting at its leftmost corner (the lowest of several).

    Obstacles are sorted by these corners, from the left.
    """

    def begun(ring: np.ndarray) -> np.ndarray:
        # Rounded to 1 mm: after projection, corners above one another differ by rounding errors.
        x, y = np.round(ring, 3).T
        return np.roll(ring, -int(np.lexsort((y, x))[0]), axis=0)

    obstacles = sorted(map(begun, world.obstacles), key=lambda ring: tuple(np.round(ring[0], 3)))
    return World(begun(world.boundary), tuple(obstacles))


# A mitre reaches at most this many radii from its corner; sharper corners are cut off there.
MITRE_LIMIT = 2.0


@lru_cache(maxsize=8)
def shrink_world(world: World, radius: float) -> tuple[World, ...]:
    """Shrink a free region by a radius [m]; narrow passages may split it into several.

    Results are cached: games in one world get the same parts, so that they share solved tables.

    Returns:
        The parts, largest first; the world itself for radius 0.

    Raises:
        InvalidInput: The radius is negative or leaves no free space.
    """
    require_non_negative("radius", radius)
    if radius == 0.0:
        return (world,)
    shrunk = world.polygon.buffer(-radius, join_style="mitre", mitre_limit=MITRE_LIMIT)
    parts = [part for part in shapely.get_parts(shrunk) if part.area > world.tolerance**2]
    if not parts:
        raise InvalidInput(f"`radius` must leave free space in the world; got {radius}")
    parts.sort(key=lambda part: -part.area)
    return tuple(world_from_polygon(part) for part in parts)
