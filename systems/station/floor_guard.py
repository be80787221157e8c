"""Robots that leave the floor, or overlap."""

import numpy as np
from numpy.typing import ArrayLike
from pydrake.systems.framework import LeafSystem

from ..drake_types import read
from ..numerics.errors import require, require_non_negative
from ..numerics.geometry.world import World
from ..numerics.station.floor_watch import FloorWatch


class FloorGuard(LeafSystem):
    """Says which robots are off the floor or within one another, beyond what control costs.

    .. pydrake_system::

        name: FloorGuard
        input_ports:
        - pose
        output_ports:
        - fault

    =====  ====  =========  =====  ===========
    port   size  unit       frame  feedthrough
    =====  ====  =========  =====  ===========
    pose   3 N   m, m, rad  world  -
    fault  N     -          -      all
    =====  ====  =========  =====  ===========

    `fault` is a number of Reason: FENCE, SPACING, or 0.

    Source: ours.

    Args:
        world: The floor.
        radii: Of the robots, shape (N,) [m].
        slack: By how much a robot may be nearer to a wall, or to another, than its radius [m].

    Raises:
        InvalidInput: There are no robots, or the slack is negative.
    """

    def __init__(self, world: World, radii: ArrayLike, *, slack: float):
        super().__init__()
        sizes = np.asarray(radii, dtype=float)
        require(sizes.ndim == 1 and len(sizes) > 0, "radii", "be of one robot at least", sizes)
        require_non_negative("slack", slack)
        self._floor = FloorWatch(world, sizes, slack)
        self._pose = self.DeclareVectorInputPort("pose", 3 * len(sizes))
        self.DeclareVectorOutputPort("fault", len(sizes), self._calc_fault)

    def _calc_fault(self, context, output):
        places = read(self._pose, context).reshape(-1, 3)[:, :2]
        output.set_value(self._floor.breaches(places))
