"""Pursuers that run along the pursuit fields and keep near their evaders."""

from pydrake.systems.framework import LeafSystem

from ..drake_types import read
from ..numeric_parameters import NumericParameters
from ..numerics.errors import require, require_finite, require_non_negative, require_positive
from ..numerics.tracking.modified_field import modified_velocities


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
