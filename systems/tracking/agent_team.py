"""A team of point agents, (2.1)."""

import sys
from typing import Any

import numpy as np
from pydrake.systems.scalar_conversion import TemplateSystem

from ..drake_types import BasicVector_, LeafSystem_, any_scalar, default_instance
from ..numeric_parameters import NumericParameters
from ..numerics.compiled import compiled
from ..numerics.errors import require, require_non_negative, require_positive
from ..numerics.tracking.mobile_agents import point_rates, point_step

# The same equation, compiled: in the 20 Hz loop of a team the interpreter would dominate.
_compiled_step = compiled(point_step)


@TemplateSystem.define("AgentTeam_", scope=sys.modules[__name__])
def AgentTeam_(T):
    step = _compiled_step if T is float else point_step

    class Impl(LeafSystem_[T]):
        """N point agents that follow velocity commands up to their top speed.

        x' = u cos(theta), y' = u sin(theta), with u <= top_speed; the command is the velocity
        (u cos(theta), u sin(theta)), shortened where it is too fast. With a positive time step
        the team is a discrete-time system, x[n+1] = x[n] + h x', exact for commands held over a
        step; with time step 0 it is continuous.

        .. pydrake_system::

            name: AgentTeam
            input_ports:
            - velocity
            output_ports:
            - position

        ========  ====  ====  =====  ===========
        port      size  unit  frame  feedthrough
        ========  ====  ====  =====  ===========
        velocity  2 N   m/s   world  -
        position  2 N   m     world  -
        ========  ====  ====  =====  ===========

        Vectors hold x_0, y_0, x_1, y_1, ... Numeric parameters: `top_speed`. Defined for double,
        AutoDiffXd and Expression.

        Source: Zhang 2014, (2.1).

        Args:
            initial_positions: Shape (N, 2) [m].
            top_speed: [m/s].
            time_step: Update period, or 0 for continuous time [s].

        Raises:
            InvalidInput: A parameter is out of its range.
        """

        def _construct(
            self, initial_positions, *, top_speed: float, time_step: float = 0.0, converter=None
        ):
            LeafSystem_[T].__init__(self, converter=converter)
            initial = np.asarray(initial_positions, dtype=float)
            require(
                initial.ndim == 2 and initial.shape[1] == 2 and len(initial) > 0,
                "initial_positions",
                "have shape (N, 2)",
                initial.shape,
            )
            require(bool(np.isfinite(initial).all()), "initial_positions", "be finite", initial)
            require_positive("top_speed", top_speed)
            require_non_negative("time_step", time_step)
            self.initial_positions = initial
            self.top_speed = float(top_speed)
            self.time_step = float(time_step)
            self.parameters = NumericParameters(self, T, top_speed=top_speed)
            size = initial.size
            self._velocity = self.DeclareVectorInputPort("velocity", size)
            model = BasicVector_[T](initial.ravel())
            if time_step > 0:
                state = self.DeclareDiscreteState(model)
                self.DeclarePeriodicDiscreteUpdateEvent(time_step, 0.0, self._step)
            else:
                state = self.DeclareContinuousState(model)
            self.DeclareStateOutputPort("position", state)

        def _construct_copy(self, other, converter=None):
            Impl._construct(
                self,
                other.initial_positions,
                top_speed=other.top_speed,
                time_step=other.time_step,
                converter=converter,
            )

        def get_velocity_input_port(self):
            """Commanded velocities, size 2 N [m/s]."""
            return self._velocity

        def get_position_output_port(self):
            """Positions, size 2 N [m]."""
            return self.GetOutputPort("position")

        @any_scalar(T)
        def _step(self, context, discrete_state):
            position = context.get_discrete_state_vector().CopyToVector()
            velocity = self._velocity.Eval(context)
            top_speed = self.parameters(context).top_speed
            discrete_state.set_value(step(position, velocity, top_speed, self.time_step))

        @any_scalar(T)
        def DoCalcTimeDerivatives(self, context, derivatives):
            if self.time_step == 0:
                top_speed = self.parameters(context).top_speed
                rates = point_rates(self._velocity.Eval(context), top_speed)
                derivatives.get_mutable_vector().SetFromVector(rates)

    return Impl


# Any: the class is made at run time.
AgentTeam: Any = default_instance(AgentTeam_)
