"""Where machines may be: off the obstacles, and not beyond the margin of the field."""

from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from .harvest_log import Site

# An outline may lie along an obstacle or the end of the margin; deeper in is a fault [m].
TOUCH = 0.01

# Chords to a quarter of the circles that bound the margin at corners.
CHORDS = 32


@dataclass(frozen=True, eq=False)
class Ground:
    """The ground of a field, with the crop on it.

    Attributes:
        crop: Where crop grows.
        obstacles: The holes, but for parts of the field that lie in them.
        allowed: All within the margin, obstacles included.
    """

    crop: BaseGeometry
    obstacles: BaseGeometry
    allowed: BaseGeometry

    @property
    def core(self) -> BaseGeometry:
        """The obstacles less TOUCH all round; those that are thinner stay whole."""
        polygons = shapely.get_parts(self.obstacles)
        thinner = shapely.buffer(polygons, -TOUCH, join_style="mitre")
        return shapely.union_all(np.where(shapely.is_empty(thinner), polygons, thinner))

    @property
    def touched(self) -> BaseGeometry:
        """All within the margin and TOUCH beyond."""
        return self.allowed.buffer(TOUCH, join_style="mitre")


def ground_of(site: Site) -> Ground:
    """The ground of a site: all that is no farther from a part than the margin, corners too."""
    outlines = [part.boundary for part in site.parts]
    grown = [outline.buffer(site.margin, quad_segs=CHORDS) for outline in outlines]
    crops = [part.boundary.difference(shapely.union_all(part.holes)) for part in site.parts]
    crop = shapely.union_all(crops)
    holes = [hole for part in site.parts for hole in (*part.holes, *part.no_go)]
    return Ground(crop, shapely.union_all(holes).difference(crop), shapely.union_all(grown))


def edges_of(region: BaseGeometry) -> np.ndarray:
    """All edges of a region's rings, x and y of both ends, shape (e, 4) [m]."""
    rings = [
        shapely.get_coordinates(ring)
        for polygon in shapely.get_parts(region)
        if isinstance(polygon, shapely.Polygon)
        for ring in (polygon.exterior, *polygon.interiors)
    ]
    edges = [np.hstack([ring[:-1], ring[1:]]) for ring in rings]
    return np.ascontiguousarray(np.concatenate(edges)) if edges else np.zeros((0, 4))
