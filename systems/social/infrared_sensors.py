"""The infrared sensors of all robots."""

import numpy as np
from pydrake.systems.framework import LeafSystem

from ..drake_types import read
from ..numerics.errors import require, require_positive
from ..numerics.geometry.edge_index import build_edge_index
from ..numerics.geometry.world import World
from ..numerics.social.routes.infrared import InfraredRing, infrared_ranges


class InfraredSensors(LeafSystem):
    """Tells each robot how near the nearest wall or robot is in each of its cones.

    Ranges are from the robot's rim, and at most the sensors' reach; they come robot by robot, each
    robot's from left to right.

    .. pydrake_system::

        name: InfraredSensors
        input_ports:
        - pose
        output_ports:
        - infrared

    ========  =======  =========  =====  ===========
    port      size     unit       frame  feedthrough
    ========  =======  =========  =====  ===========
    pose      3 N      m, m, rad  world  -
    infrared  N ring   m          robot  all
    ========  =======  =========  =====  ===========

    Source: Zhang 2014, 2.3.4, Figure 2.31.

    Args:
        world: Its walls.
        count: Number of robots N.
        radius: Of each [m].
        ring: Where the sensors look.

    Raises:
        InvalidInput: A number is not positive.
    """

    def __init__(self, world: World, *, count: int, radius: float, ring: InfraredRing):
        super().__init__()
        require(count > 0, "count", "be positive", count)
        require_positive("radius", radius)
        self._edges = build_edge_index(world).edges
        self._radius, self._ring = float(radius), ring
        self._pose = self.DeclareVectorInputPort("pose", 3 * count)
        self.DeclareVectorOutputPort("infrared", count * ring.count, self._calc_infrared)

    def get_pose_input_port(self):
        """Poses, size 3 N [m], [m], [rad]."""
        return self._pose

    def get_infrared_output_port(self):
        """Ranges, size N times the sensors of a ring [m]."""
        return self.GetOutputPort("infrared")

    def _calc_infrared(self, context, output):
        poses = np.ascontiguousarray(read(self._pose, context).reshape(-1, 3))
        ranges = infrared_ranges(self._edges, poses, self._radius, self._ring)
        output.set_value(ranges.ravel())
