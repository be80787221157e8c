"""Evaders that do not react to pursuers: they wander at random, or follow waypoints."""

from collections.abc import Sequence

import numpy as np
from pydrake.systems.framework import LeafSystem

from ..drake_types import read, state_vector
from ..numeric_parameters import NumericParameters
from ..numerics.errors import require, require_positive, require_whole


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
        require_whole("count", count, 1)
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


class WaypointEvaders(LeafSystem):
    """Each evader runs straight from waypoint to waypoint, and round again.

    A waypoint counts as reached within the distance of one period's run; the last run before it is
    shortened so that it ends there. An evader without waypoints rests.

    .. pydrake_system::

        name: WaypointEvaders
        input_ports:
        - evader_position
        output_ports:
        - velocity

    ===============  ====  ====  =====  ===========
    port             size  unit  frame  feedthrough
    ===============  ====  ====  =====  ===========
    evader_position  2 Ne  m     world  -
    velocity         2 Ne  m/s   world  all
    ===============  ====  ====  =====  ===========

    Numeric parameters: `top_speed`.

    Source: the fixed evader trajectory of Zhang 2014, Figure 2.6.

    Args:
        waypoints: Of each evader, shape (k, 2), k >= 0 [m].
        top_speed: [m/s].
        period: For how long a velocity is held [s].

    Raises:
        InvalidInput: A number is out of its range, or a waypoint is not a finite point.
    """

    def __init__(self, waypoints: Sequence[object], *, top_speed: float, period: float):
        super().__init__()
        require_positive("top_speed", top_speed)
        require_positive("period", period)
        self._paths = []
        for j, each in enumerate(waypoints):
            path = np.asarray(each, dtype=float).reshape(-1, 2)
            require(bool(np.isfinite(path).all()), f"waypoints[{j}]", "be finite", path.tolist())
            self._paths.append(path)
        require(len(self._paths) > 0, "waypoints", "name at least one evader", "none")
        self._period = float(period)
        self.parameters = NumericParameters(self, top_speed=top_speed)
        count = len(self._paths)
        self._position = self.DeclareVectorInputPort("evader_position", 2 * count)
        self._next = self.DeclareDiscreteState(state_vector(np.zeros(count)))
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._advance)
        self.DeclareVectorOutputPort("velocity", 2 * count, self._calc_velocity)

    def _offsets(self, context) -> np.ndarray:
        """From each evader to its waypoint, shape (Ne, 2) [m]."""
        positions = read(self._position, context).reshape(-1, 2)
        following = context.get_discrete_state(self._next).value()
        offsets = np.zeros_like(positions)
        for j, path in enumerate(self._paths):
            if len(path):
                offsets[j] = path[int(following[j])] - positions[j]
        return offsets

    def _calc_velocity(self, context, output):
        offsets = self._offsets(context)
        distances = np.hypot(offsets[:, 0], offsets[:, 1])
        pace = np.minimum(self.parameters(context).top_speed, distances / self._period)
        scale = np.divide(pace, distances, out=np.zeros_like(pace), where=distances > 0)
        output.set_value((scale[:, None] * offsets).ravel())

    def _advance(self, context, discrete_state):
        offsets = self._offsets(context)
        run = self.parameters(context).top_speed * self._period
        reached = np.hypot(offsets[:, 0], offsets[:, 1]) <= run
        counts = np.array([max(len(path), 1) for path in self._paths])
        following = context.get_discrete_state(self._next).value()
        discrete_state.set_value(self._next, (following + reached) % counts)
