"""Drive commands that keep robots from touching one another."""

import numpy as np
from pydrake.systems.framework import LeafSystem

from ..drake_types import read
from ..numeric_parameters import NumericParameters
from ..numerics.errors import require, require_non_negative, require_positive
from ..numerics.social.routes.infrared import InfraredRing
from ..numerics.social.routes.motion import guarded_commands


class CrowdGuard(LeafSystem):
    """Slows robots so far that no two of them touch, whatever they want.

    Each may drive half of the gap that its infrared sensors tell of in a period. Robots drive
    forwards only, and the ring has to cover their whole front and what a period's turn brings
    before it; then, if all robots are guarded, the gaps between them stay above the margin.

    .. pydrake_system::

        name: CrowdGuard
        input_ports:
        - command
        - infrared
        output_ports:
        - safe_command

    ============  =======  ==========  =====  ===========
    port          size     unit        frame  feedthrough
    ============  =======  ==========  =====  ===========
    command       2 N      m/s, rad/s  robot  -
    infrared      N ring   m           robot  -
    safe_command  2 N      m/s, rad/s  robot  all
    ============  =======  ==========  =====  ===========

    Numeric parameters: `margin`, `top_turn_rate`.

    Source: Zhang 2014, 2.3.4.3 (collision avoidance on infrared); the rule is ours.

    Args:
        count: Number of robots N.
        ring: Where the sensors look.
        margin: Gap left between robots [m].
        period: For how long commands are held [s].
        top_turn_rate: Of the robots [rad/s].

    Raises:
        InvalidInput: A number is out of its range, or the ring leaves a part of the front out.
    """

    def __init__(
        self,
        *,
        count: int,
        ring: InfraredRing,
        margin: float,
        period: float,
        top_turn_rate: float,
    ):
        super().__init__()
        require(count > 0, "count", "be positive", count)
        require_non_negative("margin", margin)
        require_positive("period", period)
        require_positive("top_turn_rate", top_turn_rate)
        needed = 0.5 * np.pi + 0.5 * period * top_turn_rate
        require(
            ring.coverage >= needed,
            "ring",
            f"cover {needed:.4g} rad on either side",
            f"{ring.coverage:.4g}",
        )
        self._ring, self._period = ring, float(period)
        self.parameters = NumericParameters(self, margin=margin, top_turn_rate=top_turn_rate)
        self._command = self.DeclareVectorInputPort("command", 2 * count)
        self._infrared = self.DeclareVectorInputPort("infrared", count * ring.count)
        self.DeclareVectorOutputPort("safe_command", 2 * count, self._calc_safe_command)

    def get_command_input_port(self):
        """What the robots want, size 2 N [m/s], [rad/s]."""
        return self._command

    def get_infrared_input_port(self):
        """What their sensors say [m]."""
        return self._infrared

    def get_safe_command_output_port(self):
        """What they may do, size 2 N [m/s], [rad/s]."""
        return self.GetOutputPort("safe_command")

    def _calc_safe_command(self, context, output):
        commands = read(self._command, context).reshape(-1, 2).copy()
        margin, limit = self.parameters(context)
        commands[:, 1] = np.clip(commands[:, 1], -limit, limit)
        safe = guarded_commands(
            commands,
            np.ascontiguousarray(read(self._infrared, context).reshape(len(commands), -1)),
            np.array(self._ring.bearings),
            0.5 * self._ring.cone,
            margin,
            self._period,
        )
        output.set_value(safe.ravel())
