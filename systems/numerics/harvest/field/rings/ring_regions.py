"""Rings: what the combines' middles go round, from the field's edge inwards.

Ring k is the outline of a region, every point of which is (k + 1/2) header widths or more from
the edge. A region falls into several as it shrinks, and vanishes; the rings make a tree.
"""

from collections.abc import Sequence

import shapely
from shapely.geometry.base import BaseGeometry

# Segments in a quarter of an arc.
ARC = 24


def shrink(region: BaseGeometry, width: float) -> list[shapely.Polygon]:
    """What of a region is farther than a width from its edge, largest piece first.

    Args:
        region: Which.
        width: [m].
    """
    return polygons(region.buffer(-width, quad_segs=ARC))


def polygons(geometry: BaseGeometry, least_area: float = 1e-9) -> list[shapely.Polygon]:
    """The polygons of a geometry that have some area, largest first.

    Args:
        geometry: Which.
        least_area: Smaller ones are left out [m^2].
    """
    parts = [
        part
        for part in shapely.get_parts(geometry, return_index=False).tolist()
        if isinstance(part, shapely.Polygon) and part.area > least_area
    ]
    return sorted(parts, key=lambda part: -part.area)


def round_reflex_corners(
    region: shapely.Polygon, radius: float, header: float, ground: BaseGeometry
) -> BaseGeometry:
    """Give a region's reflex corners the radius that combines can turn to the left with.

    Corners are rounded outwards, so that nothing is missed, as far as the header then stays on
    the ground; elsewhere, round obstacles above all, the way is led round at the radius.

    Args:
        region: What the combine's middle goes round.
        radius: Least turning radius [m].
        header: Width of the header [m].
        ground: Where the header may be.
    """
    rounded = region.buffer(radius, join_style="mitre").buffer(-radius, quad_segs=ARC)
    for part in polygons(rounded.difference(region), least_area=1e-6):
        swept = part.buffer(header / 2)
        outside = swept.difference(ground)
        if outside.area > 1e-3 * header**2:
            keep_off = outside.buffer(max(radius, header / 2), quad_segs=ARC)
            rounded = rounded.difference(part).difference(keep_off)
    return rounded


def round_convex_corners(region: BaseGeometry, radius: float) -> list[shapely.Polygon]:
    """What of a region a disc reaches that stays inside: corners get the disc's radius.

    Args:
        region: Which.
        radius: Of the disc [m].
    """
    return polygons(region.buffer(-radius, quad_segs=ARC).buffer(radius, quad_segs=ARC))


def fill_holes(region: shapely.Polygon) -> shapely.Polygon:
    """A region with nothing left out."""
    return shapely.Polygon(region.exterior)


def union(regions: Sequence[BaseGeometry]) -> BaseGeometry:
    """All of several regions."""
    return shapely.union_all(list(regions))
