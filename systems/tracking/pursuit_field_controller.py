"""Pursuers that run along the pursuit fields of the corners."""

from collections.abc import Sequence

from pydrake.systems.framework import LeafSystem

from ..drake_types import read
from ..numeric_parameters import NumericParameters
from ..numerics.errors import require, require_non_negative, require_one_of, require_positive
from ..numerics.geometry.world import World
from ..numerics.tracking.corner_fields import FIELDS
from ..numerics.tracking.corner_game import corner_table
from ..numerics.tracking.risk import RISK_VECTORS
from ..numerics.tracking.sight_state import sight_size
from ..numerics.tracking.team_pursuit import team_pursuit
from .assignment import codes_of, require_assignment


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
        require_one_of("field", field, FIELDS)
        require_non_negative("period", period)
        self._field = FIELDS[field]
        self._weightings = codes_of("risk_vectors", risk_vectors, RISK_VECTORS, pursuers)
        self._corners = corner_table(world)
        self._evader_count = evaders
        self._period = float(period)
        self.parameters = NumericParameters(self, top_speed=top_speed, speed_ratio=speed_ratio)
        self._pursuers = self.DeclareVectorInputPort("pursuer_position", 2 * pursuers)
        self._evaders = self.DeclareVectorInputPort("evader_position", 2 * evaders)
        size = sight_size(pursuers, evaders, len(self._corners))
        self._sight = self.DeclareVectorInputPort("sight", size)
        self._assignment = self.DeclareVectorInputPort("assignment", pursuers)
        self.DeclareVectorOutputPort("velocity", 2 * pursuers, self._calc_velocity)

    def _calc_velocity(self, context, output):
        assignment = read(self._assignment, context)
        require_assignment(assignment, self._evader_count)
        top_speed, speed_ratio = self.parameters(context)
        velocity = team_pursuit(
            self._field,
            self._weightings,
            read(self._pursuers, context),
            read(self._evaders, context),
            read(self._sight, context),
            assignment,
            self._corners,
            speed_ratio,
            top_speed,
            self._period,
        )
        output.set_value(velocity)
