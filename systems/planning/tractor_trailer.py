"""The grain cart: a tractor with a trailer."""

import sys
from collections.abc import Sequence
from typing import Any

import numpy as np
from pydrake.common.containers import namedview
from pydrake.systems.scalar_conversion import TemplateSystem

from ..drake_types import BasicVector_, LeafSystem_, any_scalar, default_instance
from ..numeric_parameters import NumericParameters, with_scalars
from ..numerics.errors import require, require_finite
from ..numerics.planning.trailer import Trailer, clip_control, trailer_pose, trailer_rates

TrailerState = namedview("TrailerState", ["x", "y", "theta", "beta"])
TrailerControl = namedview("TrailerControl", ["v", "omega"])


@TemplateSystem.define("TractorTrailer_", scope=sys.modules[__name__])
def TractorTrailer_(T):
    class Impl(LeafSystem_[T]):
        """A tractor that pulls, or pushes, one trailer.

        x' = v cos(theta), y' = v sin(theta), theta' = omega,
        beta' = omega - (v sin(beta) - M omega cos(beta)) / L, with L the trailer's length and M
        the hitch offset. Controls beyond the bounds are clipped: v to [0, speed], or to
        [-speed, speed] with reverse; omega to [-turn_rate, turn_rate].

        .. pydrake_system::

            name: TractorTrailer
            input_ports:
            - control
            output_ports:
            - state
            - trailer_pose

        ============  ====  ================  =======  ===========
        port          size  unit              frame    feedthrough
        ============  ====  ================  =======  ===========
        control       2     m/s, rad/s        tractor  -
        state         4     m, m, rad, rad    world    -
        trailer_pose  3     m, m, rad         world    -
        ============  ====  ================  =======  ===========

        `control` is v, omega; `state` is x, y, theta, beta: the tractor's rear axle, its heading
        and the angle from the trailer's heading to the tractor's; `trailer_pose` is the trailer's
        axle and its heading theta - beta. Angles are not wrapped: they count turns. The jackknife
        limit is the planners' to keep; the plant goes on beyond it. Numeric parameters: `speed`,
        `turn_rate`, `length`, `hitch_offset`. Defined for double, AutoDiffXd and Expression.

        Source: Zhang 2014, 3.2.2; the hitch offset is the usual extension.

        Args:
            trailer: Parameters.
            initial_state: x, y, theta, beta [m], [m], [rad], [rad].

        Raises:
            InvalidInput: The initial state is not four finite numbers.
        """

        def _construct(
            self,
            trailer: Trailer,
            initial_state: Sequence[float] = (0.0, 0.0, 0.0, 0.0),
            *,
            converter=None,
        ):
            LeafSystem_[T].__init__(self, converter=converter)
            initial = [float(value) for value in initial_state]
            require(len(initial) == 4, "initial_state", "be (x, y, theta, beta)", initial)
            for value in initial:
                require_finite("initial_state", value)
            self.trailer = trailer
            self.parameters = NumericParameters(
                self,
                T,
                speed=trailer.speed,
                turn_rate=trailer.turn_rate,
                length=trailer.length,
                hitch_offset=trailer.hitch_offset,
            )
            self.initial_state = tuple(initial)
            self._control = self.DeclareVectorInputPort("control", 2)
            state = self.DeclareContinuousState(BasicVector_[T](initial))
            self.DeclareStateOutputPort("state", state)
            self.DeclareVectorOutputPort(
                "trailer_pose",
                3,
                self._calc_trailer_pose,
                {self.all_state_ticket(), self.all_parameters_ticket()},
            )

        def _construct_copy(self, other, converter=None):
            Impl._construct(self, other.trailer, other.initial_state, converter=converter)

        def get_control_input_port(self):
            """Speed and turn rate, size 2 [m/s], [rad/s]."""
            return self._control

        def get_state_output_port(self):
            """x, y, theta, beta, size 4 [m], [m], [rad], [rad]."""
            return self.GetOutputPort("state")

        def get_trailer_pose_output_port(self):
            """The trailer's axle and heading, size 3 [m], [m], [rad]."""
            return self.GetOutputPort("trailer_pose")

        def _trailer_in(self, context):
            """The trailer with the Context's numbers."""
            return with_scalars(self.trailer, **self.parameters(context)._asdict())

        @any_scalar(T)
        def DoCalcTimeDerivatives(self, context, derivatives):
            state = TrailerState(context.get_continuous_state_vector().CopyToVector())
            control = TrailerControl(self._control.Eval(context))
            trailer = self._trailer_in(context)
            v, omega = clip_control(control.v, control.omega, trailer)
            rates = trailer_rates(state.theta, state.beta, v, omega, trailer)
            derivatives.get_mutable_vector().SetFromVector(np.array(rates))

        @any_scalar(T)
        def _calc_trailer_pose(self, context, output):
            x, y, theta, beta = context.get_continuous_state_vector().CopyToVector()
            output.SetFromVector(
                np.array(trailer_pose(x, y, theta, beta, self._trailer_in(context)))
            )

    return Impl


# Any: the class is made at run time.
TractorTrailer: Any = default_instance(TractorTrailer_)
