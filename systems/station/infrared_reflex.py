"""Robots that drive no further where an infrared sensor feels something near ahead."""

import numpy as np
from pydrake.systems.framework import LeafSystem

from ..drake_types import read, state_vector
from ..numerics.errors import require, require_non_negative, require_positive
from ..numerics.station.reasons import Reason

# Sensors of a robot, from left to right; the two in the middle look ahead.
_SENSORS, _AHEAD = 4, slice(1, 3)
# By how much farther something has to be before a robot drives on [m].
_RELEASED = 0.02


class InfraredReflex(LeafSystem):
    """Holds the forward motion of a robot that feels an obstacle nearer than a distance ahead.

    It may turn and drive back. Strategies, motion capture and maps have no part in it.

    .. pydrake_system::

        name: InfraredReflex
        input_ports:
        - command
        - ranges
        - valid
        - reason
        output_ports:
        - held_command
        - told_reason

    ============  ====  ==========  =====  ===============
    port          size  unit        frame  feedthrough
    ============  ====  ==========  =====  ===============
    command       2 N   m/s, rad/s  robot  -
    ranges        4 N   m           -      -
    valid         N     -           -      -
    reason        N     -           -      -
    held_command  2 N   m/s, rad/s  robot  all but reason
    told_reason   N     -           -      all but command
    ============  ====  ==========  =====  ===============

    `ranges` are of the four sensors of each robot, from left to right; they count where `valid` is
    above 0.5. `told_reason` is the `reason` of the supervisor, a number of Reason, or OBSTACLE
    where that is none.

    Source: the sensors of Zhang 2014, 2.3.4; the reflex is ours.

    Args:
        count: Number of robots N.
        distance: At which a robot drives no further [m]; 0 for no reflex.
        period: Between ticks [s].

    Raises:
        InvalidInput: A number is out of its range.
    """

    def __init__(self, count: int, *, distance: float, period: float):
        super().__init__()
        require(count > 0, "count", "be positive", count)
        require_non_negative("distance", distance)
        require_positive("period", period)
        self._distance, self._period = float(distance), float(period)
        self._command = self.DeclareVectorInputPort("command", 2 * count)
        self._ranges = self.DeclareVectorInputPort("ranges", _SENSORS * count)
        self._valid = self.DeclareVectorInputPort("valid", count)
        self._reason = self.DeclareVectorInputPort("reason", count)
        self._held = self.DeclareDiscreteState(state_vector(np.zeros(count)))
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._keep)
        felt = {
            self._ranges.ticket(),
            self._valid.ticket(),
            self.discrete_state_ticket(self._held),
        }
        self.DeclareVectorOutputPort(
            "held_command", 2 * count, self._calc_held_command, felt | {self._command.ticket()}
        )
        self.DeclareVectorOutputPort(
            "told_reason", count, self._calc_told_reason, felt | {self._reason.ticket()}
        )

    def _near(self, context) -> np.ndarray:
        """Which robots feel an obstacle; one that is held feels it from a little farther."""
        ranges = read(self._ranges, context).reshape(-1, _SENSORS)[:, _AHEAD].min(axis=1)
        held = context.get_discrete_state(self._held).value() > 0.5
        far = self._distance + np.where(held, _RELEASED, 0.0)
        known = read(self._valid, context) > 0.5
        return known & (ranges < far) & (self._distance > 0)

    def _keep(self, context, discrete_state):
        # At a tick, inputs are those of the tick before; before the first there was none.
        if context.get_time() > 0.5 * self._period:
            discrete_state.set_value(self._held, self._near(context).astype(float))

    def _calc_held_command(self, context, output):
        commands = read(self._command, context).reshape(-1, 2).copy()
        near = self._near(context)
        commands[near, 0] = np.minimum(commands[near, 0], 0.0)
        output.set_value(commands.ravel())

    def _calc_told_reason(self, context, output):
        reasons = read(self._reason, context)
        told = self._near(context) & (reasons == Reason.NONE)
        output.set_value(np.where(told, float(Reason.OBSTACLE), reasons))
