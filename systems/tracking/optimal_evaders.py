"""Evaders that know the solved visibility game of their world."""

from collections.abc import Sequence

from pydrake.systems.framework import LeafSystem

from ..drake_types import read
from ..numerics.errors import require_non_negative
from ..numerics.geometry.edge_index import index_regions
from ..numerics.geometry.wall_sliding import SKIN
from ..numerics.geometry.world import World
from ..numerics.tracking.adversarial_evasion import escape_outlooks
from ..numerics.tracking.visibility_game.board import make_board
from ..numerics.tracking.visibility_game.evasion import optimal_velocities
from ..numerics.tracking.visibility_game.guaranteed_times import GuaranteedTimes
from .game_ports import GamePorts


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
