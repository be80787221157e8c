"""LeafSystems that keep a distance by a biased estimate: estimator, controller, closed loop."""

import sys
from typing import Any

import numpy as np
from pydrake.common.containers import namedview
from pydrake.systems.scalar_conversion import TemplateSystem

from .drake_parts import (
    BasicVector_,
    LeafSystem_,
    NumericParameters,
    any_scalar,
    default_instance,
    with_scalars,
)
from .numerics.errors import require, require_finite
from .numerics.standoff.loop import ErrorModel, StandoffLoop
from .numerics.standoff.response import require_start
from .numerics.standoff.sampled_loop import SampledPid, pid_step


@TemplateSystem.define("BiasedRangeEstimator_", scope=sys.modules[__name__])
def BiasedRangeEstimator_(T):
    class Impl(LeafSystem_[T]):
        """Estimates how far ahead the evader is, with the error of the thesis's camera.

        estimate = y - e(y) + noise, y = evader - pursuer, e(y) = a y^2 + b y + c.

        .. pydrake_system::

            name: BiasedRangeEstimator
            input_ports:
            - evader_position
            - pursuer_position
            - noise
            output_ports:
            - estimate

        ================  ====  ====  =====  ===========
        port              size  unit  frame  feedthrough
        ================  ====  ====  =====  ===========
        evader_position   1     m     line   -
        pursuer_position  1     m     line   -
        noise             1     m     line   -
        estimate          1     m     line   all
        ================  ====  ====  =====  ===========

        Numeric parameters: `a`, `b`, `c`. Defined for double, AutoDiffXd and Expression.

        Source: Zhang 2014, 2.2.6, (2.8).

        Args:
            error: The curve e(y).
        """

        def _construct(self, error: ErrorModel, *, converter=None):
            LeafSystem_[T].__init__(self, converter=converter)
            self.error = error
            self.parameters = NumericParameters(self, T, a=error.a, b=error.b, c=error.c)
            self._evader = self.DeclareVectorInputPort("evader_position", 1)
            self._pursuer = self.DeclareVectorInputPort("pursuer_position", 1)
            self._noise = self.DeclareVectorInputPort("noise", 1)
            self.DeclareVectorOutputPort("estimate", 1, self._calc_estimate)

        def _construct_copy(self, other, converter=None):
            Impl._construct(self, other.error, converter=converter)

        def get_estimate_output_port(self):
            """Estimated distance, size 1 [m]."""
            return self.GetOutputPort("estimate")

        @any_scalar(T)
        def _calc_estimate(self, context, output):
            y = self._evader.Eval(context) - self._pursuer.Eval(context)
            error = with_scalars(self.error, **self.parameters(context)._asdict())
            output.SetFromVector(y - error.error(y) + self._noise.Eval(context))

    return Impl


# Any: the class is made at run time.
BiasedRangeEstimator: Any = default_instance(BiasedRangeEstimator_)


PidState = namedview("PidState", ["integral", "filtered", "started", "command"])


@TemplateSystem.define("StandoffPid_", scope=sys.modules[__name__])
def StandoffPid_(T):
    class Impl(LeafSystem_[T]):
        """Keeps an estimated distance: P, PI, PD or PID with filtered derivative, limit, samples.

        At every sample, with eps = estimate - reference and d the filtered derivative of eps,
        command = limit(feed_forward + K_P eps + K_I z + K_D d), z' = eps + (command - unlimited) /
        K_P; the command is held in between. It is zero before the first sample.

        .. pydrake_system::

            name: StandoffPid
            input_ports:
            - estimate
            - feed_forward
            output_ports:
            - command

        ============  ====  ====  =====  ===========
        port          size  unit  frame  feedthrough
        ============  ====  ====  =====  ===========
        estimate      1     m     line   -
        feed_forward  1     m/s   line   -
        command       1     m/s   line   -
        ============  ====  ====  =====  ===========

        `feed_forward` is the evader's velocity if it is known, else zero. Numeric parameters:
        `kp`, `ki`, `kd`, `reference`. Defined for double, AutoDiffXd and Expression.

        Source: Zhang 2014, 2.2.6; filter, limit and anti-windup: see `numerics.standoff`.

        Args:
            loop: Controller, gains and reference; the error model is not looked at.
            sampled: Sample time, filter and limit.
        """

        def _construct(self, loop: StandoffLoop, sampled: SampledPid, *, converter=None):
            LeafSystem_[T].__init__(self, converter=converter)
            self.loop, self.sampled = loop, sampled
            self.parameters = NumericParameters(
                self, T, kp=loop.kp, ki=loop.ki, kd=loop.kd, reference=loop.reference
            )
            self._estimate = self.DeclareVectorInputPort("estimate", 1)
            self._feed_forward = self.DeclareVectorInputPort("feed_forward", 1)
            state = self.DeclareDiscreteState(BasicVector_[T]([0.0, 0.0, 0.0, 0.0]))
            self._state = state
            self.DeclarePeriodicDiscreteUpdateEvent(sampled.period, 0.0, self._sample)
            self.DeclareVectorOutputPort(
                "command", 1, self._calc_command, {self.discrete_state_ticket(state)}
            )

        def _construct_copy(self, other, converter=None):
            Impl._construct(self, other.loop, other.sampled, converter=converter)

        def get_command_output_port(self):
            """Speed along the line, size 1 [m/s]."""
            return self.GetOutputPort("command")

        @any_scalar(T)
        def _sample(self, context, discrete_state):
            state = PidState(context.get_discrete_state(self._state).CopyToVector())
            (estimate,), (feed_forward,) = (
                port.Eval(context) for port in (self._estimate, self._feed_forward)
            )
            memory, command = pid_step(
                (state.integral, state.filtered, state.started),
                estimate,
                feed_forward,
                with_scalars(self.loop, **self.parameters(context)._asdict()),
                self.sampled,
            )
            discrete_state.get_mutable_vector(self._state).SetFromVector(
                np.array([*memory, command])
            )

        def _calc_command(self, context, output):
            state = PidState(context.get_discrete_state(self._state).CopyToVector())
            output.SetFromVector([state.command])

    return Impl


# Any: the class is made at run time.
StandoffPid: Any = default_instance(StandoffPid_)


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
        continued. Numeric parameters: `kp`, `ki`, `kd`, `reference`, and the error model's `a`,
        `b`, `c`. Defined for double, AutoDiffXd and Expression.

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
            self.parameters = NumericParameters(
                self,
                T,
                kp=loop.kp,
                ki=loop.ki,
                kd=loop.kd,
                reference=loop.reference,
                a=loop.error.a,
                b=loop.error.b,
                c=loop.error.c,
            )
            self.initial = tuple(float(value) for value in initial)
            state = self.DeclareContinuousState(BasicVector_[T](list(self.initial)))
            self.DeclareStateOutputPort("state", state)

        def _construct_copy(self, other, converter=None):
            Impl._construct(self, other.loop, *other.initial, converter=converter)

        def get_state_output_port(self):
            """y, and y' for PI and PID, size 1 or 2 [m], [m/s]."""
            return self.GetOutputPort("state")

        def _loop_in(self, context):
            """The loop with the Context's numbers."""
            numbers = self.parameters(context)._asdict()
            error = with_scalars(self.loop.error, **{name: numbers.pop(name) for name in "abc"})
            return with_scalars(self.loop, error=error, **numbers)

        @any_scalar(T)
        def DoCalcTimeDerivatives(self, context, derivatives):
            values = context.get_continuous_state_vector().CopyToVector()
            loop = self._loop_in(context)
            if loop.integrates:
                state = DistanceState(values)
                rates = [state.y_rate, loop.acceleration(state.y, state.y_rate)]
            else:
                rates = [loop.rate(values[0])]
            derivatives.get_mutable_vector().SetFromVector(rates)

    return Impl


# Any: the class is made at run time.
StandoffClosedLoop: Any = default_instance(StandoffClosedLoop_)


__all__ = [
    "BiasedRangeEstimator",
    "BiasedRangeEstimator_",
    "StandoffClosedLoop",
    "StandoffClosedLoop_",
    "StandoffPid",
    "StandoffPid_",
]
