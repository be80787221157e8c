"""Pursuers that run along the pursuit fields of the corners."""

from collections.abc import Sequence

from pydrake.systems.framework import LeafSystem

from ..numeric_parameters import NumericParameters
from ..numerics.errors import require, require_positive
from ..numerics.geometry.world import World
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
