"""The stand-off loop in closed form: one equation for the distance."""

import sys
from typing import Any

from pydrake.common.containers import namedview
from pydrake.systems.scalar_conversion import TemplateSystem

from ..drake_types import BasicVector_, LeafSystem_, any_scalar, default_instance
from ..numerics.errors import require, require_finite
from ..numerics.standoff.loop import StandoffLoop
from ..numerics.standoff.response import require_start

DistanceState = namedview("DistanceState", ["y", "y_rate"])


@TemplateSystem.define("StandoffClosedLoop_", scope=sys.modules[__name__])
def StandoffClosedLoop_(T):
    class Impl(LeafSystem_[T]):
        """The distance of a pursuer that follows an evader by an ideal stand-off controller.

        With f(y) = a y^2 + (b - 1) y + c + r: P: y' = K_P f; PI: y'' = K_P f' y' + K_I f;
        PD: y' = K_P f / (1 - K_D f'); PID: y'' = (K_P f' y' + K_I f + 2 a K_D y'^2) / (1 - K_D f').

        .. pydrake_system::

            name: StandoffClosedLoop
            output_ports:
            - state

        =====  ====  ======  =====
        port   size  unit    frame
        =====  ====  ======  =====
        state  1, 2  m, m/s  line
        =====  ====  ======  =====

        `state` is y, from the pursuer to the evader along the line, and y' for PI and PID. It
        ends at a singularity, where 1 - K_D f' = 0: a motion that runs into one cannot be
        continued. Defined for double, AutoDiffXd and Expression.

        Source: Zhang 2014, (2.9)-(2.12), corrected; see `numerics.standoff.loop`.

        Args:
            loop: Controller, gains, reference and error model.
            start: y at the start [m].
            start_rate: y' at the start for PI and PID [m/s]; by default what an empty integral
                gives. The thesis has 0.

        Raises:
            InvalidInput: The start is not finite or lies on a singularity; a rate for P or PD.
        """

        def _construct(
            self,
            loop: StandoffLoop,
            start: float,
            start_rate: float | None = None,
            *,
            converter=None,
        ):
            LeafSystem_[T].__init__(self, converter=converter)
            require_start(loop, start)
            initial = [start]
            if loop.integrates:
                initial.append(loop.rate(start) if start_rate is None else start_rate)
                require_finite("start_rate", initial[1])
            else:
                require(start_rate is None, "start_rate", "be left out for P and PD", start_rate)
            self.loop = loop
            self.initial = tuple(float(value) for value in initial)
            state = self.DeclareContinuousState(BasicVector_[T](list(self.initial)))
            self.DeclareStateOutputPort("state", state)

        def _construct_copy(self, other, converter=None):
            Impl._construct(self, other.loop, *other.initial, converter=converter)

        def get_state_output_port(self):
            """y, and y' for PI and PID, size 1 or 2 [m], [m/s]."""
            return self.GetOutputPort("state")

        @any_scalar(T)
        def DoCalcTimeDerivatives(self, context, derivatives):
            values = context.get_continuous_state_vector().CopyToVector()
            if self.loop.integrates:
                state = DistanceState(values)
                rates = [state.y_rate, self.loop.acceleration(state.y, state.y_rate)]
            else:
                rates = [self.loop.rate(values[0])]
            derivatives.get_mutable_vector().SetFromVector(rates)

    return Impl


# Any: the class is made at run time.
StandoffClosedLoop: Any = default_instance(StandoffClosedLoop_)
