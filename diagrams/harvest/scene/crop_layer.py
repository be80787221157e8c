"""The field: crop that turns to stubble as combines pass, margin, obstacles."""

import math

import numpy as np
import shapely

from ....systems.numerics.harvest.field.field import Field
from ...tracking.scene.layout import Layout
from ...visuals.meshes import extruded_mesh, flat_mesh
from ...visuals.stage import Stage
from ..job import HarvestJob
from .crop_patches import CropPatch, crop_patches, polygons_of
from .palette import CROP, CROP_ROWS, MARGIN_GROUND, OBSTACLE, STUBBLE, crop_paint

# Heights of crop, which is seen a little from the south, and of obstacles, in view heights.
_CROP_HEIGHT, _OBSTACLE_HEIGHT = 0.004, 0.006
_STUBBLE_LEVEL = 0.0006
# Width of the lines between rows, in view heights.
_ROW_LINE = 0.0022


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
        """A patch of length 1, to be stretched, with lines between it and the next rows."""
        crop = _seen_back(patch, patch.shape)
        edges = shapely.buffer(
            _seen_back(patch, patch.edges), 0.5 * _ROW_LINE * self._span, cap_style="flat"
        )
        lines = polygons_of(shapely.intersection(crop, edges))
        shrink = [1.0 / (patch.end - patch.begin), 1.0]
        unit = shapely.transform(crop, lambda points: points * shrink)
        self._stage.mesh(
            f"{path}/patch", extruded_mesh(unit, 0.0, height), crop_paint(patch.combine)
        )
        if lines.area > 0:
            unit = shapely.transform(lines, lambda points: points * shrink)
            self._stage.mesh(f"{path}/patch/rows", flat_mesh(unit, 1.1 * height), CROP_ROWS)
        x, y, theta = patch.pose.tolist()
        self._stage.pose(path, x, y, theta + math.pi, reach=patch.end - patch.begin)


def _seen_back(patch: CropPatch, shape: shapely.Geometry) -> shapely.Geometry:
    """A shape seen from where a patch ends, with x back along the combine's way."""
    x, y, theta = patch.pose
    c, s = -np.cos(theta), -np.sin(theta)
    return shapely.transform(shape, lambda points: (points - [x, y]) @ np.array([[c, -s], [s, c]]))


def _draw_ground(stage: Stage, layout: Layout, field: Field) -> None:
    stage.mesh("ground/margin", flat_mesh(field.ground), MARGIN_GROUND)
    height = _OBSTACLE_HEIGHT * layout.span
    for k, obstacle in enumerate(field.obstacles):
        stage.mesh(f"ground/obstacles/{k}", extruded_mesh(obstacle, 0.0, height), OBSTACLE)
