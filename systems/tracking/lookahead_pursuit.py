"""Pursuers that look a moment ahead."""

from collections.abc import Sequence

from pydrake.systems.framework import LeafSystem

from ..drake_types import read
from ..numeric_parameters import NumericParameters
from ..numerics.errors import require, require_positive
from ..numerics.geometry.edge_index import index_regions
from ..numerics.geometry.world import World
from ..numerics.tracking.lookahead import lookahead_velocities
from .game_ports import GamePorts


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
