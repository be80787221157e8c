"""What of a field may be driven on so far: its ground, less the crop that stands."""

import math

import numpy as np
import shapely
from scipy.ndimage import label

from ...compiled import kernel
from ..field.field import Field
from ..machines.combine import Combine
from ..paths.machine_path import MachinePath
from ..turns.ground import Ground
from ..turns.lattice import EXPANSIONS
from ..turns.standing_crop import CELL, StandingCrop
from ..turns.turn import combine_footprint, turn_between

# Distance kept from obstacles, and how much less is let pass for rounding [m].
GAP = 0.5
ROUNDING = 0.02

# Smaller patches of crop may be given up [m^2].
LEAST_PATCH = 20.0

# By how much the ground ends before the margin does, so that what `stays_on_ground` lets pass is no
# fault to the audit, and machines may still drive along the margin's very end [m].
WITHIN = 0.006


class CutGround:
    """A field that is cut path by path.

    Attributes:
        ground: Which no outline leaves.
        crop: What stands on it.
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
        """The same ground, to be cut apart from this by a combine of the same size."""
        return CutGround(self.ground, self.crop.copy(), combine, self.margin)

    def give_up_patches(self) -> None:
        """Let bodies drive over crop that is left in small patches, where rounds meet."""
        patches = np.empty(self.crop.cells.shape, dtype=np.int32)
        label(self.crop.cells, output=patches)
        sizes = np.bincount(patches.ravel()) * CELL**2
        self.crop.cells &= sizes[patches] >= LEAST_PATCH

    def cut(self, path: MachinePath) -> None:
        """Cut what a path cuts."""
        poses, cutting = sample_path(path, 0.5 * CELL)
        half = self.combine.header_width / 2
        depth = self.combine.header_depth
        _cut(self.crop.cells, self.crop.origin, CELL, poses[cutting], half, depth)

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
        """Whether the outline keeps to the ground on a path, and, unless it cuts, off crop.

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


def sample_path(path: MachinePath, spacing: float) -> tuple[np.ndarray, np.ndarray]:
    """Poses along a path, shape (n, 3), and whether the header is down at each, shape (n,).

    Args:
        path: The path.
        spacing: [m].
    """
    stations = path.stations_every(spacing)
    return path.pose_at(stations), path.cutting[path.piece_at(stations)]


@kernel
def _cut(cells, origin, size, poses, half, depth):
    rows, columns = cells.shape
    across = math.ceil(2 * half / (0.6 * size))
    along = math.ceil(depth / (0.6 * size))
    for k in range(len(poses)):
        c, s = math.cos(poses[k, 2]), math.sin(poses[k, 2])
        for i in range(across + 1):
            side = -half + 2 * half * i / across
            for j in range(along + 1):
                ahead = depth * (j / along - 0.5)
                x = poses[k, 0] + c * ahead - s * side
                y = poses[k, 1] + s * ahead + c * side
                column = math.floor((x - origin[0]) / size)
                row = math.floor((y - origin[1]) / size)
                if 0 <= row < rows and 0 <= column < columns:
                    cells[row, column] = False
