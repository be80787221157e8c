"""Evaders that wander at random."""

import numpy as np
from pydrake.systems.framework import LeafSystem

from ..drake_types import state_vector
from ..numeric_parameters import NumericParameters
from ..numerics.errors import require, require_positive


class RandomWalkEvaders(LeafSystem):
    """Each evader runs at top speed, and turns to a new random heading every so often.

    The headings are a function of the seed and the number of the turn alone, so that a run
    repeats exactly and can be resumed from any context.

    .. pydrake_system::

        name: RandomWalkEvaders
        output_ports:
        - velocity

    ========  ====  ====  =====
    port      size  unit  frame
    ========  ====  ====  =====
    velocity  2 Ne  m/s   world
    ========  ====  ====  =====

    Numeric parameters: `top_speed`.

    Source: a baseline of ours.

    Args:
        count: Number of evaders Ne.
        top_speed: [m/s].
        turn_period: Time between turns [s].
        seed: Of the headings.

    Raises:
        InvalidInput: A number is out of its range.
    """

    def __init__(self, count: int, *, top_speed: float, turn_period: float = 2.0, seed: int = 0):
        super().__init__()
        require(count > 0, "count", "be positive", count)
        require_positive("top_speed", top_speed)
        require_positive("turn_period", turn_period)
        require(seed >= 0, "seed", "be zero or positive", seed)
        self._count, self._seed = count, seed
        self.parameters = NumericParameters(self, top_speed=top_speed)
        # The number of the turn, then the directions until the next one.
        self._turn = self.DeclareDiscreteState(state_vector(np.zeros(1)))
        self._direction = self.DeclareDiscreteState(state_vector(self._draw(0)))
        self.DeclarePeriodicDiscreteUpdateEvent(turn_period, turn_period, self._change)
        self.DeclareVectorOutputPort(
            "velocity",
            2 * count,
            self._calc_velocity,
            {self.discrete_state_ticket(self._direction), self.all_parameters_ticket()},
        )

    def _draw(self, turn: int) -> np.ndarray:
        generator = np.random.Generator(np.random.Philox(key=[self._seed, turn]))
        headings = generator.uniform(-np.pi, np.pi, self._count)
        return np.column_stack([np.cos(headings), np.sin(headings)]).ravel()

    def _change(self, context, discrete_state):
        turn = int(context.get_discrete_state(self._turn).value()[0]) + 1
        discrete_state.set_value(self._turn, np.array([float(turn)]))
        discrete_state.set_value(self._direction, self._draw(turn))

    def _calc_velocity(self, context, output):
        direction = context.get_discrete_state(self._direction).value()
        output.set_value(self.parameters(context).top_speed * direction)
