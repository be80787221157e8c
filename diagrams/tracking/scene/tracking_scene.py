"""The tracking story in Meshcat: all layers of the scene together, and a system that draws them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from pydrake.geometry import Meshcat
from pydrake.systems.framework import Context, EventStatus, InputPort, LeafSystem

from ....systems.drake_parts import read
from ....systems.numerics.errors import require, require_positive
from ....systems.numerics.geometry.world import World
from ....systems.numerics.tracking.collision_stop import pair_gaps
from ...visuals.stage import Stage
from .floor_layers import (
    FieldLayer,
    LosingLayer,
    LosingSet,
    PursuitField,
    SightLines,
    Trails,
    VisibilityLayer,
    draw_world,
)
from .layout import EVADER, PURSUER, Layout, make_layout, set_camera
from .panel import Panel
from .robots import Team

# Where everything is, in Meshcat's tree.
ROOT = "/tracking"
# How far a replay may pass from where things were, relative to the view: a twentieth of a pixel.
_TOLERANCE = 5e-5


@dataclass(frozen=True, kw_only=True)
class View:
    """The choices of a viewer of the tracking scene.

    Attributes:
        chosen_pursuer: Whose visibility polygon, losing set and field are drawn; -1 for nobody's.
        polygon_shown: Draw the visibility polygon.
        field_shown: Draw the pursuit field.
        losing_shown: Draw where the pursuer would lose an evader, where that is known.
    """

    chosen_pursuer: int = 0
    polygon_shown: bool = True
    field_shown: bool = True
    losing_shown: bool = True


@dataclass(frozen=True, kw_only=True, eq=False)
class Snapshot:
    """The game at one time.

    Attributes:
        time: Since the start of the run [s].
        pursuers: Positions, shape (Np, 2) [m].
        evaders: Positions, shape (Ne, 2) [m].
        pursuer_directions: Vectors along the headings, shape (Np, 2); zero where unknown.
        evader_directions: The same of the evaders, shape (Ne, 2).
        visibility: True where pursuer i sees evader j, shape (Np, Ne).
        assignment: The evader that each pursuer chases, or -1, shape (Np,).
        certificate: For how long all evaders can be kept [s]; None where that is not known.
    """

    time: float
    pursuers: np.ndarray
    evaders: np.ndarray
    pursuer_directions: np.ndarray
    evader_directions: np.ndarray
    visibility: np.ndarray
    assignment: np.ndarray
    certificate: float | None = None


class Layers:
    """The drawn scene: still parts at once, moving parts with every snapshot.

    Args:
        stage: Where to draw.
        layout: Sizes.
        world: Whose obstacles.
        grown: Where robots' centres may be.
        pursuers, evaders: How many.
        visibility_polygon: From a point, shape (2,) [m], to what it sees, shape (n, 2) [m].
        pursuit_field: Of a pursuer, at points.
        radii: Of all robots, pursuers first, shape (Np + Ne,) [m].
        losing_set: Of a pursuer at a place, where the solved visibility game is known.
        certificate: What the panel calls the certificate; None where there is none.
    """

    def __init__(
        self,
        stage: Stage,
        layout: Layout,
        world: World,
        grown: Sequence[World],
        *,
        pursuers: int,
        evaders: int,
        visibility_polygon: Callable[[np.ndarray], np.ndarray],
        pursuit_field: PursuitField,
        radii: np.ndarray,
        losing_set: LosingSet | None = None,
        certificate: str | None = None,
    ) -> None:
        self._stage = stage
        self._radii = radii
        set_camera(stage.meshcat, layout)
        draw_world(stage, layout, world, grown)
        self._pursuers = Team(stage, layout, "pursuers", pursuers)
        self._evaders = Team(stage, layout, "evaders", evaders)
        self._pursuer_trails = Trails(stage, layout, "pursuers", PURSUER)
        self._evader_trails = Trails(stage, layout, "evaders", EVADER)
        self._lines = SightLines(stage, layout)
        self._polygon = VisibilityLayer(stage, layout, visibility_polygon)
        self._losing = None if losing_set is None else LosingLayer(stage, layout, losing_set)
        self._field = FieldLayer(stage, layout, grown, pursuit_field)
        self._panel = Panel(
            stage, layout, pursuers=pursuers, evaders=evaders, certificate=certificate
        )

    def draw(self, now: Snapshot, view: View) -> None:
        """Draw the game as it is now, from the view that was chosen."""
        chosen = view.chosen_pursuer if 0 <= view.chosen_pursuer < len(now.pursuers) else None
        unseen = np.logical_not(np.any(now.visibility, axis=0, keepdims=True))[0]

        self._stage.begin(now.time)
        self._pursuers.move(now.pursuers, now.pursuer_directions)
        self._evaders.move(now.evaders, now.evader_directions)
        self._pursuers.mark_chosen(chosen)
        self._evaders.mark_unseen(unseen)
        self._pursuer_trails.update(now.time, now.pursuers)
        self._evader_trails.update(now.time, now.evaders)
        self._lines.update(now.pursuers, now.evaders, now.visibility, now.assignment)
        centres = np.concatenate([now.pursuers, now.evaders])
        gap = float(pair_gaps(centres, self._radii).min())
        self._panel.update(now.time, now.visibility, now.assignment, gap, now.certificate)

        looking = None if chosen is None or not view.polygon_shown else now.pursuers[chosen]
        self._polygon.update(now.time, looking)
        if self._losing is not None:
            losing = None if chosen is None or not view.losing_shown else now.pursuers[chosen]
            self._losing.update(now.time, losing)
        steering = chosen if view.field_shown else None
        self._field.update(now.time, steering, now.pursuers, now.evaders, now.assignment)

    def finish_recording(self) -> None:
        """End the recording with what was drawn last."""
        self._stage.finish_recording()


class TrackingScene(LeafSystem):
    """Draws pursuers, evaders, sights, chases and fields over a world at each publish event.

    .. pydrake_system::

        name: TrackingScene
        input_ports:
        - pursuer_position
        - evader_position
        - pursuer_direction
        - evader_direction
        - visibility
        - assignment
        output_ports: []

    =================  =====  ====  =====
    port               size   unit  frame
    =================  =====  ====  =====
    pursuer_position   2 Np   m     world
    evader_position    2 Ne   m     world
    pursuer_direction  2 Np   -     world
    evader_direction   2 Ne   -     world
    visibility         Np Ne  -     -
    assignment         Np     -     -
    =================  =====  ====  =====

    Positions and directions are x0, y0, x1, y1, ...; a direction of any length, and zero leaves
    the heading that was drawn. Visibility is 1 where a pursuer sees an evader, else 0, row-major
    by pursuer. An assignment is an evader's number, or -1. With a word for the certificate there is
    also an input `certificate` (1): for how long all evaders can be kept [s], infinite if for ever.
    The system has no state; it remembers only what Meshcat was told last.

    Source: Zhang 2014, section 2.2.8 and Figure 2.24.
    """

    def __init__(
        self,
        world: World,
        grown: Sequence[World],
        meshcat: Meshcat,
        *,
        pursuers: int,
        evaders: int,
        robot_radius: float,
        evader_radius: float | None = None,
        publish_period: float,
        visibility_polygon: Callable[[np.ndarray], np.ndarray],
        pursuit_field: PursuitField,
        losing_set: LosingSet | None = None,
        certificate: str | None = None,
        recording: bool,
        view: Callable[[], View] = View,
    ) -> None:
        """Draw the still parts; the rest follows at each publish event.

        Args:
            world: The free region.
            grown: The free region shrunk by the robots' radius, in one or more pieces.
            meshcat: Where to draw; its folder "/tracking" and its camera are taken.
            pursuers: Number Np of pursuers.
            evaders: Number Ne of evaders.
            robot_radius: Radius of a robot [m]; one too small to see is drawn larger.
            evader_radius: Of an evader, for the gaps between bodies; None: as of all [m].
            publish_period: Time between pictures [s].
            visibility_polygon: Maps a point, shape (2,) [m], to what it sees, shape (n, 2) [m].
            pursuit_field: Maps (pursuer, points (m, 2) [m], evaders (Ne, 2) [m],
                assignment (Np,)) to the pursuer's directions there, shape (m, 2).
            losing_set: Maps a pursuer's place, shape (2,) [m], to the strips in its sight where
                an evader is lost, and the times; None draws none.
            certificate: What the panel calls the input `certificate`; None for no such input.
            recording: Record the run from its start, for `write_replay`. Its size grows with
                time, so an endless session is better drawn without.
            view: Called at each publish event; says whose view to show.

        Raises:
            InvalidInput: A number is not positive.
        """
        super().__init__()
        require(pursuers > 0, "pursuers", "be at least 1", pursuers)
        require(evaders > 0, "evaders", "be at least 1", evaders)
        require_positive("robot_radius", robot_radius)
        require_positive("publish_period", publish_period)
        self.meshcat = meshcat
        self._evader_count = evaders
        self.recording = recording
        self._view = view
        layout = make_layout(world.bounds, robot_radius)
        each = (robot_radius, robot_radius if evader_radius is None else evader_radius)
        radii = np.repeat(each, (pursuers, evaders))

        def make_layers() -> Layers:
            return Layers(
                Stage(
                    meshcat,
                    ROOT,
                    recording=recording,
                    period=publish_period,
                    tolerance=_TOLERANCE * layout.span,
                ),
                layout,
                world,
                grown,
                pursuers=pursuers,
                evaders=evaders,
                visibility_polygon=visibility_polygon,
                pursuit_field=pursuit_field,
                radii=radii,
                losing_set=losing_set,
                certificate=certificate,
            )

        self._make_layers = make_layers
        self._layers = make_layers()
        self._drawn = False
        for name, size in (
            ("pursuer_position", 2 * pursuers),
            ("evader_position", 2 * evaders),
            ("pursuer_direction", 2 * pursuers),
            ("evader_direction", 2 * evaders),
            ("visibility", pursuers * evaders),
            ("assignment", pursuers),
            *((("certificate", 1),) if certificate is not None else ()),
        ):
            self.DeclareVectorInputPort(name, size)
        self.DeclareInitializationPublishEvent(self._begin)
        self.DeclarePeriodicPublishEvent(publish_period, 0.0, self._publish)
        self.DeclareForcedPublishEvent(self._publish)

    def get_pursuer_position_input_port(self) -> InputPort:
        """Positions of the pursuers."""
        return self.GetInputPort("pursuer_position")

    def get_evader_position_input_port(self) -> InputPort:
        """Positions of the evaders."""
        return self.GetInputPort("evader_position")

    def get_pursuer_direction_input_port(self) -> InputPort:
        """Vectors along the pursuers' headings."""
        return self.GetInputPort("pursuer_direction")

    def get_evader_direction_input_port(self) -> InputPort:
        """Vectors along the evaders' headings."""
        return self.GetInputPort("evader_direction")

    def get_visibility_input_port(self) -> InputPort:
        """Which pursuer sees which evader."""
        return self.GetInputPort("visibility")

    def get_assignment_input_port(self) -> InputPort:
        """Which pursuer chases which evader."""
        return self.GetInputPort("assignment")

    def finish_recording(self) -> None:
        """End the recording with the last picture, so that a replay can be written.

        Raises:
            InvalidInput: The scene was made without `recording`.
        """
        self._layers.finish_recording()

    def _begin(self, context: Context) -> EventStatus:
        """Start from a clean sheet when a diagram is run again."""
        if self._drawn:
            self._layers = self._make_layers()
            self._drawn = False
        return EventStatus.Succeeded()

    def _publish(self, context: Context) -> EventStatus:
        def rows(name: str, columns: int = 2) -> np.ndarray:
            return read(self.GetInputPort(name), context).reshape(-1, columns)

        time = context.get_time()
        self._layers.draw(
            Snapshot(
                time=time,
                pursuers=rows("pursuer_position"),
                evaders=rows("evader_position"),
                pursuer_directions=rows("pursuer_direction"),
                evader_directions=rows("evader_direction"),
                visibility=rows("visibility", self._evader_count) > 0.5,
                assignment=np.rint(rows("assignment", 1)[:, 0]).astype(int),
                certificate=(
                    float(rows("certificate", 1)[0, 0])
                    if self.HasInputPort("certificate")
                    else None
                ),
            ),
            self._view(),
        )
        self._drawn = True
        self.meshcat.SetSimulationTime(time)
        return EventStatus.Succeeded()
