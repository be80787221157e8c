"""Pursuers that know the solved visibility game of their world."""

from collections.abc import Sequence

from pydrake.systems.framework import LeafSystem

from ..drake_types import read
from ..numerics.errors import require_non_negative
from ..numerics.geometry.world import World
from ..numerics.tracking.corner_fields import FIELDS
from ..numerics.tracking.corner_table import corner_table
from ..numerics.tracking.risk import RISK_VECTORS
from ..numerics.tracking.sight_state import sight_size
from ..numerics.tracking.team_pursuit import team_pursuit
from ..numerics.tracking.visibility_game.board import make_board
from ..numerics.tracking.visibility_game.guaranteed_times import GuaranteedTimes
from ..numerics.tracking.visibility_game.pursuit import guarantee_velocities
from .assignment import codes_of, require_assignment


class GuaranteePursuit(LeafSystem):
    """Each pursuer takes the step that leaves the longest time, whatever its evader does.

    Of several it takes the one after which the evader is farthest from where it would be lost. One
    whose evader is hidden goes to where it could guard it; meanwhile a teammate that sees that
    evader minds both. Where the table knows nothing they follow the margin field.

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
        require_non_negative("period", period)
        self._board = make_board(table)
        self._weightings = codes_of("risk_vectors", risk_vectors, RISK_VECTORS, pursuers)
        self._corners = corner_table(world)
        self._shape = (pursuers, evaders)
        self._speed, self._period = table.pursuer_speed, float(period)
        self._ratio = table.evader_speed / table.pursuer_speed
        self._pursuers = self.DeclareVectorInputPort("pursuer_position", 2 * pursuers)
        self._evaders = self.DeclareVectorInputPort("evader_position", 2 * evaders)
        size = sight_size(pursuers, evaders, len(self._corners))
        self._sight = self.DeclareVectorInputPort("sight", size)
        self._assignment = self.DeclareVectorInputPort("assignment", pursuers)
        self.DeclareVectorOutputPort("velocity", 2 * pursuers, self._calc_velocity)

    def _calc_velocity(self, context, output):
        pursuers, evaders = read(self._pursuers, context), read(self._evaders, context)
        assignment, sight = read(self._assignment, context), read(self._sight, context)
        require_assignment(assignment, self._shape[1])
        field = team_pursuit(
            FIELDS["margin"],
            self._weightings,
            pursuers,
            evaders,
            sight,
            assignment,
            self._corners,
            self._ratio,
            self._speed,
            self._period,
        )
        n, m = self._shape
        visible = sight[: n * m].reshape(n, m) > 0.5
        velocity = guarantee_velocities(
            self._board, pursuers, evaders, visible, assignment, field, self._speed, self._period
        )
        output.set_value(velocity)
