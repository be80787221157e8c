"""The stand-off controller that a pursuer runs."""

import sys
from typing import Any

import numpy as np
from pydrake.common.containers import namedview
from pydrake.systems.scalar_conversion import TemplateSystem

from ..drake_types import BasicVector_, LeafSystem_, any_scalar, default_instance
from ..numerics.standoff.loop import StandoffLoop
from ..numerics.standoff.sampled_pid import SampledPid, pid_step

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

        ============  ====  ====  =====
        port          size  unit  frame
        ============  ====  ====  =====
        estimate      1     m     line
        feed_forward  1     m/s   line
        command       1     m/s   line
        ============  ====  ====  =====

        `feed_forward` is the evader's velocity if it is known, else zero. Defined for double,
        AutoDiffXd and Expression.

        Source: Zhang 2014, 2.2.6; filter, limit and anti-windup: see `numerics.standoff`.

        Args:
            loop: Controller, gains and reference; the error model is not looked at.
            sampled: Sample time, filter and limit.
        """

        def _construct(self, loop: StandoffLoop, sampled: SampledPid, *, converter=None):
            LeafSystem_[T].__init__(self, converter=converter)
            self.loop, self.sampled = loop, sampled
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
                self.loop,
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
