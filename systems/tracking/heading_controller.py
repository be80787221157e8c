"""How a differential-drive robot follows a velocity meant for a point."""

import sys
from typing import Any

from pydrake.systems.scalar_conversion import TemplateSystem

from ..drake_types import LeafSystem_, any_scalar, default_instance
from ..numeric_parameters import NumericParameters
from ..numerics.compiled import compiled
from ..numerics.errors import require, require_positive
from ..numerics.tracking.mobile_agents import heading_commands

# The same law, compiled.
_compiled_law = compiled(heading_commands)


@TemplateSystem.define("HeadingController_", scope=sys.modules[__name__])
def HeadingController_(T):
    law = _compiled_law if T is float else heading_commands

    class Impl(LeafSystem_[T]):
        """Turns each robot towards its desired velocity, and drives by the part along it.

        v = |d| cos(error), omega = gain * error, with d the desired velocity and error the angle
        from the robot's heading to it. A robot that is to go backwards reverses while it turns.

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
            require(count > 0, "count", "be positive", count)
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
