"""Drive commands that keep unicycles out of the walls."""

from collections.abc import Sequence

import numpy as np
from pydrake.systems.framework import LeafSystem

from ..drake_types import read
from ..numerics.compiled import compiled
from ..numerics.errors import require, require_positive
from ..numerics.geometry.edge_index import EdgeIndex, build_edge_index
from ..numerics.geometry.wall_sliding import stop_team
from ..numerics.geometry.world import World
from ..numerics.tracking.mobile_agents import clip_symmetric, drive_step


class WallStop(LeafSystem):
    """Slows robots that would enter a wall within the next period, so that they stop before it.

    A wheeled robot cannot slide: its speed is cut and its turn rate kept, so that it turns in
    place until its way is clear. Held for the period, the new commands keep each robot of a
    DifferentialDriveTeam with the same limits and time step in free space.

    .. pydrake_system::

        name: WallStop
        input_ports:
        - pose
        - command
        output_ports:
        - safe_command

    ============  ====  ==========  =====
    port          size  unit        frame
    ============  ====  ==========  =====
    pose          3 N   m, m, rad   world
    command       2 N   m/s, rad/s  robot
    safe_command  2 N   m/s, rad/s  robot
    ============  ====  ==========  =====

    Source: the orange boundaries of Zhang 2014, 2.2.8; the rule is ours.

    Args:
        regions: Where the robots' centres may be, from `shrink_world`.
        count: Number of robots N.
        top_speed: [m/s].
        top_turn_rate: [rad/s].
        period: For how long commands are held: the plant's time step [s].

    Raises:
        InvalidInput: A number is not positive.
    """

    def __init__(
        self,
        regions: Sequence[World],
        *,
        count: int,
        top_speed: float,
        top_turn_rate: float,
        period: float,
    ):
        super().__init__()
        require(count > 0, "count", "be positive", count)
        require_positive("top_speed", top_speed)
        require_positive("top_turn_rate", top_turn_rate)
        require_positive("period", period)
        self._index = build_edge_index(*regions)
        self._limits = np.array([top_speed, top_turn_rate], dtype=float)
        self._period = float(period)
        self._pose = self.DeclareVectorInputPort("pose", 3 * count)
        self._command = self.DeclareVectorInputPort("command", 2 * count)
        self.DeclareVectorOutputPort("safe_command", 2 * count, self._calc_safe_command)

    def _calc_safe_command(self, context, output):
        poses, commands = read(self._pose, context), read(self._command, context)
        output.set_value(_stop_short(*self._index, poses, commands, self._limits, self._period))


@compiled
def _stop_short(edges, frame, starts, items, probes, poses, commands, limits, period):
    """Commands within the limits whose step ends before the first wall, shape (2 n,)."""
    index = EdgeIndex(edges, frame, starts, items, probes)
    # The plant's own limits first: the step that it will take is the step to check.
    safe = clip_symmetric(commands.reshape((-1, 2)), limits)
    steps = drive_step(poses, commands, limits, period) - poses
    clear = stop_team(index, poses, steps)
    for i in range(len(clear)):
        safe[i, 0] *= clear[i]
    return safe.reshape((-1,))
