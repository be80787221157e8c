"""Controllers for differential drives: follow a velocity meant for a point, or a straight way."""

import sys
from typing import Any

import numpy as np
from pydrake.systems.framework import LeafSystem
from pydrake.systems.scalar_conversion import TemplateSystem

from ..drake_parts import LeafSystem_, NumericParameters, any_scalar, default_instance, read
from ..numerics.compiled import compiled
from ..numerics.errors import require_positive, require_whole
from ..numerics.tracking.mobile_agents import heading_commands, turn_first_command
from .guaranteed_time import ROUNDING

# The same law, compiled.
_compiled_law = compiled(heading_commands)


@TemplateSystem.define("HeadingController_", scope=sys.modules[__name__])
def HeadingController_(T):
    law = _compiled_law if T is float else heading_commands

    class Impl(LeafSystem_[T]):
        """Turns each robot towards its desired velocity, and drives with the component along it.

        v = |d| cos(error), omega = gain * error, with d the desired velocity and error the angle
        from the robot's heading to it. A robot whose desired velocity points backwards reverses
        while it turns.

        .. pydrake_system::

            name: HeadingController
            input_ports:
            - pose
            - velocity
            output_ports:
            - command

        ========  ====  ==========  =====  ===========
        port      size  unit        frame  feedthrough
        ========  ====  ==========  =====  ===========
        pose      3 N   m, m, rad   world  -
        velocity  2 N   m/s         world  -
        command   2 N   m/s, rad/s  robot  all
        ========  ====  ==========  =====  ===========

        Numeric parameters: `gain`. Defined for double, AutoDiffXd and Expression; not
        differentiable where the desired velocity is zero.

        Source: Zhang 2014, 2.2.8 (the testbed's robots); the law is ours.

        Args:
            count: Number of robots N.
            gain: Turn rate per heading error [1/s].

        Raises:
            InvalidInput: A parameter is not positive.
        """

        def _construct(self, count: int, *, gain: float = 4.0, converter=None):
            LeafSystem_[T].__init__(self, converter=converter)
            require_whole("count", count, 1)
            require_positive("gain", gain)
            self.count = count
            self.gain = float(gain)
            self.parameters = NumericParameters(self, T, gain=gain)
            self._pose = self.DeclareVectorInputPort("pose", 3 * count)
            self._velocity = self.DeclareVectorInputPort("velocity", 2 * count)
            self.DeclareVectorOutputPort("command", 2 * count, self._calc_command)

        def _construct_copy(self, other, converter=None):
            Impl._construct(self, other.count, gain=other.gain, converter=converter)

        @any_scalar(T)
        def _calc_command(self, context, output):
            pose, velocity = self._pose.Eval(context), self._velocity.Eval(context)
            output.SetFromVector(law(pose, velocity, self.parameters(context).gain))

    return Impl


# Any: the class is made at run time.
HeadingController: Any = default_instance(HeadingController_)


# The same laws, compiled.
_heading_commands, _turn_first_command = compiled(heading_commands), compiled(turn_first_command)


class TurnFirstController(LeafSystem):
    """Robots that keep a promise turn in place before they drive; the others drive while they turn.

    A committed robot turns its front or its back to the desired direction, whichever is nearer, as
    fast as it can, and then drives straight, forwards or backwards, with the desired speed. A robot
    that is not committed, or is deflected, is controlled as by `HeadingController`.

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

    `deflection` is that of `CollisionAvoidance`, and `right_of_way` is 1 for committed robots, 0 if
    left open. Numeric parameters: `gain`, `top_speed`.

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
        require_whole("count", count, 1)
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
