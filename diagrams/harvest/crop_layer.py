"""The field: crop that turns to stubble as combines pass, margin, obstacles.

The crop is in patches, each of which one combine cuts in one go along a nearly straight way. A
patch is shrunk along its way as the combine goes on, so that few of them show the edge of the crop
where it is at any time.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from ...systems.numerics.harvest.field.field import Field
from ...systems.numerics.harvest.machines import CombineSize
from ...systems.numerics.harvest.paths import MachinePath, TimedPath
from ..tracking.scene.layout import Layout
from ..visuals.meshes import Mesh, extruded_mesh, filled_parts, flat_mesh, unpinched
from ..visuals.stage import Stage
from .colours import CROP, CROP_ROWS, MARGIN_GROUND, OBSTACLE, STUBBLE, crop_paint
from .job import HarvestJob

# How much a way may turn within a patch [rad], unless the patch would be shorter than this part of
# a header's width.
_TURN, _SHORTEST = 0.12, 0.5
# Distance of the poses on a stretch, in headers' widths.
_STEP = 0.1
# Crop narrower than this part of a header's width is not worth showing.
_NARROWEST = 0.03
# How far outlines may be off, in headers' widths.
_TOLERANCE = 0.004
# Headers are taken to be wider by this, so that no slivers stay between two rows [m].
_OVERLAP = 1e-3

# Heights of crop, which is seen a little from the south, and of obstacles, in view heights.
_CROP_HEIGHT, _OBSTACLE_HEIGHT = 0.004, 0.006
_STUBBLE_LEVEL = 0.0006
# Width of the lines between rows, in view heights.
_ROW_LINE = 0.0022


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


def crop_patches(
    field: Field, combine: CombineSize, plans: Sequence[TimedPath]
) -> tuple[tuple[CropPatch, ...], shapely.MultiPolygon]:
    """Divide a field among combines and stretches of their paths, in the plan's order.

    Args:
        field: The field.
        combine: The size of the combines.
        plans: Of all combines.

    Returns:
        The patches, and what the plan leaves standing.
    """
    thin = 0.5 * _NARROWEST * combine.header_width
    stretches = [
        (_first_time(timed, stretch[0]), n, stretch)
        for n, timed in enumerate(plans)
        for stretch in _stretches(timed.path, combine.header_width)
    ]
    standing = filled_parts(field.polygon)
    patches = []
    for _, n, stations in sorted(stretches, key=lambda each: each[:2]):
        poses = plans[n].path.pose_at(stations)
        left, right = _edges(poses, combine)
        swath = _swath(left, right)
        cut = filled_parts(shapely.intersection(standing, swath))
        standing = filled_parts(shapely.difference(standing, swath))
        if cut.buffer(-thin).is_empty:
            continue
        begin, end = poses[0, :2], poses[-1, :2]
        heading = float(np.arctan2(*(end - begin)[::-1]))
        patches.append(
            CropPatch(
                combine=n,
                begin=float(stations[0]),
                end=float(stations[-1]),
                pose=np.array([*end, heading]),
                shape=filled_parts(cut.simplify(_TOLERANCE * combine.header_width)),
                edges=shapely.MultiLineString([left, right]),
            )
        )
    return tuple(patches), filled_parts(standing.buffer(-thin).buffer(thin, join_style="mitre"))


def _first_time(timed: TimedPath, station: float) -> float:
    """When a machine is at a station, about: its times are dense where it is slow [s]."""
    return float(np.interp(station, timed.stations, timed.times))


def _stretches(path: MachinePath, header: float) -> Iterator[np.ndarray]:
    """Stations on each stretch that is driven cutting and nearly straight on."""
    fine = np.unique(np.concatenate([path.stations, path.stations_every(_STEP * header)]))
    headings = path.pose_at(fine)[:, 2]
    cuts = path.cutting[path.piece_at((fine[:-1] + fine[1:]) / 2)]
    first = 0
    for k, cutting in enumerate(cuts):
        if not cutting:
            if k > first:
                yield fine[first : k + 1]
            first = k + 1
            continue
        turned = abs(headings[k + 1] - headings[first]) > _TURN
        if turned and fine[k] - fine[first] > _SHORTEST * header:
            yield fine[first : k + 1]
            first = k
    if first < len(cuts):
        yield fine[first:]


def _edges(poses: np.ndarray, combine: CombineSize) -> tuple[np.ndarray, np.ndarray]:
    """Where the header's left and right ends are on a way of poses (n, 3), each (n + 2, 2).

    The header is as deep as it is: its rear begins, its front ends.
    """
    ahead = np.column_stack([np.cos(poses[:, 2]), np.sin(poses[:, 2])])
    points, deep = poses[:, :2], combine.header_depth / 2
    points = np.vstack([points[0] - deep * ahead[0], points, points[-1] + deep * ahead[-1]])
    ahead = np.vstack([ahead[0], ahead, ahead[-1]])
    side = (combine.header_width / 2 + _OVERLAP) * np.column_stack([-ahead[:, 1], ahead[:, 0]])
    return points + side, points - side


def _swath(left: np.ndarray, right: np.ndarray) -> shapely.Geometry:
    """What a header sweeps over whose ends take these ways."""
    quads = np.stack([left[:-1], left[1:], right[1:], right[:-1]], axis=1)
    # Where the header turns about its own end the quads cross themselves.
    return shapely.union_all(shapely.convex_hull(shapely.polygons(quads)))


class CropLayer:
    """Patches of crop at `crop/K/patch`, a little in the colour of who cuts them; stubble below."""

    def __init__(self, stage: Stage, layout: Layout, job: HarvestJob) -> None:
        """Draw the field before the harvest."""
        self._stage, self._span = stage, layout.span
        patches, left = crop_patches(job.field, job.scenario.combines, job.plan.service.plans)
        self._combines = np.array([patch.combine for patch in patches], dtype=int)
        self._begins = np.array([patch.begin for patch in patches])
        self._ends = np.array([patch.end for patch in patches])
        self._lengths = np.full(len(patches), -1.0)
        height = _CROP_HEIGHT * layout.span
        _draw_ground(stage, layout, job.field)
        stage.raise_to("stubble", _STUBBLE_LEVEL * layout.span)
        for parity, colour in enumerate(STUBBLE):
            shapes = [patch.shape for patch in patches if patch.combine % 2 == parity]
            if shapes:
                stage.mesh(f"stubble/{parity}", flat_mesh(shapely.union_all(shapes)), colour)
        if left.area > 0:
            stage.mesh("missed", extruded_mesh(left, 0.0, height), CROP)
        for k, patch in enumerate(patches):
            self._draw_patch(f"crop/{k}", patch, height)

    def update(self, stations: np.ndarray) -> None:
        """Leave what stands when combines are at stations, shape (N,) [m]."""
        lengths = np.clip(self._ends - stations[self._combines], 0.0, self._ends - self._begins)
        for k in np.flatnonzero(lengths != self._lengths).tolist():
            length = float(lengths[k])
            if length > 0.0:
                self._stage.stretch(f"crop/{k}/patch", length)
            self._stage.show(f"crop/{k}/patch", length > 0.0)
        self._lengths = lengths

    def _draw_patch(self, path: str, patch: CropPatch, height: float) -> None:
        crop, rows = patch_meshes(patch, height, _ROW_LINE * self._span)
        self._stage.mesh(f"{path}/patch", crop, crop_paint(patch.combine))
        if rows is not None:
            self._stage.mesh(f"{path}/patch/rows", rows, CROP_ROWS)
        x, y, theta = patch.pose.tolist()
        self._stage.pose(path, x, y, theta + math.pi, reach=patch.end - patch.begin)


def patch_meshes(patch: CropPatch, height: float, line: float) -> tuple[Mesh, Mesh | None]:
    """A patch of length 1, to be stretched, and lines between it and the next rows, if it has any.

    Args:
        patch: The patch.
        height: Of the crop [m].
        line: Width of the lines [m].
    """
    crop = unpinched(seen_back(patch, patch.shape))
    edges = shapely.buffer(seen_back(patch, patch.edges), line / 2, cap_style="flat")
    lines = filled_parts(shapely.intersection(crop, edges))
    shrink = [1.0 / (patch.end - patch.begin), 1.0]
    unit, rows = (
        shapely.transform(shape, lambda points: points * shrink) for shape in (crop, lines)
    )
    drawn = flat_mesh(rows, 1.1 * height) if lines.area > 0 else None
    return extruded_mesh(unit, 0.0, height), drawn


def seen_back(patch: CropPatch, shape: shapely.Geometry) -> shapely.Geometry:
    """A shape seen from where a patch ends, with x back along the combine's way.

    Args:
        patch: The patch.
        shape: Of the field [m].
    """
    x, y, theta = patch.pose
    c, s = -np.cos(theta), -np.sin(theta)
    return shapely.transform(shape, lambda points: (points - [x, y]) @ np.array([[c, -s], [s, c]]))


def _draw_ground(stage: Stage, layout: Layout, field: Field) -> None:
    stage.mesh("ground/margin", flat_mesh(field.ground), MARGIN_GROUND)
    height = _OBSTACLE_HEIGHT * layout.span
    for k, obstacle in enumerate(field.obstacles):
        stage.mesh(f"ground/obstacles/{k}", extruded_mesh(obstacle, 0.0, height), OBSTACLE)
