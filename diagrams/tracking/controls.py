"""What a person steers on the live page: sliders, buttons, and an evader."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from math import hypot

from pydrake.common.containers import namedview
from pydrake.geometry import Meshcat
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, DiscreteValues, EventStatus, LeafSystem, OutputPort

from ...systems.numerics.errors import require, require_positive
from .scene import View

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


# Names as they stand on the page; Meshcat's panel has room for about a dozen letters.
RATE_SLIDER = "speed"
PURSUER_SLIDER = "pursuer"
POLYGON_BUTTON = "visible area on / off (V)"
FIELD_BUTTON = "pursuit field on / off (F)"
LOSING_BUTTON = "losing set on / off (L)"
PAUSE_BUTTON = "pause / resume (Space)"
STOP_BUTTON = "stop (Esc)"
_KEYS = {
    PAUSE_BUTTON: "Space",
    STOP_BUTTON: "Escape",
    POLYGON_BUTTON: "KeyV",
    FIELD_BUTTON: "KeyF",
    LOSING_BUTTON: "KeyL",
}
_FASTEST = 20.0
# How often a paused run looks whether it may go on [s of the wall clock].
_PATIENCE = 0.02


@dataclass(frozen=True, kw_only=True)
class Controls:
    """What the sliders and buttons of the live page say.

    Attributes:
        realtime_rate: Simulated seconds per second; 0 for as fast as possible.
        paused: The run waits.
        stopped: The run shall end.
        view: Whose view is shown, and how much of it.
    """

    realtime_rate: float
    paused: bool
    stopped: bool
    view: View


def add_controls(
    meshcat: Meshcat, *, pursuers: int, realtime_rate: float = 1.0, losing_set: bool = False
) -> None:
    """Put the controls on the page, in place of those of an earlier run.

    Args:
        meshcat: The page.
        pursuers: Number of pursuers to choose from.
        realtime_rate: Where the speed slider starts, from 0 (as fast as possible) to 20.
        losing_set: Whether there is a losing set to switch on and off.

    Raises:
        InvalidInput: There are no pursuers, or the rate is out of its range.
    """
    require(pursuers > 0, "pursuers", "be at least 1", pursuers)
    require(0 <= realtime_rate <= _FASTEST, "realtime_rate", "be from 0 to 20", realtime_rate)
    remove_controls(meshcat)
    for name, keycode in _KEYS.items():
        if losing_set or name != LOSING_BUTTON:
            meshcat.AddButton(name, keycode)
    meshcat.AddSlider(RATE_SLIDER, 0.0, _FASTEST, 0.25, realtime_rate, "Minus", "Equal")
    # A slider needs two ends, so a lone pursuer shares it with nobody (-1), like every team.
    meshcat.AddSlider(PURSUER_SLIDER, -1, pursuers - 1, 1, 0, "BracketLeft", "BracketRight")


def remove_controls(meshcat: Meshcat) -> None:
    """Take the controls off the page, if they are there."""
    for name in _KEYS:
        meshcat.DeleteButton(name, strict=False)
    for name in (RATE_SLIDER, PURSUER_SLIDER):
        meshcat.DeleteSlider(name, strict=False)


def read_controls(meshcat: Meshcat) -> Controls:
    """Read the controls that `add_controls` put on the page.

    A button that switches something has switched it after an odd number of clicks.
    """
    return Controls(
        realtime_rate=meshcat.GetSliderValue(RATE_SLIDER),
        paused=_switched(meshcat, PAUSE_BUTTON),
        stopped=meshcat.GetButtonClicks(STOP_BUTTON) > 0,
        view=read_view(meshcat),
    )


def read_view(meshcat: Meshcat) -> View:
    """Read whose view the page asks for."""
    return View(
        chosen_pursuer=round(meshcat.GetSliderValue(PURSUER_SLIDER)),
        polygon_shown=not _switched(meshcat, POLYGON_BUTTON),
        field_shown=not _switched(meshcat, FIELD_BUTTON),
        losing_shown=not _switched(meshcat, LOSING_BUTTON),
    )


def make_monitor(simulator: Simulator, meshcat: Meshcat) -> Callable[[Context], EventStatus]:
    """Make a monitor, for `simulator.set_monitor`, that obeys the controls at each step.

    It keeps the simulator at the speed of the slider, holds it while the page says pause, and
    ends `AdvanceTo` early when the page says stop.
    """

    def obey(context: Context) -> EventStatus:
        controls = read_controls(meshcat)
        if controls.realtime_rate != simulator.get_target_realtime_rate():
            simulator.set_target_realtime_rate(controls.realtime_rate)
            # Otherwise the simulator would catch up with where the new rate should have led.
            simulator.ResetStatistics()
        if controls.paused and not controls.stopped:
            while controls.paused and not controls.stopped:
                time.sleep(_PATIENCE)
                controls = read_controls(meshcat)
            simulator.ResetStatistics()
        if controls.stopped:
            return EventStatus.ReachedTermination(simulator.get_system(), "stopped on the page")
        return EventStatus.DidNothing()

    return obey


def _switched(meshcat: Meshcat, button: str) -> bool:
    there = button in meshcat.GetButtonNames()
    return there and meshcat.GetButtonClicks(button) % 2 == 1
