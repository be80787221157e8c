"""A field that is cut path by path: what may be driven on, and which crop still stands."""

import math

import numpy as np
import shapely
from scipy.ndimage import label

from ...compiled import kernel
from ..field.field import Field
from ..machines import Combine, CombineSize
from ..paths import MachinePath
from ..raster import cell_under, lattice
from ..turns.borders import CROP_CELL, StandingCrop
from ..turns.ground import Ground
from ..turns.turn import EXPANSIONS, combine_footprint, turn_between

# Distance kept from obstacles, and how much less is let pass for rounding [m].
GAP = 0.5
ROUNDING = 0.02

# Smaller patches of crop may be given up [m^2].
LEAST_PATCH = 20.0

# The ground ends this far inside the margin's edge, so that the tolerance of `stays_on_ground` is
# no fault in the audit, and machines may still drive along the very edge [m].
WITHIN = 0.006


class CutGround:
    """A field that is cut path by path.

    Attributes:
        ground: Ground that no outline leaves.
        crop: Crop that stands on it.
        combine: The combine that drives there.
        margin: Width of the strip outside of the crop that may be driven on [m].
    """

    def __init__(self, ground: Ground, crop: StandingCrop, combine: Combine, margin: float) -> None:
        self.ground, self.crop, self.combine, self.margin = ground, crop, combine, margin

    @classmethod
    def of(cls, field: Field, combine: Combine) -> "CutGround":
        """The ground before anything is cut."""
        obstacles = [shape.buffer(GAP - ROUNDING) for shape in field.obstacles]
        within = field.ground.buffer(-WITHIN, join_style="mitre")
        region = within.difference(shapely.union_all(obstacles))
        return cls(Ground(region), StandingCrop(field.polygon), combine, field.margin)

    def copy_for(self, combine: Combine) -> "CutGround":
        """A copy of the ground, to be cut independently by a combine of the same size."""
        return CutGround(self.ground, self.crop.copy(), combine, self.margin)

    def give_up_patches(self) -> None:
        """Let bodies drive over crop that is left in small patches, where rounds meet."""
        patches = np.empty(self.crop.cells.shape, dtype=np.int32)
        label(self.crop.cells, output=patches)
        sizes = np.bincount(patches.ravel()) * CROP_CELL**2
        self.crop.cells &= sizes[patches] >= LEAST_PATCH

    def cut(self, path: MachinePath) -> None:
        """Remove the crop that is cut along a path."""
        half, deep = self.combine.header_width / 2, self.combine.header_depth / 2
        header = lattice(-deep, deep, half, 0.6 * CROP_CELL)
        _cut(self.crop.cells, self.crop.origin, header_down(path, 0.5 * CROP_CELL)[0], header)

    def turn(
        self, start: np.ndarray, goal: np.ndarray, *, search: bool = False
    ) -> MachinePath | None:
        """The quickest turn found from one pose to another, or None.

        Args:
            start: x, y, theta, shape (3,) [m], [m], [rad].
            goal: The same, shape (3,).
            search: Whether to search for a way where no word fits, which takes long.
        """
        ends = start.tolist(), goal.tolist()
        expansions = EXPANSIONS if search else 0
        return turn_between(*ends, self.ground, self.combine, crop=self.crop, expansions=expansions)

    def admits(self, path: MachinePath, *, cutting: bool = False) -> bool:
        """Whether the outline stays on the ground along a path, and off crop unless it cuts.

        Args:
            path: The path.
            cutting: Whether the header is down on it.
        """
        crop = None if cutting else self.crop
        return self.ground.admits(path, combine_footprint(self.combine), crop)

    def may_stand(self, pose: np.ndarray) -> bool:
        """Whether the outline at a pose, shape (3,), is on the ground, with its body off crop."""
        return self.ground.admits_pose(pose.tolist(), combine_footprint(self.combine), self.crop)

    def has_room(self, pose: np.ndarray) -> bool:
        """Whether the outline at a pose, shape (3,), is on the ground, crop or not."""
        return self.ground.admits_pose(pose.tolist(), combine_footprint(self.combine))


def header_down(path: MachinePath, spacing: float) -> tuple[np.ndarray, np.ndarray]:
    """Poses and stations along a path at which the header is down, shapes (k, 3) and (k,) [m].

    Args:
        path: The path.
        spacing: Of the stations [m].
    """
    stations = path.stations_every(spacing)
    down = path.cutting[path.piece_at(stations)]
    return path.pose_at(stations)[down], stations[down]


@kernel
def _cut(cells, origin, poses, points):
    rows, columns = cells.shape
    for pose in poses:
        c, s = math.cos(pose[2]), math.sin(pose[2])
        for point in points:
            row, column = cell_under(origin, CROP_CELL, pose, c, s, point)
            if 0 <= row < rows and 0 <= column < columns:
                cells[row, column] = False


def covered_area(field: Field, paths: tuple[MachinePath, ...], combine: CombineSize) -> float:
    """Area of crop that the middle lines of lowered headers sweep [m^2]."""
    sweeps = []
    half = combine.header_width / 2
    for path in paths:
        begin, end = path.poses[:-1][path.cutting], path.poses[1:][path.cutting]
        left, right = (
            [
                np.column_stack(
                    [pose[:, 0] - s * np.sin(pose[:, 2]), pose[:, 1] + s * np.cos(pose[:, 2])]
                )
                for pose in (begin, end)
            ]
            for s in (half, -half)
        )
        quads = np.stack([left[0], left[1], right[1], right[0]], axis=1)
        sweeps.append(shapely.convex_hull(shapely.multipoints(quads)))
    cut = shapely.union_all(np.concatenate(sweeps))
    return float(shapely.intersection(cut, field.polygon).area)
