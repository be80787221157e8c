"""The free distance around a vehicle as a smooth function of its state, for the solver."""

from dataclasses import dataclass
from functools import lru_cache

import casadi as ca
import numpy as np

from ...geometry.world import World
from ..vehicle.footprint import Discs
from ..vehicle.free_distance import signed_distance

# Nodes of the spline along the longer side of the world.
SPLINE_NODES = 120


@dataclass(frozen=True, eq=False)
class ClearanceField:
    """Signed distance to the nearest obstacle or boundary, minus each disc's radius.

    A cubic spline through exact distances at the nodes of a grid: smooth, and exact along straight
    walls; where two walls are equally near it is off by a fraction of the grid's spacing, so paths
    are checked against the polygons themselves afterwards.

    Attributes:
        discs: What covers the vehicle.
        spline: Function from (x, y) [m] to signed distance, positive in free space [m].
        spacing: Of its grid [m].
    """

    discs: Discs
    spline: ca.Function
    spacing: float

    def function(self) -> ca.Function:
        """From a state to the free distance around each disc, negative: an overlap [m].

        The state is in a frame whose pose in the world is the second argument.
        """
        state, pose = ca.MX.sym("state", 4), ca.MX.sym("pose", 3)
        c, s = ca.cos(pose[2]), ca.sin(pose[2])
        free = []
        for k in range(len(self.discs)):
            x, y = self.discs.centre(k, state, ca.cos, ca.sin)
            place = ca.vertcat(pose[0] + c * x - s * y, pose[1] + s * x + c * y)
            free.append(self.spline(place) - self.discs.radii[k])
        return ca.Function("free", [state, pose], [ca.vertcat(*free)])


@lru_cache(maxsize=8)
def clearance_field(world: World, discs: Discs) -> ClearanceField:
    """Sample the distance to a world's polygons on a grid that reaches beyond the boundary."""
    low, high = world.bounds[:2], world.bounds[2:]
    spacing = float((high - low).max()) / SPLINE_NODES
    # A seed may leave the world; a spline must not be asked beyond its grid.
    margin = 0.25 * float((high - low).max())
    x, y = (
        np.arange(a - margin, b + margin + spacing, spacing) for a, b in zip(low, high, strict=True)
    )
    points = np.stack([each.ravel() for each in np.meshgrid(x, y)], axis=1)
    distance = signed_distance(world, points)
    spline = ca.interpolant("distance", "bspline", [x.tolist(), y.tolist()], distance.tolist())
    return ClearanceField(discs, spline, spacing)
