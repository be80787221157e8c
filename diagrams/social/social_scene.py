"""The search in Meshcat, as a system that draws what its input ports say."""

from typing import Any

import numpy as np
from pydrake.geometry import Meshcat
from pydrake.systems.framework import Context, EventStatus, LeafSystem

from ...systems.drake_parts import AbstractValue, read
from ...systems.numerics.social.network.interface import Picture
from ..tracking.scene.floor_layers import draw_world
from ..tracking.scene.layout import Layout, make_layout, set_camera
from ..visuals.meshes import extruded_mesh
from ..visuals.stage import Stage
from .crowd_layer import LANDMARK, Crowd, SearchLayer, landmark_bar
from .gallery import Gallery, draw_reading, picture_pixels
from .panel import Panel
from .social_game import SocialGame

# Where everything is, in Meshcat's tree.
ROOT = "/social"
# How far a replay may pass from where things were, relative to the view.
_TOLERANCE = 5e-5


class SocialScene(LeafSystem):
    """Draws maze, robots, views, the friend graph, the newest pictures and the pursuer's belief.

    .. pydrake_system::

        name: SocialScene
        input_ports:
        - pose
        - connected
        - waiting
        - requests_sent
        - pictures_scanned
        - locations
        - evader_position
        - evader_covariance
        - located_at
        - route
        - posted
        - readings
        output_ports: []

    =================  ===========================  =========  =====
    port               size                         unit       frame
    =================  ===========================  =========  =====
    pose               3 N                          m, m, rad  world
    connected          n                            -          -
    waiting            n                            -          -
    requests_sent      1                            -          -
    pictures_scanned   1                            -          -
    locations          1                            -          -
    evader_position    2                            m          world
    evader_covariance  4                            m^2        world
    located_at         1                            s          -
    route              2 K                          m          world
    posted             abstract: tuple of Picture   -          -
    readings           abstract: tuple of Reading   -          -
    =================  ===========================  =========  =====

    `posted` are the newest pictures of all agents; `readings` those that the pursuer has read last.
    The pictures stand right of the map, where Meshcat's own controls unfold. The system has no
    state; it remembers only what Meshcat was told last.

    Source: Zhang 2014, Figures 2.30 and 2.33.
    """

    def __init__(
        self,
        game: SocialGame,
        meshcat: Meshcat,
        *,
        route_size: int,
        publish_period: float,
        recording: bool,
    ) -> None:
        """Draw what does not move; the rest follows at each publish event.

        Args:
            game: Whose maze and robots.
            meshcat: Where to draw.
            route_size: Of the port `route`.
            publish_period: Time between pictures of the map [s].
            recording: Record what is drawn, for `write_replay`.
        """
        super().__init__()
        self._game, self.meshcat = game, meshcat
        self._period, self.recording = publish_period, recording
        agents = self._agents = game.scenario.agents.size
        for name, size in (
            ("pose", 3 * game.robots),
            ("connected", agents),
            ("waiting", agents),
            ("requests_sent", 1),
            ("pictures_scanned", 1),
            ("locations", 1),
            ("evader_position", 2),
            ("evader_covariance", 4),
            ("located_at", 1),
            ("route", route_size),
        ):
            self.DeclareVectorInputPort(name, size)
        for name in ("posted", "readings"):
            self.DeclareAbstractInputPort(name, AbstractValue.Make(()))
        self._begin()
        self.DeclareInitializationPublishEvent(lambda context: self._restart())
        self.DeclarePeriodicPublishEvent(publish_period, 0.0, self._publish)
        self.DeclareForcedPublishEvent(self._publish)

    def finish_recording(self) -> None:
        """End the recording with the last picture, so that a replay can be written.

        Raises:
            InvalidInput: The scene was made without `recording`.
        """
        self._stage.finish_recording()

    def _restart(self) -> EventStatus:
        if self._drawn:
            self._begin()
        return EventStatus.Succeeded()

    def _begin(self) -> None:
        """Draw what does not move, on a clean sheet."""
        self._drawn = False
        self._shown: dict[int, tuple[str, str]] = {}
        maze = self._game.maze
        layout = make_layout(maze.world.bounds, maze.robot_radius)
        self._stage = stage = Stage(
            self.meshcat,
            ROOT,
            recording=self.recording,
            period=self._period,
            tolerance=_TOLERANCE * layout.span,
        )
        set_camera(self.meshcat, layout)
        draw_world(stage, layout, maze.world, self._game.regions)
        _draw_landmarks(stage, layout, self._game)
        self._crowd = Crowd(stage, layout, maze, self._agents)
        self._search = SearchLayer(stage, layout, maze.world.polygon)
        self._panel = Panel(stage, layout, self._agents)
        proportion = maze.camera.height / maze.camera.width
        self._gallery = Gallery(stage, layout, self._agents, proportion)

    def _publish(self, context: Context) -> EventStatus:
        def value(name: str) -> np.ndarray:
            return read(self.GetInputPort(name), context)

        time = context.get_time()
        self._stage.begin(time)
        self._crowd.move(time, value("pose").reshape(-1, 3))
        located_at = float(value("located_at")[0])
        located = located_at >= 0.0
        covariance = value("evader_covariance").reshape(2, 2)
        deviation = float(np.sqrt(np.trace(covariance))) if located else np.inf
        route = value("route").reshape(-1, 2)
        self._search.update(time, located, value("evader_position"), covariance, route)
        counts = {
            "requests": float(value("requests_sent")[0]),
            "pictures": float(value("pictures_scanned")[0]),
            "locations": float(value("locations")[0]),
            "age": max(time - located_at, 0.0),
            "doubt": 100.0 * deviation,
        }
        connected, waiting = value("connected") > 0.5, value("waiting") > 0.5
        self._panel.update(time, counts, located, connected, waiting)
        self._show_pictures(context)
        self._drawn = True
        self.meshcat.SetSimulationTime(time)
        return EventStatus.Succeeded()

    def _show_pictures(self, context: Context) -> None:
        """Show each agent's newest picture, with its matches as soon as it has been read."""
        posted: Any = self.GetInputPort("posted").Eval(context)
        readings: Any = self.GetInputPort("readings").Eval(context)
        camera = self._game.maze.camera
        for picture in posted:
            # A picture that has been read stays until there is a newer one.
            if self._shown.get(picture.agent, ("", ""))[0] != picture.id:
                self._show(picture, picture_pixels(picture, camera), "unread")
        for reading in readings:
            picture = reading.picture
            # Of a picture that is not the newest any more nothing is shown.
            if self._shown.get(picture.agent) == (picture.id, "unread"):
                self._show(picture, draw_reading(reading, camera), "read")

    def _show(self, picture: Picture, image: np.ndarray, state: str) -> None:
        self._gallery.show(picture.agent, image, state)
        self._shown[picture.agent] = (picture.id, state)


def _draw_landmarks(stage: Stage, layout: Layout, game: SocialGame) -> None:
    top = 1.1 * layout.obstacle_height
    for each in game.maze.landmarks:
        bar = landmark_bar(each.x, each.y, each.facing, each.side, 0.9 * layout.wall)
        stage.mesh(f"landmarks/{each.number}", extruded_mesh(bar, 0.0, top), LANDMARK)
