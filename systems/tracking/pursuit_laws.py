"""Laws of pursuit around corners: pursuit fields, a look ahead, and the pull to the evader."""

from collections.abc import Sequence

from pydrake.systems.framework import LeafSystem

from ..drake_parts import NumericParameters, read
from ..numerics.errors import require, require_finite, require_non_negative, require_positive
from ..numerics.geometry.edge_index import index_regions
from ..numerics.geometry.world import World
from ..numerics.tracking.lookahead import lookahead_velocities
from ..numerics.tracking.team_pursuit import modified_velocities
from .game_ports import FieldRule, GamePorts


class PursuitFieldController(LeafSystem):
    """Velocities that keep each pursuer's own evader in sight.

    v = top_speed * sum_i w_i v_i / |sum_i w_i v_i| over the corners that pursuer and evader both
    see and behind which the evader could hide; v_i is the corner's pursuit field, w the risk
    vector. Where no corner threatens, and for pursuers without an evader, v = 0.

    .. pydrake_system::

        name: PursuitFieldController
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

    Numeric parameters: `top_speed`, `speed_ratio`.

    Source: Zhang 2014, (2.2), Table 2.2; field "margin": ours.

    Args:
        world: Whose corners threaten.
        pursuers: Number of pursuers Np.
        evaders: Number of evaders Ne.
        top_speed: Of the pursuers [m/s].
        speed_ratio: a = v_e / v_p, in (0, 1).
        field: A name in `FIELDS`.
        risk_vectors: Names in `RISK_VECTORS`, one for all pursuers or one each.
        period: For how long a velocity is held, 0 for continuous time [s]. A step then never
            overshoots the star region.

    Raises:
        InvalidInput: A name is unknown or a number out of its range; at run time, an assignment
            names no evader.
    """

    def __init__(
        self,
        world: World,
        *,
        pursuers: int,
        evaders: int,
        top_speed: float,
        speed_ratio: float,
        field: str = "margin",
        risk_vectors: Sequence[str] = ("proportional",),
        period: float = 0.0,
    ):
        super().__init__()
        require_positive("top_speed", top_speed)
        require(0 < speed_ratio < 1, "speed_ratio", "lie in (0, 1)", speed_ratio)
        self.parameters = NumericParameters(self, top_speed=top_speed, speed_ratio=speed_ratio)
        self._game = GamePorts(self, world, pursuers, evaders, assigned=True)
        self._field = FieldRule(self._game, field, risk_vectors, period)
        self.DeclareVectorOutputPort("velocity", 2 * pursuers, self._calc_velocity)

    def _calc_velocity(self, context, output):
        top_speed, speed_ratio = self.parameters(context)
        targets = self._game.targets(context)
        output.set_value(self._field.velocities(context, targets, speed_ratio, top_speed))


class LookaheadPursuit(LeafSystem):
    """Each pursuer takes the step after which the least margin of all corners is greatest.

    The margins are those of the corner game, over the corners that the pursuer shares with its own
    evader, and with others that it sees, unless a teammate guards those better. A pursuer without
    an evader helps with those that it sees.

    .. pydrake_system::

        name: LookaheadPursuit
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

    Numeric parameters: `top_speed`, `speed_ratio`.

    Source: ours, on the game of Zhang 2014, 2.2.2; see `numerics.tracking.lookahead`.

    Args:
        world: Whose corners threaten.
        regions: Where the pursuers' centres may be, from `shrink_world`.
        pursuers: Number of pursuers Np.
        evaders: Number of evaders Ne.
        top_speed: Of the pursuers [m/s].
        speed_ratio: a = v_e / v_p, in (0, 1).

    Raises:
        InvalidInput: A number is out of its range; at run time, an assignment names no evader.
    """

    def __init__(
        self,
        world: World,
        regions: Sequence[World],
        *,
        pursuers: int,
        evaders: int,
        top_speed: float,
        speed_ratio: float,
    ):
        super().__init__()
        require_positive("top_speed", top_speed)
        require(0 < speed_ratio < 1, "speed_ratio", "lie in (0, 1)", speed_ratio)
        self._region = index_regions("regions", regions)
        self.parameters = NumericParameters(self, top_speed=top_speed, speed_ratio=speed_ratio)
        self._game = GamePorts(self, world, pursuers, evaders, assigned=True)
        self.DeclareVectorOutputPort("velocity", 2 * pursuers, self._calc_velocity)

    def _calc_velocity(self, context, output):
        game = self._game
        top_speed, speed_ratio = self.parameters(context)
        velocity = lookahead_velocities(
            self._region,
            *game.positions(context),
            read(game.sight, context),
            game.targets(context),
            game.corners,
            speed_ratio,
            top_speed,
        )
        output.set_value(velocity)


class ModifiedField(LeafSystem):
    """Adds a pull towards each pursuer's own evader to the pursuit field.

    v = w v_o + (1 - w) v', with v' of length top_speed and directed to the evader. The component of
    v towards the evader is limited to top_speed (distance - stand_off) / fade, from -top_speed to
    top_speed. Pursuers without an evader stay.

    .. pydrake_system::

        name: ModifiedField
        input_ports:
        - pursuer_position
        - evader_position
        - assignment
        - field_velocity
        output_ports:
        - velocity

    ================  ====  ====  =====  ===========
    port              size  unit  frame  feedthrough
    ================  ====  ====  =====  ===========
    pursuer_position  2 Np  m     world  -
    evader_position   2 Ne  m     world  -
    assignment        Np    -     -      -
    field_velocity    2 Np  m/s   world  -
    velocity          2 Np  m/s   world  all
    ================  ====  ====  =====  ===========

    Numeric parameters: `weight`, `top_speed`, `stand_off`, `fade`.

    Source: Zhang 2014, 2.2.5, (2.7); the stand-off distance: ours.

    Args:
        pursuers: Number of pursuers Np.
        evaders: Number of evaders Ne.
        weight: w, from 0 (the pull alone) to 1 (the field alone).
        top_speed: Of the pursuers [m/s].
        stand_off: Distance from the evader to keep [m].
        fade: Distance beyond the stand-off over which the limit grows to the top speed [m].

    Raises:
        InvalidInput: A number is out of its range.
    """

    def __init__(
        self,
        *,
        pursuers: int,
        evaders: int,
        weight: float,
        top_speed: float,
        stand_off: float = 0.45,
        fade: float = 0.2,
    ):
        super().__init__()
        require_finite("weight", weight)
        require(0 <= weight <= 1, "weight", "lie in [0, 1]", weight)
        require_positive("top_speed", top_speed)
        require_non_negative("stand_off", stand_off)
        require_positive("fade", fade)
        self.parameters = NumericParameters(
            self, weight=weight, top_speed=top_speed, stand_off=stand_off, fade=fade
        )
        self._pursuers = self.DeclareVectorInputPort("pursuer_position", 2 * pursuers)
        self._evaders = self.DeclareVectorInputPort("evader_position", 2 * evaders)
        self._assignment = self.DeclareVectorInputPort("assignment", pursuers)
        self._field = self.DeclareVectorInputPort("field_velocity", 2 * pursuers)
        self.DeclareVectorOutputPort("velocity", 2 * pursuers, self._calc_velocity)

    def _calc_velocity(self, context, output):
        weight, top_speed, stand_off, fade = self.parameters(context)
        velocities = modified_velocities(
            weight,
            top_speed,
            stand_off,
            fade,
            read(self._pursuers, context),
            read(self._evaders, context),
            read(self._assignment, context),
            read(self._field, context),
        )
        output.set_value(velocities)
