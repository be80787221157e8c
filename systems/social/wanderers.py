"""Common agents that walk about."""

import numpy as np
from pydrake.systems.framework import LeafSystem

from ..drake_types import read, state_vector
from ..numerics.errors import require, require_positive
from ..numerics.social.routes.infrared import InfraredRing
from ..numerics.social.routes.motion import WanderingLaw, wander


class Wanderers(LeafSystem):
    """Robots that go straight on until something is near, then turn by a random angle.

    The angles are a function of the seed and of the number of the period alone, so that a run
    repeats exactly and can be resumed from any context.

    .. pydrake_system::

        name: Wanderers
        input_ports:
        - infrared
        output_ports:
        - command

    ========  =======  ==========  =====  ===========
    port      size     unit        frame  feedthrough
    ========  =======  ==========  =====  ===========
    infrared  N ring   m           robot  -
    command   2 N      m/s, rad/s  robot  all
    ========  =======  ==========  =====  ===========

    Source: Zhang 2014, 2.3.4.3.

    Args:
        count: Number of robots N.
        law: What they do about what they feel.
        ring: Where the sensors look.
        period: For how long a command is held [s].
        seed: Of the angles.

    Raises:
        InvalidInput: A number is out of its range.
    """

    def __init__(
        self, count: int, *, law: WanderingLaw, ring: InfraredRing, period: float, seed: int = 0
    ):
        super().__init__()
        require(count > 0, "count", "be positive", count)
        require_positive("period", period)
        require(seed >= 0, "seed", "be zero or positive", seed)
        self._count, self._law, self._ring = count, law, ring
        self._period, self._seed = float(period), seed
        self._infrared = self.DeclareVectorInputPort("infrared", count * ring.count)
        # The number of the period, then what each robot has left to turn.
        self._step = self.DeclareDiscreteState(state_vector(np.zeros(1)))
        self._turns = self.DeclareDiscreteState(state_vector(np.zeros(count)))
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._advance)
        self.DeclareVectorOutputPort("command", 2 * count, self._calc_command)

    def get_infrared_input_port(self):
        """What the sensors say [m]."""
        return self._infrared

    def get_command_output_port(self):
        """Speed and turn rate of each, size 2 N [m/s], [rad/s]."""
        return self.GetOutputPort("command")

    def _wander(self, context) -> tuple[np.ndarray, np.ndarray]:
        step = int(context.get_discrete_state(self._step).value()[0])
        generator = np.random.Generator(np.random.Philox(key=[self._seed, step]))
        return wander(
            self._law,
            self._ring,
            np.array(context.get_discrete_state(self._turns).value()),
            read(self._infrared, context).reshape(self._count, -1),
            generator.random(self._count),
            self._period,
        )

    def _advance(self, context, discrete_state):
        step = context.get_discrete_state(self._step).value()[0]
        discrete_state.set_value(self._turns, self._wander(context)[0])
        discrete_state.set_value(self._step, np.array([step + 1.0]))

    def _calc_command(self, context, output):
        output.set_value(self._wander(context)[1].ravel())
