"""Pursuers that play by solved visibility games: with one evader each, or with shares of them."""

from collections.abc import Sequence

import numpy as np
from pydrake.systems.framework import LeafSystem, ValueProducer

from ..drake_parts import AbstractValue, state_vector
from ..numerics.errors import require_positive
from ..numerics.geometry.world import World
from ..numerics.tracking.visibility_game.board import make_board
from ..numerics.tracking.visibility_game.guaranteed_times import GuaranteedTimes
from ..numerics.tracking.visibility_game.pursuit import guarantee_velocities
from ..numerics.tracking.visibility_game.responsibilities import (
    NOBODY,
    hardest,
    make_team_board,
    prospects,
    responsibilities,
    shared_certificate,
    team_velocities,
    watchers,
)
from ..numerics.tracking.visibility_game.two_evaders import GuaranteedTimesOfTwo
from .game_ports import FieldRule, GamePorts


class GuaranteePursuit(LeafSystem):
    """Each pursuer takes the step that leaves the longest time, whatever its evader does.

    Of several such steps it takes the one after which the evader is farthest from where it would be
    lost. A pursuer whose evader is hidden goes to where it could guard it; meanwhile a teammate
    that sees that evader minds both. Where the table has no answer they follow the margin field.

    .. pydrake_system::

        name: GuaranteePursuit
        input_ports:
        - pursuer_position
        - evader_position
        - sight
        - assignment
        output_ports:
        - velocity

    ================  ===================  ====  =====  ===========
    port              size                 unit  frame  feedthrough
    ================  ===================  ====  =====  ===========
    pursuer_position  2 Np                 m     world  -
    evader_position   2 Ne                 m     world  -
    sight             Np Ne + Np K + Ne K  -     -      -
    assignment        Np                   -     -      -
    velocity          2 Np                 m/s   world  all
    ================  ===================  ====  =====  ===========

    Source: ours; see `numerics.tracking.visibility_game`.

    Args:
        table: The game of one pursuer and one evader, by the middle bound.
        world: Whose corners threaten.
        pursuers: Number of pursuers Np.
        evaders: Number of evaders Ne.
        risk_vectors: Names in `RISK_VECTORS`, one for all pursuers or one each, for the field.
        period: For how long a velocity is held, 0 for continuous time [s].

    Raises:
        InvalidInput: A name is unknown or a number out of its range; the table is too large; at
            run time, an assignment names no evader.
    """

    def __init__(
        self,
        table: GuaranteedTimes,
        world: World,
        *,
        pursuers: int,
        evaders: int,
        risk_vectors: Sequence[str] = ("proportional",),
        period: float = 0.0,
    ):
        super().__init__()
        self._game = GamePorts(self, world, pursuers, evaders, assigned=True)
        self._field = FieldRule(self._game, "margin", risk_vectors, period)
        self._board = make_board(table)
        self._speed, self._period = table.pursuer_speed, float(period)
        self._ratio = table.evader_speed / table.pursuer_speed
        self.DeclareVectorOutputPort("velocity", 2 * pursuers, self._calc_velocity)

    def _calc_velocity(self, context, output):
        game, targets = self._game, self._game.targets(context)
        velocity = guarantee_velocities(
            self._board,
            *game.positions(context),
            game.visible(context),
            targets,
            self._field.velocities(context, targets, self._ratio, self._speed),
            self._speed,
            self._period,
        )
        output.set_value(velocity)


class TeamGuaranteePursuit(LeafSystem):
    """Each evader has a responsible pursuer, which keeps all of its evaders in sight.

    The team shares the evaders out so that the least guaranteed time is the largest, and keeps the
    shares until others gain enough. While a pursuer does not see an evader of its own, a teammate
    watches that too. A pursuer that watches one evader plays by the game of one, with several by
    the game of two.

    .. pydrake_system::

        name: TeamGuaranteePursuit
        input_ports:
        - pursuer_position
        - evader_position
        - sight
        output_ports:
        - assignment
        - responsible
        - certificate
        - velocity

    ================  ===================  ====  =====  ===========
    port              size                 unit  frame  feedthrough
    ================  ===================  ====  =====  ===========
    pursuer_position  2 Np                 m     world  -
    evader_position   2 Ne                 m     world  -
    sight             Np Ne + Np K + Ne K  -     -      -
    assignment        Np                   -     -      all
    responsible       Ne                   -     -      all
    certificate       1                    s     -      all
    velocity          2 Np                 m/s   world  all
    ================  ===================  ====  =====  ===========

    `certificate` is for how long all evaders can be kept, by the middle bounds, infinite if for
    ever. `responsible` is the pursuer responsible for each evader, or -1; an evader that nobody
    sees any more keeps its pursuer. `assignment` is, of the evaders that each pursuer watches, the
    one that it can keep for the shortest time, or -1. `responsible` is held as discrete state.

    Source: ours; see `numerics.tracking.visibility_game`.

    Args:
        single, double: The games of one evader and of two, by the middle bound.
        world: Whose corners threaten.
        pursuers: Number of pursuers Np.
        evaders: Number of evaders Ne.
        period: For how long velocities and responsibilities are held [s].
        risk_vectors: Names in `RISK_VECTORS`, one for all pursuers or one each, for the field that
            decides where the tables have no answer.

    Raises:
        InvalidInput: A name is unknown or a number out of its range; a table is too large.
    """

    def __init__(
        self,
        single: GuaranteedTimes,
        double: GuaranteedTimesOfTwo,
        world: World,
        *,
        pursuers: int,
        evaders: int,
        period: float,
        risk_vectors: Sequence[str] = ("proportional",),
    ):
        super().__init__()
        require_positive("period", period)
        self._game = GamePorts(self, world, pursuers, evaders)
        self._field = FieldRule(self._game, "margin", risk_vectors, period)
        self._board = make_team_board(single, double)
        self._speed, self._period = single.pursuer_speed, float(period)
        self._ratio = single.evader_speed / single.pursuer_speed
        nobody = state_vector(np.full(evaders, float(NOBODY)))
        self._held = self.DeclareDiscreteState(nobody)
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._keep)
        # Cached, so that it is looked up once for all outputs.
        looked_up = ValueProducer(lambda: AbstractValue.Make([]), self._look_up)
        ports = self._game.pursuers, self._game.evaders, self._game.sight
        self._known = self.DeclareCacheEntry(
            "prospects", looked_up, {port.ticket() for port in ports}
        )
        self._assignment = self.DeclareVectorOutputPort(
            "assignment", pursuers, self._calc_assignment
        )
        self._responsible = self.DeclareVectorOutputPort(
            "responsible", evaders, self._calc_responsible
        )
        self.DeclareVectorOutputPort("certificate", 1, self._calc_certificate)
        self.DeclareVectorOutputPort("velocity", 2 * pursuers, self._calc_velocity)

    def _look_up(self, context, value):
        visible = self._game.visible(context)
        found = prospects(self._board, *self._game.positions(context), visible)
        value.set_value([*found, visible])

    def _prospects(self, context) -> list[np.ndarray]:
        """Times of one evader and of two, and who sees whom."""
        return self._known.Eval(context)  # type: ignore[return-value]  # the stubs say object

    def _calc_responsible(self, context, output):
        held = context.get_discrete_state(self._held).value().astype(int)
        one, two, visible = self._prospects(context)
        step = self._board.steps[1]
        output.set_value(responsibilities(one, two, visible, held, step))

    def _owners(self, context):
        """The pursuer responsible for each evader, or NOBODY, shape (Ne,)."""
        return np.asarray(self._responsible.Eval(context)).astype(int)

    def _watching(self, context):
        """Who watches each evader, or NOBODY, shape (Ne,)."""
        one, two, visible = self._prospects(context)
        return watchers(one, two, visible, self._owners(context))

    def _keep(self, context, discrete_state):
        discrete_state.set_value(self._held, self._responsible.Eval(context))

    def _calc_assignment(self, context, output):
        output.set_value(hardest(self._prospects(context)[0], self._watching(context)))

    def _calc_certificate(self, context, output):
        one, two, _ = self._prospects(context)
        output.set_value([shared_certificate(one, two, self._watching(context))])

    def _calc_velocity(self, context, output):
        assignment = np.asarray(self._assignment.Eval(context))
        velocity = team_velocities(
            self._board,
            *self._game.positions(context),
            self._owners(context),
            self._watching(context),
            self._field.velocities(context, assignment, self._ratio, self._speed),
            self._speed,
            self._period,
        )
        output.set_value(velocity)
