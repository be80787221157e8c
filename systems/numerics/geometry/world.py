"""A world: one free region of the plane, with polygonal holes.

The free region is closed. Every ring is stored so that free space lies to the LEFT of each of
its directed edges: the boundary runs counter-clockwise, obstacles run clockwise.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely

from ..errors import InvalidInput, require
from .rings import clean_ring, ring_area

# Two points of a world closer than this, relative to its size, are one point.
RELATIVE_TOLERANCE = 1e-9


@dataclass(frozen=True, eq=False)
class Corners:
    """Reflex vertices of a free region: the places behind which something can hide.

    The frame of each corner is the one of the corner game: edge A lies along the frame's
    negative x axis, edge B at the polar angle `angles` - pi, and the obstacle between them.

    Attributes:
        points: Positions, shape (k, 2) [m].
        angles: Interior angle of the obstacle at each corner, in (0, pi), shape (k,) [rad].
        headings: World heading of each frame's positive x axis, shape (k,) [rad].
    """

    points: np.ndarray
    angles: np.ndarray
    headings: np.ndarray

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
    def polygon(self) -> shapely.Polygon:
        """The free region as a Shapely polygon."""
        return shapely.Polygon(self.boundary, list(self.obstacles))

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

        Relative to the size of the world, so that results do not depend on its scale or pose;
        never below what rounding leaves of coordinates far from the origin.
        """
        rounding = 64 * np.finfo(float).eps * float(np.abs(self.bounds).max())
        return max(RELATIVE_TOLERANCE * self.size, rounding)

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
        points, angles, headings = [], [], []
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
        return Corners(np.concatenate(points), np.concatenate(angles), np.concatenate(headings))


def make_world(boundary: object, obstacles: Iterable[object] = ()) -> World:
    """Make a world from rings in any vertex order, checking that they bound one free region.

    Repeated and collinear vertices are dropped.

    Args:
        boundary: Outer ring, shape (n, 2) [m]; may be non-convex.
        obstacles: Sequence of rings inside it, each shape (m, 2) [m].

    Raises:
        InvalidInput: A ring has fewer than three corners, is not finite or crosses itself; two
            obstacles overlap; an obstacle leaves the boundary; or the free region is not
            connected.
    """
    outer = clean_ring("boundary", boundary)
    holes = [clean_ring(f"obstacles[{i}]", ring) for i, ring in enumerate(obstacles)]
    outline = shapely.Polygon(outer)
    areas = [shapely.Polygon(hole) for hole in holes]
    negligible = 1e-12 * outline.area
    for i, area in enumerate(areas):
        require(
            area.difference(outline).area <= negligible,
            f"obstacles[{i}]",
            "lie inside the boundary",
            _show(holes[i]),
        )
    for i, j in _touching(areas):
        if i > j and areas[i].intersection(areas[j]).area > negligible:
            raise InvalidInput(
                f"`obstacles[{i}]` must not overlap obstacles[{j}]; "
                f"got {_show(holes[i])} over {_show(holes[j])}"
            )
    return world_from_polygon(outline.difference(shapely.union_all(areas)))


def _touching(areas: list[shapely.Polygon]) -> np.ndarray:
    """Pairs of numbers of polygons that have a point in common, shape (n, 2)."""
    polygons = np.array(areas, dtype=object)
    return shapely.STRtree(polygons).query(polygons, predicate="intersects").T


def _show(ring: np.ndarray) -> str:
    return str(np.round(ring, 6).tolist())


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
