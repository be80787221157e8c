"""A velocity steered by a person at the live page."""

from math import hypot

from pydrake.common.containers import namedview
from pydrake.geometry import Meshcat
from pydrake.systems.framework import Context, DiscreteValues, EventStatus, LeafSystem, OutputPort

from ...systems.numerics.errors import require_positive

EAST_SLIDER = "east"
NORTH_SLIDER = "north"

# (slider, key for less, key for more)
_SLIDERS = (
    (EAST_SLIDER, "ArrowLeft", "ArrowRight"),
    (NORTH_SLIDER, "ArrowDown", "ArrowUp"),
)

VelocityState = namedview("VelocityState", ["east", "north"])


class MeshcatVelocity(LeafSystem):
    """Turns two sliders of the live page, or the arrow keys, into the velocity of one robot.

    v = s d / max(1, |d|),  d = (east, north) in [-1, 1]^2

    .. pydrake_system::

        name: MeshcatVelocity
        input_ports: []
        output_ports:
        - velocity

    ========  ====  ====  =====  ===========
    port      size  unit  frame  feedthrough
    ========  ====  ====  =====  ===========
    velocity  2     m/s   world  -
    ========  ====  ====  =====  ===========

    The sliders are read once in a period and kept as discrete state, so that all who ask within a
    step get the same answer.

    Source: none in the thesis; it lets a person play an evader (Zhang 2014, 2.2.7, has them move
    by themselves).

    Args:
        meshcat: The page.
        speed: s, the robot's top speed [m/s].
        period: Between readings of the sliders [s].

    Raises:
        InvalidInput: A number is not positive.
    """

    def __init__(self, meshcat: Meshcat, speed: float, *, period: float = 0.05) -> None:
        """Put the sliders on the page.

        Args:
            meshcat: The page.
            speed: Greatest speed s [m/s].
            period: Time between readings [s].
        """
        super().__init__()
        require_positive("speed", speed)
        require_positive("period", period)
        self._meshcat = meshcat
        self._speed = speed
        for name, less, more in _SLIDERS:
            meshcat.DeleteSlider(name, strict=False)
            meshcat.AddSlider(name, -1.0, 1.0, 0.25, 0.0, less, more)
        state = self.DeclareDiscreteState(2)
        self.DeclareInitializationDiscreteUpdateEvent(self._sample)
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._sample)
        self.DeclareStateOutputPort("velocity", state)

    def get_velocity_output_port(self) -> OutputPort:
        """The velocity last asked for."""
        return self.GetOutputPort("velocity")

    def _sample(self, context: Context, values: DiscreteValues) -> EventStatus:
        east, north = (self._meshcat.GetSliderValue(name) for name, _, _ in _SLIDERS)
        scale = self._speed / max(1.0, hypot(east, north))
        state = VelocityState(values.get_mutable_value())
        state.east, state.north = scale * east, scale * north
        return EventStatus.Succeeded()
