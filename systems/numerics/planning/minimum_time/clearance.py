"""Free room around a cart, as the programme sees it: from afar by a spline, beside walls exactly.

A spline through distances leads a path from anywhere, even from inside a wall, but it is flat where
two walls are equally near: in a passage that is hardly wider than the cart it sees no room. The
distances from the walls that a cart faces on either side are smooth there, and exact; they are of
use only on a path that is nearly clear already, whose places say which walls these are.
"""

from dataclasses import dataclass
from functools import lru_cache

import casadi as ca
import numpy as np

from ...geometry.world import World
from ..footprint import Discs, signed_distance

# Nodes of the spline along the longer side of the world.
SPLINE_NODES = 120


@dataclass(frozen=True, eq=False)
class DistanceSpline:
    """Signed distance to the nearest obstacle or boundary, minus each disc's radius.

    A cubic spline through exact distances at the nodes of a grid: smooth, and exact along straight
    walls; where two walls are equally near it is too low by up to a third of the grid's spacing.

    Attributes:
        discs: What covers the vehicle.
        radius: Length of a turning radius, the unit of the states [m].
        spline: Function from (x, y) [m] to signed distance, positive in free space [m].
    """

    discs: Discs
    radius: float
    spline: ca.Function

    def function(self) -> ca.Function:
        """From a state to the free distance around each disc, negative: an overlap [m].

        The state is in a frame whose pose in the world is the second argument.
        """
        state, pose = ca.MX.sym("state", 4), ca.MX.sym("pose", 3)
        metres = ca.diag(ca.DM([self.radius, self.radius, 1.0, 1.0])) @ state
        places = [self._place(k)(metres, pose) for k in range(len(self.discs))]
        free = [
            self.spline(place) - radius
            for place, radius in zip(places, self.discs.radii, strict=True)
        ]
        return ca.Function("free", [state, pose], [ca.vertcat(*free)])

    def _place(self, k: int) -> ca.Function:
        """From a state and a pose to the centre of a disc in the world [m].

        In scalars, which are quicker to evaluate than the matrices that the spline needs.
        """
        state, pose = ca.SX.sym("state", 4), ca.SX.sym("pose", 3)
        c, s = ca.cos(pose[2]), ca.sin(pose[2])
        x, y = self.discs.centre(k, state, ca.cos, ca.sin)
        place = ca.vertcat(pose[0] + c * x - s * y, pose[1] + s * x + c * y)
        return ca.Function("place", [state, pose], [place])


@lru_cache(maxsize=8)
def distance_spline(world: World, discs: Discs, radius: float) -> DistanceSpline:
    """Sample the distance to a world's polygons on a grid that reaches beyond the boundary.

    Args:
        world: With the polygons.
        discs: What covers the vehicle.
        radius: Of its tightest turn [m].
    """
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
    return DistanceSpline(discs, radius, spline)


# How many walls a disc faces: at the end of a corridor there is one ahead and one on either side.
FACED = 3
# Cosine of the least angle between the directions in which a disc faces two of its walls.
_APART = 0.5
# Added to squares of distances, whose roots must have a slope [square turning radii].
_BLUNT = 1e-12


@dataclass(frozen=True)
class FacedWalls:
    """Distances of discs from the walls that each of them faces, minus its radius.

    Attributes:
        discs: What covers the vehicle.
        radius: Length of a turning radius, the unit of states and walls [m].
        looks: At how many places of each interval, its beginning among them.
    """

    discs: Discs
    radius: float
    looks: int

    def function(self) -> ca.Function:
        """From a state to the free distance of each disc from each wall that it faces [m].

        The second argument are the walls, those of the first disc first, shape (4, k * FACED): the
        ends of each in the frame of the state [turning radii].
        """
        state = ca.SX.sym("state", 4)
        walls = ca.SX.sym("walls", 4, FACED * len(self.discs))
        metres = ca.vertcat(self.radius * state[:2], state[2:])
        free = []
        for k, radius in enumerate(self.discs.radii):
            x, y = self.discs.centre(k, metres, ca.cos, ca.sin)
            for n in range(FACED * k, FACED * (k + 1)):
                ends = walls[:, n]
                along, off = ends[2:] - ends[:2], ca.vertcat(x, y) / self.radius - ends[:2]
                share = ca.dot(off, along) / ca.dot(along, along)
                gap = off - ca.fmin(ca.fmax(share, 0.0), 1.0) * along
                free.append(self.radius * ca.sqrt(ca.sumsqr(gap) + _BLUNT) - radius)
        return ca.Function("free", [state, walls], [ca.vertcat(*free)])


def faced_walls(world: World, discs: Discs, states: np.ndarray) -> np.ndarray:
    """The nearest walls in directions that are apart, around each disc at some poses.

    Args:
        world: With the walls.
        discs: What covers the vehicle.
        states: x, y, theta, beta, shape (n, 4) [m], [m], [rad], [rad].

    Returns:
        Both ends of each wall, x, y, x, y, shape (n, k * FACED, 4) [m]. Where a disc faces fewer
        walls, there is one far away instead.
    """
    walls = world.edges
    ends, along = walls[:, :2], walls[:, 2:] - walls[:, :2]
    rows = np.arange(len(states))
    found = []
    for k in range(len(discs)):
        off = np.stack(discs.centre(k, states.T), axis=1)[:, None] - ends
        share = (off * along).sum(axis=-1) / (along * along).sum(axis=-1)
        gaps = np.clip(share, 0.0, 1.0)[..., None] * along - off
        distances = np.hypot(gaps[..., 0], gaps[..., 1])
        towards = gaps / np.maximum(distances, np.finfo(float).tiny)[..., None]
        farthest, left = distances.argmax(axis=1), distances
        for _ in range(FACED):
            nearest = left.argmin(axis=1)
            known = np.isfinite(left[rows, nearest])
            found.append(walls[np.where(known, nearest, farthest)])
            alike = (towards * towards[rows, nearest][:, None]).sum(axis=-1) > _APART
            left = np.where(alike, np.inf, left)
    return np.stack(found, axis=1)
