"""A field's crop in patches, each of which one combine cuts in one go along a nearly straight way.

A patch is shrunk along its way as the combine goes on, so that few of them show the edge of the
crop where it is at any time.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import shapely

from ....systems.numerics.harvest.field.combine_path import CombinePath
from ....systems.numerics.harvest.field.coverage import CoveragePlan

# How much a way may turn within a patch [rad], unless the patch would be shorter than this part of
# a header's width.
_TURN, _SHORTEST = 0.12, 0.5
# Crop narrower than this part of a header's width is not worth showing.
_NARROWEST = 0.03
# How far outlines may be off, in headers' widths.
_TOLERANCE = 0.004
# Headers are taken to be wider by this, so that no slivers stay between two rows [m].
_OVERLAP = 1e-3


@dataclass(frozen=True, eq=False)
class CropPatch:
    """Crop that is cut on one stretch of a combine's path.

    Attributes:
        combine: Who cuts it.
        begin: Station at which the header comes to it [m].
        end: Station at which it is cut [m].
        pose: Where the header is then: x, y, theta, of the straight line from its begin; (3,).
        shape: The crop.
        edges: The ways of both ends of the header.
    """

    combine: int
    begin: float
    end: float
    pose: np.ndarray
    shape: shapely.MultiPolygon
    edges: shapely.MultiLineString


def crop_patches(plan: CoveragePlan) -> tuple[tuple[CropPatch, ...], shapely.MultiPolygon]:
    """Divide a field among combines and stretches of their paths, in the plan's order.

    Returns:
        The patches, and what the plan leaves standing.
    """
    half = plan.header_width / 2 + _OVERLAP
    thin = 0.5 * _NARROWEST * plan.header_width
    stretches = [
        (float(plan.timeline.clock_at(n, path.stations[[first]])[0]), n, first, last)
        for n, path in enumerate(plan.paths)
        for first, last in _stretches(path, plan.header_width)
    ]
    standing = polygons_of(plan.field.polygon)
    patches = []
    for _, n, first, last in sorted(stretches):
        path = plan.paths[n]
        left, right = _edges(path, first, last, half)
        swath = _swath(left, right)
        cut = polygons_of(shapely.intersection(standing, swath))
        standing = polygons_of(shapely.difference(standing, swath))
        if cut.buffer(-thin).is_empty:
            continue
        begin, end = path.points[first], path.points[last]
        heading = float(np.arctan2(*(end - begin)[::-1]))
        patches.append(
            CropPatch(
                combine=n,
                begin=float(path.stations[first]),
                end=float(path.stations[last]),
                pose=np.array([*end, heading]),
                shape=polygons_of(cut.simplify(_TOLERANCE * plan.header_width)),
                edges=shapely.MultiLineString([left, right]),
            )
        )
    return tuple(patches), polygons_of(standing.buffer(-thin).buffer(thin, join_style="mitre"))


def _stretches(path: CombinePath, header: float) -> Iterator[tuple[int, int]]:
    """First and last sample of each stretch that is driven forwards and nearly straight on."""
    headings = np.unwrap(path.headings)
    first = 0
    for k, gear in enumerate(path.gears):
        if gear < 0:
            if k > first:
                yield first, k
            first = k + 1
            continue
        turned = abs(headings[k + 1] - headings[first]) > _TURN
        if turned and path.stations[k] - path.stations[first] > _SHORTEST * header:
            yield first, k
            first = k
    if first < len(path.gears):
        yield first, len(path.gears)


def _edges(path: CombinePath, first: int, last: int, half: float) -> tuple[np.ndarray, np.ndarray]:
    """Where the header's left and right ends are at the samples between two, each (n, 2)."""
    points, headings = path.points[first : last + 1], path.headings[first : last + 1]
    side = half * np.stack([-np.sin(headings), np.cos(headings)], axis=1)
    return points + side, points - side


def _swath(left: np.ndarray, right: np.ndarray) -> shapely.Geometry:
    """What a header sweeps over whose ends take these ways."""
    quads = np.stack([left[:-1], left[1:], right[1:], right[:-1]], axis=1)
    # Where the header turns about its own end the quads cross themselves.
    return shapely.union_all(shapely.convex_hull(shapely.polygons(quads)))


def polygons_of(shape: shapely.Geometry) -> shapely.MultiPolygon:
    """The parts of a shape that have an area."""
    return shapely.MultiPolygon([part for part in shapely.get_parts(shape) if part.area > 0])
