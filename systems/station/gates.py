"""Systems between what is measured and what is sent.

They judge ages, take poses apart, and let commands through to robots that may drive.
"""

import numpy as np
from pydrake.systems.framework import LeafSystem

from ..drake_parts import NumericParameters, read, state_vector
from ..numerics.errors import require_non_negative, require_positive, require_whole
from ..numerics.station.supervision import Reason


class AgeLimit(LeafSystem):
    """Says which ages are within a limit.

    .. pydrake_system::

        name: AgeLimit
        input_ports:
        - age
        output_ports:
        - valid

    =====  ====  ====  =====  ===========
    port   size  unit  frame  feedthrough
    =====  ====  ====  =====  ===========
    age    N     s     -      -
    valid  N     -     -      all
    =====  ====  ====  =====  ===========

    `valid` is 1 up to the limit, else 0. Numeric parameters: `limit`.

    Source: ours.

    Args:
        count: Number of members N.
        limit: [s].

    Raises:
        InvalidInput: A number is not positive.
    """

    def __init__(self, count: int, *, limit: float):
        super().__init__()
        require_whole("count", count, 1)
        require_positive("limit", limit)
        self.parameters = NumericParameters(self, limit=limit)
        self._age = self.DeclareVectorInputPort("age", count)
        self.DeclareVectorOutputPort("valid", count, self._calc_valid)

    def _calc_valid(self, context, output):
        limit = self.parameters(context).limit
        output.set_value((read(self._age, context) <= limit).astype(float))


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
        require_whole("count", count, 1)
        self._pose = self.DeclareVectorInputPort("pose", 3 * count)
        self.DeclareVectorOutputPort("position", 2 * count, self._calc_position)
        self.DeclareVectorOutputPort("direction", 2 * count, self._calc_direction)

    def _calc_position(self, context, output):
        output.set_value(read(self._pose, context).reshape(-1, 3)[:, :2].ravel())

    def _calc_direction(self, context, output):
        headings = read(self._pose, context).reshape(-1, 3)[:, 2]
        output.set_value(np.stack([np.cos(headings), np.sin(headings)], axis=1).ravel())


# What the operator's mode says.
RUNNING, PAUSED, STOPPED = 1.0, 0.0, -1.0


class CommandGate(LeafSystem):
    """Lets commands through to robots that may follow them, while the operator lets them run.

    All others get zero. A robot that nobody sees stands, so that where it was last seen is where
    it is, for it and for the others.

    .. pydrake_system::

        name: CommandGate
        input_ports:
        - command
        - valid
        - mode
        output_ports:
        - sent_command

    ============  ====  ==========  =====  ===========
    port          size  unit        frame  feedthrough
    ============  ====  ==========  =====  ===========
    command       2 N   m/s, rad/s  robot  -
    valid         N     -           -      -
    mode          1     -           -      -
    sent_command  2 N   m/s, rad/s  robot  all
    ============  ====  ==========  =====  ===========

    `valid` is above 0.5 for robots that may follow their commands. `mode` is 1 to run, 0 for a
    pause, -1 for an emergency stop. A command that is not finite is zero as well.

    Source: ours.

    Args:
        count: Number of robots N.

    Raises:
        InvalidInput: The number is not positive.
    """

    def __init__(self, count: int):
        super().__init__()
        require_whole("count", count, 1)
        self._command = self.DeclareVectorInputPort("command", 2 * count)
        self._valid = self.DeclareVectorInputPort("valid", count)
        self._mode = self.DeclareVectorInputPort("mode", 1)
        self.DeclareVectorOutputPort("sent_command", 2 * count, self._calc_sent_command)

    def _calc_sent_command(self, context, output):
        commands = read(self._command, context).reshape(-1, 2)
        good = (read(self._valid, context) > 0.5) & np.isfinite(commands).all(axis=1)
        good &= read(self._mode, context)[0] == RUNNING
        output.set_value(np.where(good[:, None], commands, 0.0).ravel())


# Sensors of a robot, from left to right; the two in the middle look ahead.
_SENSORS, _AHEAD = 4, slice(1, 3)
# By how much farther an obstacle has to be before a held robot drives on [m].
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

    `ranges` are of the four sensors of each robot, from left to right; the two in the middle look
    ahead and decide, where `valid` is above 0.5. A robot that is held drives on when they measure
    0.02 m more than the distance. `told_reason` is the `reason` of the supervisor, a number of
    Reason, or OBSTACLE where that is none.

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
        require_whole("count", count, 1)
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
