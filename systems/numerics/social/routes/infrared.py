"""Four infrared sensors on each robot: the distance to the nearest object in each cone.

A range is exact up to the sensor's reach. For walls it is the distance to the nearest wall point in
the cone. For a robot that reaches into the cone it is the distance to that robot's nearest point,
even if this point is a little beside the cone, so that no robot is nearer than the range says.

Source: Zhang 2014, 2.3.4 and Figure 2.31 (four sensors on the pursuer and each common agent;
where they look is ours).
"""

import math
from dataclasses import dataclass

import numpy as np

from ...compiled import compiled, kernel
from ...errors import require, require_finite, require_positive
from ...geometry.edge_index import END, START


@dataclass(frozen=True, kw_only=True)
class InfraredRing:
    """Where a robot's sensors look.

    Attributes:
        bearings: Of the cones' axes from the heading, from left to right [rad].
        cone: Full angle of each, below pi [rad].
        reach: Beyond it nothing is felt [m], from the robot's rim.

    Raises:
        InvalidInput: A number is out of its range.
    """

    bearings: tuple[float, ...] = tuple(math.radians(each) for each in (75, 25, -25, -75))
    cone: float = math.radians(50)
    reach: float = 0.4

    def __post_init__(self) -> None:
        require(len(self.bearings) > 0, "bearings", "hold a sensor at least", self.bearings)
        for each in self.bearings:
            require_finite("bearings", each)
        falling = all(a > b for a, b in zip(self.bearings, self.bearings[1:], strict=False))
        require(falling, "bearings", "go from left to right", self.bearings)
        require(0 < self.cone < math.pi, "cone", "lie between 0 and pi rad", self.cone)
        require_positive("reach", self.reach)

    @property
    def count(self) -> int:
        """Number of sensors on a robot."""
        return len(self.bearings)

    @property
    def coverage(self) -> float:
        """Half of the angle about the heading that is covered without a gap [rad]."""
        near = sorted((abs(each), each) for each in self.bearings)
        left = right = 0.0
        for _, bearing in near:
            if bearing - 0.5 * self.cone <= left + 1e-9 and bearing + 0.5 * self.cone > left:
                left = bearing + 0.5 * self.cone
            if bearing + 0.5 * self.cone >= right - 1e-9 and bearing - 0.5 * self.cone < right:
                right = bearing - 0.5 * self.cone
        return max(min(left, -right), 0.0)


def infrared_ranges(
    edges: np.ndarray, poses: np.ndarray, radius: float, ring: InfraredRing
) -> np.ndarray:
    """Ranges of all sensors.

    Args:
        edges: Edges of the world's `EdgeIndex`, shape (k, 6) [m]; columns START and END are used.
        poses: Poses of all robots, shape (n, 3) [m], [m], [rad].
        radius: Radius of every robot [m].
        ring: Directions of the sensors.

    Returns:
        Ranges from the rim, zero to `reach`, shape (n, sensors) [m].
    """
    return _ranges(edges, poses, radius, np.array(ring.bearings), 0.5 * ring.cone, ring.reach)


@compiled
def _ranges(
    edges: np.ndarray,
    poses: np.ndarray,
    radius: float,
    bearings: np.ndarray,
    half: float,
    reach: float,
) -> np.ndarray:
    ranges = np.full((len(poses), len(bearings)), reach)
    for i in range(len(poses)):
        x, y, heading = poses[i]
        for k in range(len(bearings)):
            axis = heading + bearings[k]
            nearest = reach + radius
            for e in range(len(edges)):
                distance = _edge_in_cone(
                    edges[e, START] - x,
                    edges[e, START + 1] - y,
                    edges[e, END] - x,
                    edges[e, END + 1] - y,
                    axis,
                    half,
                )
                nearest = min(nearest, distance)
            for j in range(len(poses)):
                if j == i:
                    continue
                dx, dy = poses[j, 0] - x, poses[j, 1] - y
                distance = math.hypot(dx, dy)
                ahead = dx * math.cos(axis) + dy * math.sin(axis)
                left = dy * math.cos(axis) - dx * math.sin(axis)
                beside = abs(math.atan2(left, ahead)) - half
                if distance <= radius or beside <= math.asin(radius / distance):
                    nearest = min(nearest, distance - radius)
            ranges[i, k] = max(nearest - radius, 0.0)
    return ranges


@kernel
def _edge_in_cone(cx: float, cy: float, dx: float, dy: float, axis: float, half: float) -> float:
    """Distance from the apex, the origin, to the part of a segment in a cone; infinite if none."""
    low, high = 0.0, 1.0
    for side in (-1.0, 1.0):
        # Inside is where `inward` times the position is not negative.
        nx = side * math.sin(axis + side * half)
        ny = -side * math.cos(axis + side * half)
        at_start, at_end = nx * cx + ny * cy, nx * dx + ny * dy
        if at_start < 0.0 and at_end < 0.0:
            return math.inf
        if at_start < 0.0:
            low = max(low, at_start / (at_start - at_end))
        elif at_end < 0.0:
            high = min(high, at_start / (at_start - at_end))
    if low > high:
        return math.inf
    ex, ey = dx - cx, dy - cy
    t = min(high, max(low, -(cx * ex + cy * ey) / (ex * ex + ey * ey)))
    return math.hypot(cx + t * ex, cy + t * ey)
