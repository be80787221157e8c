"""Ground that a machine may drive on, given as any polygons, and the outline that it covers."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ...errors import require
from ..machines import CombineOutline
from ..paths import MachinePath
from .borders import CROP_CELL, Borders, StandingCrop, make_borders
from .words import path_stays

_NO_CROP = np.zeros((0, 0), dtype=np.bool_), np.zeros(2)


class Footprint(NamedTuple):
    """Footprint of a combine in the frame of its pose; parts are the header and the body.

    Attributes:
        corners: Of each part, counterclockwise, shape (parts, 4, 2) [m].
        around: For each part a disc that covers it: x, y, radius; shape (parts, 3) [m].
        inside: Discs that the parts cover: x, y, radius; shape (discs, 3) [m].
        body: Points of the body, at most a cell of standing crop apart, shape (points, 2) [m].
        reach: Distance of the farthest corner from the pose [m].
    """

    corners: np.ndarray
    around: np.ndarray
    inside: np.ndarray
    body: np.ndarray
    reach: float


def make_footprint(outline: CombineOutline) -> Footprint:
    """The footprint of a combine, whose header and body are rectangles along its heading."""
    parts = np.array(outline)
    low, high = parts.min(axis=1), parts.max(axis=1)
    around = np.column_stack([(low + high) / 2, np.hypot(*(high - low).T) / 2])
    inside = [_discs(*pair) for pair in zip(low, high, strict=True)]
    sides = [_spread(*pair) for pair in zip(low[1], high[1], strict=True)]
    body = np.stack(np.meshgrid(*sides), axis=-1).reshape(-1, 2)
    reach = float(np.hypot(*np.moveaxis(parts, -1, 0)).max())
    return Footprint(parts, around, np.concatenate(inside), np.ascontiguousarray(body), reach)


def _discs(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """A row of discs along the longer side of a rectangle, as wide as the shorter one."""
    radius = float((high - low).min() / 2)
    count = max(2, math.ceil(float((high - low).max()) / (2 * radius)))
    row = np.linspace(low + radius, high - radius, count)
    return np.column_stack([row, np.full(count, radius)])


def _spread(low: float, high: float) -> np.ndarray:
    """Points along a side, half a cell from its ends: an edge of the raster is no fault."""
    room = min(CROP_CELL / 2, (high - low) / 2)
    count = math.ceil((high - low - 2 * room) / CROP_CELL) + 1
    return np.linspace(low + room, high - room, count)


class Site(NamedTuple):
    """Ground and standing crop, and the outline of the machine on it.

    Attributes:
        borders: Of the ground.
        crop: Where crop stands, shape (rows, columns); no cells: nowhere.
        crop_origin: x, y of the corner of its first cell, shape (2,) [m].
        footprint: Of the machine.
    """

    borders: Borders
    crop: np.ndarray
    crop_origin: np.ndarray
    footprint: Footprint


class Motion(NamedTuple):
    """How a machine moves.

    Attributes:
        radius: Of its arcs [m].
        speed: In either gear [m/s].
        acceleration: [m/s^2].
    """

    radius: float
    speed: float
    acceleration: float


class Ground:
    """Ground that outlines must not leave, nor must they reach into its holes.

    Attributes:
        region: The ground as polygons.
        borders: Its edges, for kernels.
    """

    def __init__(self, region: BaseGeometry) -> None:
        """Ground from polygons.

        Args:
            region: The polygons [m].

        Raises:
            InvalidInput: There is no ground.
        """
        parts = [each for each in shapely.get_parts(region) if isinstance(each, shapely.Polygon)]
        self.region = shapely.MultiPolygon([each for each in parts if not each.is_empty])
        require(not self.region.is_empty, "ground", "have an area", region.geom_type)
        self.borders = make_borders(self.region)

    def admits_pose(
        self, pose: Sequence[float], footprint: Footprint, crop: StandingCrop | None = None
    ) -> bool:
        """Whether a machine may stand somewhere.

        Args:
            pose: x, y, theta [m], [m], [rad].
            footprint: Of the machine.
            crop: Where its body must not be.
        """
        return self.admits_pieces(pose, np.zeros(0), np.zeros(0), footprint, crop)

    def admits(
        self, path: MachinePath, footprint: Footprint, crop: StandingCrop | None = None
    ) -> bool:
        """Whether a machine may drive along a path.

        Args:
            path: All of it is looked at, with the swing of the outline.
            footprint: Of the machine.
            crop: Where its body must not be.
        """
        lengths = path.lengths * path.gears
        turned = np.diff(path.poses[:, 2])
        curvatures = np.divide(turned, lengths, out=np.zeros(len(turned)), where=lengths != 0)
        return self.admits_pieces(path.poses[0].tolist(), curvatures, lengths, footprint, crop)

    def admits_pieces(
        self,
        pose: Sequence[float],
        curvatures: np.ndarray,
        lengths: np.ndarray,
        footprint: Footprint,
        crop: StandingCrop | None = None,
    ) -> bool:
        """Whether a machine may drive arcs and straights.

        Args:
            pose: x, y, theta of the start [m], [m], [rad].
            curvatures: Positive where the heading grows on the way forwards, shape (n,) [1/m].
            lengths: Negative backwards, shape (n,) [m].
            footprint: Of the machine.
            crop: Where its body must not be.
        """
        site = self.site(footprint, crop)
        return bool(path_stays(site, np.array(pose, dtype=float), curvatures, lengths))

    def site(self, footprint: Footprint, crop: StandingCrop | None = None) -> Site:
        """The ground for a machine, for kernels.

        Args:
            footprint: Of the machine.
            crop: Where its body must not be.
        """
        cells, origin = _NO_CROP if crop is None else (crop.cells, crop.origin)
        return Site(self.borders, cells, origin, footprint)
