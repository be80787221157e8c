"""Teams of agents: points (2.1), and differential-drive robots."""

import sys
from typing import Any

import numpy as np
from pydrake.systems.scalar_conversion import TemplateSystem

from ..drake_parts import BasicVector_, LeafSystem_, NumericParameters, any_scalar, default_instance
from ..numerics.compiled import compiled
from ..numerics.errors import require, require_non_negative, require_positive
from ..numerics.tracking.mobile_agents import (
    clip_symmetric,
    drive_step,
    point_rates,
    point_step,
    unicycle_rates,
)

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


# The same equation, compiled: in the 20 Hz loop of a team the interpreter would dominate.
_compiled_drive = compiled(drive_step)


@TemplateSystem.define("DifferentialDriveTeam_", scope=sys.modules[__name__])
def DifferentialDriveTeam_(T):
    step = _compiled_drive if T is float else drive_step

    class Impl(LeafSystem_[T]):
        """N differential-drive robots: unicycles with bounded speed and turn rate.

        x' = v cos(theta), y' = v sin(theta), theta' = omega, with |v| <= top_speed and
        |omega| <= top_turn_rate; commands beyond are clipped. With a positive time step the team
        is a discrete-time system whose members move along straight chords, second-order accurate
        for commands held over a step; with time step 0 it is continuous.

        .. pydrake_system::

            name: DifferentialDriveTeam
            input_ports:
            - command
            output_ports:
            - pose
            - position
            - direction

        =========  ====  ===========  =====  ===========
        port       size  unit         frame  feedthrough
        =========  ====  ===========  =====  ===========
        command    2 N   m/s, rad/s   robot  -
        pose       3 N   m, m, rad    world  -
        position   2 N   m            world  -
        direction  2 N   -            world  -
        =========  ====  ===========  =====  ===========

        `command` holds v_0, omega_0, v_1, ...; `pose` x_0, y_0, theta_0, x_1, ...; `direction`
        is the unit vector along each heading. Headings are not wrapped: they count turns.
        Numeric parameters: `top_speed`, `top_turn_rate`. Defined for double, AutoDiffXd and
        Expression.

        Source: the testbed's robots, Zhang 2014, 2.2.8.

        Args:
            initial_poses: Shape (N, 3) [m], [m], [rad].
            top_speed: [m/s].
            top_turn_rate: [rad/s].
            time_step: Update period, or 0 for continuous time [s].

        Raises:
            InvalidInput: A parameter is out of its range.
        """

        def _construct(
            self,
            initial_poses,
            *,
            top_speed: float,
            top_turn_rate: float,
            time_step: float = 0.0,
            converter=None,
        ):
            LeafSystem_[T].__init__(self, converter=converter)
            initial = np.asarray(initial_poses, dtype=float)
            require(
                initial.ndim == 2 and initial.shape[1] == 3 and len(initial) > 0,
                "initial_poses",
                "have shape (N, 3)",
                initial.shape,
            )
            require(bool(np.isfinite(initial).all()), "initial_poses", "be finite", initial)
            require_positive("top_speed", top_speed)
            require_positive("top_turn_rate", top_turn_rate)
            require_non_negative("time_step", time_step)
            self.initial_poses = initial
            self.top_speed = float(top_speed)
            self.top_turn_rate = float(top_turn_rate)
            self.time_step = float(time_step)
            self.parameters = NumericParameters(
                self, T, top_speed=top_speed, top_turn_rate=top_turn_rate
            )
            count = len(initial)
            self._command = self.DeclareVectorInputPort("command", 2 * count)
            model = BasicVector_[T](initial.ravel())
            if time_step > 0:
                state = self.DeclareDiscreteState(model)
                self.DeclarePeriodicDiscreteUpdateEvent(time_step, 0.0, self._step)
            else:
                state = self.DeclareContinuousState(model)
            self.DeclareStateOutputPort("pose", state)
            state_only = {self.all_state_ticket()}
            self.DeclareVectorOutputPort("position", 2 * count, self._calc_position, state_only)
            self.DeclareVectorOutputPort("direction", 2 * count, self._calc_direction, state_only)

        def _construct_copy(self, other, converter=None):
            Impl._construct(
                self,
                other.initial_poses,
                top_speed=other.top_speed,
                top_turn_rate=other.top_turn_rate,
                time_step=other.time_step,
                converter=converter,
            )

        def get_command_input_port(self):
            """Speeds and turn rates, size 2 N [m/s], [rad/s]."""
            return self._command

        def get_pose_output_port(self):
            """Poses, size 3 N [m], [m], [rad]."""
            return self.GetOutputPort("pose")

        def get_position_output_port(self):
            """Positions, size 2 N [m]."""
            return self.GetOutputPort("position")

        def _poses(self, context):
            if self.time_step > 0:
                state = context.get_discrete_state_vector()
            else:
                state = context.get_continuous_state_vector()
            return state.CopyToVector().reshape(-1, 3)

        @any_scalar(T)
        def _step(self, context, discrete_state):
            poses = context.get_discrete_state_vector().CopyToVector()
            commands = self._command.Eval(context)
            limits = np.array(self.parameters(context))
            discrete_state.set_value(step(poses, commands, limits, self.time_step))

        @any_scalar(T)
        def DoCalcTimeDerivatives(self, context, derivatives):
            if self.time_step == 0:
                limits = np.array(self.parameters(context))
                commands = clip_symmetric(self._command.Eval(context).reshape(-1, 2), limits)
                rates = unicycle_rates(self._poses(context)[:, 2], commands)
                derivatives.get_mutable_vector().SetFromVector(rates.ravel())

        def _calc_position(self, context, output):
            output.SetFromVector(self._poses(context)[:, :2].ravel())

        @any_scalar(T)
        def _calc_direction(self, context, output):
            headings = self._poses(context)[:, 2]
            output.SetFromVector(np.stack([np.cos(headings), np.sin(headings)], axis=1).ravel())

    return Impl


# Any: the class is made at run time.
DifferentialDriveTeam: Any = default_instance(DifferentialDriveTeam_)
