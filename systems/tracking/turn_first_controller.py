"""How a differential-drive robot keeps to a straight way that was promised."""

import numpy as np
from pydrake.systems.framework import LeafSystem

from ..drake_types import read
from ..numeric_parameters import NumericParameters
from ..numerics.compiled import compiled
from ..numerics.errors import require, require_positive
from ..numerics.tracking.mobile_agents import heading_commands, turn_first_command
from .standing_certificate import ROUNDING

# The same laws, compiled.
_heading_commands, _turn_first_command = compiled(heading_commands), compiled(turn_first_command)


class TurnFirstController(LeafSystem):
    """Turns robots that keep a promise in place before they drive; the others drive as they turn.

    A robot that is committed turns to the nearer end of its axis, as fast as it can, and then
    drives straight, forwards or backwards, with all of the desired speed. One that is not, or that
    is deflected, does as `HeadingController` has it.

    .. pydrake_system::

        name: TurnFirstController
        input_ports:
        - pose
        - velocity
        - deflection
        - right_of_way
        output_ports:
        - command

    ============  ====  ==========  =====  ===========
    port          size  unit        frame  feedthrough
    ============  ====  ==========  =====  ===========
    pose          3 N   m, m, rad   world  -
    velocity      2 N   m/s         world  -
    deflection    N     m/s         -      -
    right_of_way  N     -           -      -
    command       2 N   m/s, rad/s  robot  all
    ============  ====  ==========  =====  ===========

    `deflection` is that of `CollisionAvoidance`, and `right_of_way` 1 for robots that are
    committed; left open it is 0. Numeric parameters: `gain`, `top_speed`.

    Source: ours.

    Args:
        count: Number of robots N.
        gain: Turn rate per heading error of robots that are not committed [1/s].
        top_speed: [m/s].
        period: For how long commands are held: the plant's time step [s].

    Raises:
        InvalidInput: A parameter is not positive.
    """

    def __init__(self, count: int, *, gain: float = 4.0, top_speed: float, period: float):
        super().__init__()
        require(count > 0, "count", "be positive", count)
        for name, value in (("gain", gain), ("top_speed", top_speed), ("period", period)):
            require_positive(name, value)
        self._period = float(period)
        self.parameters = NumericParameters(self, gain=gain, top_speed=top_speed)
        self._pose = self.DeclareVectorInputPort("pose", 3 * count)
        self._velocity = self.DeclareVectorInputPort("velocity", 2 * count)
        self._deflection = self.DeclareVectorInputPort("deflection", count)
        self._committed = self.DeclareVectorInputPort("right_of_way", count)
        self.DeclareVectorOutputPort("command", 2 * count, self._calc_command)

    def _calc_command(self, context, output):
        poses, velocities = read(self._pose, context), read(self._velocity, context)
        gain, top_speed = self.parameters(context)
        commands = _heading_commands(poses, velocities, gain).reshape(-1, 2)
        if self._committed.HasValue(context):
            straight = read(self._committed, context) > 0.5
            straight &= read(self._deflection, context) <= ROUNDING * top_speed
            headings, wished = poses[2::3].copy(), velocities.reshape(-1, 2)
            turned = _turn_first_command(headings, wished, self._period)
            commands = np.where(straight[:, None], turned, commands)
        output.set_value(commands.ravel())
