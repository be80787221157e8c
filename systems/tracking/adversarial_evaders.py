"""Evaders that play to break the line of sight."""

from pydrake.systems.framework import LeafSystem

from ..drake_types import read
from ..numeric_parameters import NumericParameters
from ..numerics.errors import require, require_non_negative, require_positive
from ..numerics.geometry.wall_sliding import SKIN
from ..numerics.geometry.world import World
from ..numerics.tracking.adversarial_evasion import adversarial_velocities
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
