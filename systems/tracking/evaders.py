"""Evaders that play the corner game or the visibility game, wander, or follow waypoints."""

from collections.abc import Sequence

import numpy as np
from pydrake.systems.framework import LeafSystem

from ..drake_parts import NumericParameters, read, state_vector
from ..numerics.errors import require, require_non_negative, require_positive, require_whole
from ..numerics.geometry.edge_index import index_regions
from ..numerics.geometry.wall_sliding import SKIN
from ..numerics.geometry.world import World
from ..numerics.tracking.adversarial_evasion import adversarial_velocities, escape_outlooks
from ..numerics.tracking.visibility_game.board import make_board
from ..numerics.tracking.visibility_game.evasion import optimal_velocities
from ..numerics.tracking.visibility_game.guaranteed_times import GuaranteedTimes
from .game_ports import GamePorts


class AdversarialEvaders(LeafSystem):
    """Each evader makes for the corner that it can reach best, by the corner game.

    Evaders know where every pursuer is, and who sees what. An evader that nobody sees waits; one
    that no corner can hide runs from the nearest pursuer that sees it.

    .. pydrake_system::

        name: AdversarialEvaders
        input_ports:
        - pursuer_position
        - evader_position
        - sight
        output_ports:
        - velocity

    ================  ===================  ====  =====  ===========
    port              size                 unit  frame  feedthrough
    ================  ===================  ====  =====  ===========
    pursuer_position  2 Np                 m     world  -
    evader_position   2 Ne                 m     world  -
    sight             Np Ne + Np K + Ne K  -     -      -
    velocity          2 Ne                 m/s   world  all
    ================  ===================  ====  =====  ===========

    Numeric parameters: `top_speed`, `speed_ratio`.

    Source: Zhang 2014, Table 2.1 (policy A).

    Args:
        world: Whose corners hide.
        pursuers: Number of pursuers Np.
        evaders: Number of evaders Ne.
        top_speed: Of the evaders [m/s].
        speed_ratio: a = v_e / v_p, in (0, 1).
        radius: Of an evader: least distance of its centre from a wall [m].

    Raises:
        InvalidInput: A number is out of its range.
    """

    def __init__(
        self,
        world: World,
        *,
        pursuers: int,
        evaders: int,
        top_speed: float,
        speed_ratio: float,
        radius: float = 0.0,
    ):
        super().__init__()
        require_positive("top_speed", top_speed)
        require(0 < speed_ratio < 1, "speed_ratio", "lie in (0, 1)", speed_ratio)
        require_non_negative("radius", radius)
        self.parameters = NumericParameters(self, top_speed=top_speed, speed_ratio=speed_ratio)
        # Wall sliding stops a skin short of the wall; a little more is "at the wall".
        self._standoff = float(radius) + 10.0 * SKIN * world.tolerance
        self._game = GamePorts(self, world, pursuers, evaders)
        self.DeclareVectorOutputPort("velocity", 2 * evaders, self._calc_velocity)

    def _calc_velocity(self, context, output):
        top_speed, speed_ratio = self.parameters(context)
        velocity = adversarial_velocities(
            *self._game.positions(context),
            read(self._game.sight, context),
            self._game.corners,
            speed_ratio,
            top_speed,
            self._standoff,
        )
        output.set_value(velocity)


class OptimalEvaders(LeafSystem):
    """Each evader takes the move that leaves its pursuers the least time, whatever they do.

    If several pursuers see it, the longest of their times counts. Among moves with the same value,
    as where it can be kept for ever, it plays as `AdversarialEvaders` do; or, with the distance, it
    makes for the nearest place where it would not be kept for ever. An evader that nobody sees
    waits.

    .. pydrake_system::

        name: OptimalEvaders
        input_ports:
        - pursuer_position
        - evader_position
        - sight
        output_ports:
        - velocity

    ================  ===================  ====  =====  ===========
    port              size                 unit  frame  feedthrough
    ================  ===================  ====  =====  ===========
    pursuer_position  2 Np                 m     world  -
    evader_position   2 Ne                 m     world  -
    sight             Np Ne + Np K + Ne K  -     -      -
    velocity          2 Ne                 m/s   world  all
    ================  ===================  ====  =====  ===========

    Source: ours; see `numerics.tracking.visibility_game.evasion`.

    Args:
        table: The game of one pursuer and one evader, by the middle bound.
        world: Whose corners hide.
        evader_regions: Where the centres of evaders may be, from `shrink_world`.
        pursuers: Number of pursuers Np.
        evaders: Number of evaders Ne.
        with_distance: Whether the distance to losing decides between moves with the same value.
        radius: Of an evader: least distance of its centre from a wall [m].

    Raises:
        InvalidInput: A number is out of its range; the table is too large.
    """

    def __init__(
        self,
        table: GuaranteedTimes,
        world: World,
        evader_regions: Sequence[World],
        *,
        pursuers: int,
        evaders: int,
        with_distance: bool = False,
        radius: float = 0.0,
    ):
        super().__init__()
        require_non_negative("radius", radius)
        self._board = make_board(table)
        self._region = index_regions("evader_regions", evader_regions)
        self._ratio, self._speed = table.evader_speed / table.pursuer_speed, table.evader_speed
        self._step = table.step
        self._with_distance = bool(with_distance)
        # Wall sliding stops a skin short of the wall; a little more is "at the wall".
        self._standoff = float(radius) + 10.0 * SKIN * world.tolerance
        self._game = GamePorts(self, world, pursuers, evaders)
        self.DeclareVectorOutputPort("velocity", 2 * evaders, self._calc_velocity)

    def _calc_velocity(self, context, output):
        pursuers, evaders = self._game.positions(context)
        sight = read(self._game.sight, context)
        game = self._game.corners, self._ratio, self._speed, self._standoff
        outlooks = escape_outlooks(pursuers, evaders, sight, *game)
        outlooks[:, 2] /= self._step
        n, m = self._game.shape
        velocity = optimal_velocities(
            self._board,
            self._region,
            pursuers,
            evaders,
            sight[: n * m].reshape(n, m),
            outlooks,
            self._with_distance,
        )
        output.set_value(velocity)


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


class VelocitySelector(LeafSystem):
    """Passes on, for each member of a team, its velocity from one of several sources.

    .. pydrake_system::

        name: VelocitySelector
        input_ports:
        - source_0
        - source_1
        output_ports:
        - velocity

    ========  ====  ====  =====  ===========
    port      size  unit  frame  feedthrough
    ========  ====  ====  =====  ===========
    source_0  2 N   m/s   world  -
    source_1  2 N   m/s   world  -
    velocity  2 N   m/s   world  all
    ========  ====  ====  =====  ===========

    There are as many inputs `source_k` as sources; two are shown.

    Source: ours.

    Args:
        choices: Source of each member, shape (N,), from 0.
        sources: Number of sources.

    Raises:
        InvalidInput: A choice names no source.
    """

    def __init__(self, choices: Sequence[int], *, sources: int):
        super().__init__()
        require(len(choices) > 0, "choices", "name at least one member", list(choices))
        for choice in choices:
            require(0 <= choice < sources, "choices", f"lie in [0, {sources})", choice)
        self._choices = np.asarray(choices, dtype=int)
        size = 2 * len(choices)
        self._sources = [self.DeclareVectorInputPort(f"source_{k}", size) for k in range(sources)]
        self.DeclareVectorOutputPort("velocity", size, self._calc_velocity)

    def _calc_velocity(self, context, output):
        velocities = np.stack([read(port, context).reshape(-1, 2) for port in self._sources])
        chosen = velocities[self._choices, np.arange(len(self._choices))]
        output.set_value(chosen.ravel())
