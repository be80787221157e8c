"""Velocity commands that keep point agents out of the walls."""

from collections.abc import Sequence

from pydrake.systems.framework import LeafSystem

from ..drake_types import read
from ..numerics.errors import require, require_positive
from ..numerics.geometry.edge_index import build_edge_index
from ..numerics.geometry.wall_sliding import slide_team
from ..numerics.geometry.world import World


class WallSliding(LeafSystem):
    """Replaces velocities that would enter a wall within the next period by ones that slide.

    Held for the period, the new velocities keep each agent that starts in free space inside it,
    at any speed and any period. An agent that is not in free space is led there.

    .. pydrake_system::

        name: WallSliding
        input_ports:
        - position
        - velocity
        output_ports:
        - safe_velocity

    =============  ====  ====  =====
    port           size  unit  frame
    =============  ====  ====  =====
    position       2 N   m     world
    velocity       2 N   m/s   world
    safe_velocity  2 N   m/s   world
    =============  ====  ====  =====

    Source: the orange boundaries of Zhang 2014, 2.2.8; the rule is ours.

    Args:
        regions: Where the agents' centres may be, from `shrink_world`.
        count: Number of agents N.
        period: For how long velocities are held: the plant's time step [s].

    Raises:
        InvalidInput: A number is not positive.
    """

    def __init__(self, regions: Sequence[World], *, count: int, period: float):
        super().__init__()
        require(count > 0, "count", "be positive", count)
        require_positive("period", period)
        self._index = build_edge_index(*regions)
        self._period = float(period)
        self._position = self.DeclareVectorInputPort("position", 2 * count)
        self._velocity = self.DeclareVectorInputPort("velocity", 2 * count)
        self.DeclareVectorOutputPort("safe_velocity", 2 * count, self._calc_safe_velocity)

    def _calc_safe_velocity(self, context, output):
        position, velocity = read(self._position, context), read(self._velocity, context)
        output.set_value(slide_team(self._index, position, velocity, self._period))
