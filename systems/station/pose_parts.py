"""Poses taken apart."""

import numpy as np
from pydrake.systems.framework import LeafSystem

from ..drake_types import read
from ..numerics.errors import require


class PoseParts(LeafSystem):
    """Positions and directions of poses.

    .. pydrake_system::

        name: PoseParts
        input_ports:
        - pose
        output_ports:
        - position
        - direction

    =========  ====  =========  =====  ===========
    port       size  unit       frame  feedthrough
    =========  ====  =========  =====  ===========
    pose       3 N   m, m, rad  world  -
    position   2 N   m          world  all
    direction  2 N   -          world  all
    =========  ====  =========  =====  ===========

    Source: ours.

    Args:
        count: Number of robots N.

    Raises:
        InvalidInput: The number is not positive.
    """

    def __init__(self, count: int):
        super().__init__()
        require(count > 0, "count", "be positive", count)
        self._pose = self.DeclareVectorInputPort("pose", 3 * count)
        self.DeclareVectorOutputPort("position", 2 * count, self._calc_position)
        self.DeclareVectorOutputPort("direction", 2 * count, self._calc_direction)

    def _calc_position(self, context, output):
        output.set_value(read(self._pose, context).reshape(-1, 3)[:, :2].ravel())

    def _calc_direction(self, context, output):
        headings = read(self._pose, context).reshape(-1, 3)[:, 2]
        output.set_value(np.stack([np.cos(headings), np.sin(headings)], axis=1).ravel())
