"""The robots of a search on the map, and what the pursuer knows there.

The robots are the pursuer, the evader, and the common agents with what their cameras see; what is
known is where the pursuer puts the evader, how surely, and its route. Colours are the tracking
scene's, and one for each common agent.
"""

import math

import numpy as np
import shapely
import shapely.affinity
from pydrake.geometry import Rgba
from shapely.geometry.base import BaseGeometry

from ...systems.numerics.geometry.edge_index import build_edge_index
from ...systems.numerics.geometry.visibility_polygon import visibility_polygon
from ...systems.numerics.social.landmarks.maze import Maze
from ..tracking.scene.layout import EVADER, PAPER, PURSUER, Layout
from ..visuals.lighting import paint
from ..visuals.meshes import bar_mesh, disc_mesh, extruded_mesh, flat_mesh, merged
from ..visuals.stage import Keyframes, Stage
from ..visuals.text import text_mesh

_AGENTS = (
    (0.93, 0.55, 0.10),
    (0.13, 0.60, 0.38),
    (0.56, 0.28, 0.74),
    (0.10, 0.58, 0.66),
    (0.72, 0.50, 0.22),
    (0.82, 0.30, 0.58),
)
LANDMARK = paint(0.20, 0.22, 0.26)
ROUTE = paint(0.13, 0.37, 0.80, 0.85)
ESTIMATE = paint(0.85, 0.18, 0.20)
UNCERTAINTY = paint(0.95, 0.45, 0.45, 0.30)
FRIEND = paint(0.16, 0.60, 0.30)
STRANGER = paint(0.84, 0.86, 0.88)


def agent_rgb(agent: int) -> tuple[float, float, float]:
    """An agent's colour on the screen: red, green, blue from 0 to 1."""
    return _AGENTS[agent % len(_AGENTS)]


def agent_paint(agent: int, opacity: float = 1.0) -> Rgba:
    """The paint that shows as an agent's colour.

    Args:
        agent: Its number.
        opacity: From 0 to 1.
    """
    return paint(*agent_rgb(agent), opacity)


# How often fields of view are drawn afresh [s], and how far they are drawn [m].
_VIEW_PERIOD, _VIEW_REACH = 0.25, 1.6
_NOSE_TIP = 1.5


class Crowd:
    """Draws robot k at `robots/k`, its `body` turned along its heading, and agents' views."""

    def __init__(self, stage: Stage, layout: Layout, maze: Maze, agents: int) -> None:
        self._stage, self._maze = stage, maze
        self._index = build_edge_index(maze.world)
        radius, top = maze.robot_radius, layout.robot_height
        self._reach = _NOSE_TIP * radius
        bodies = [("P", PURSUER), ("E", EVADER)]
        bodies += [(str(k + 1), agent_paint(k)) for k in range(agents)]
        body = extruded_mesh(_outline(radius), 0.0, top)
        for k, (name, colour) in enumerate(bodies):
            stage.mesh(f"robots/{k}/body/disc", body, colour)
            stage.raise_to(f"robots/{k}/label", 1.02 * top)
            label = text_mesh(name, 0.95 * radius, bold=True, align="centre")
            stage.mesh(f"robots/{k}/label", label, PAPER)
        step = (layout.level("trails") - layout.level("field")) / (agents + 1)
        for k in range(agents):
            # Each at a height of its own, or two views would flicker where they overlap.
            stage.raise_to(f"views/{k}", layout.level("field") + k * step)
        self._views = [
            Keyframes(stage, f"views/{k}", _glass(k), period=_VIEW_PERIOD) for k in range(agents)
        ]

    def move(self, time: float, poses: np.ndarray) -> None:
        """Show where all robots are at a time.

        Args:
            time: [s].
            poses: Shape (2 + agents, 3) [m], [m], [rad].
        """
        for k, (x, y, heading) in enumerate(poses.tolist()):
            self._stage.place(f"robots/{k}", x, y)
            self._stage.pose(f"robots/{k}/body", 0.0, 0.0, heading, reach=self._reach)
        for view, pose in zip(self._views, poses[2:], strict=True):
            if view.due(time):
                seen = self.view_of(pose)
                if not seen.is_empty:
                    view.draw(flat_mesh(seen))

    def view_of(self, pose: np.ndarray) -> BaseGeometry:
        """What of the floor a camera at a pose sees past the walls, up to a reach.

        Args:
            pose: x, y [m], heading [rad], shape (3,).
        """
        x, y, heading = pose
        half = 0.5 * self._maze.camera.field_of_view
        angles = heading + np.linspace(-half, half, 13)
        rim = np.column_stack([x + _VIEW_REACH * np.cos(angles), y + _VIEW_REACH * np.sin(angles)])
        cone = shapely.Polygon([(x, y), *rim])
        seen = shapely.Polygon(visibility_polygon(self._index, pose[:2])).buffer(0)
        parts = shapely.get_parts(seen.intersection(cone))
        return shapely.MultiPolygon([each for each in parts if each.geom_type == "Polygon"])


def _outline(radius: float) -> BaseGeometry:
    """A disc with a nose along the x axis."""
    nose = shapely.Polygon(radius * np.array([[0.3, -0.92], [_NOSE_TIP, 0.0], [0.3, 0.92]]))
    return shapely.Point(0, 0).buffer(radius, quad_segs=12).union(nose)


def _glass(agent: int) -> Rgba:
    return agent_paint(agent, 0.20)


def landmark_bar(x: float, y: float, facing: float, side: float, depth: float) -> shapely.Polygon:
    """A landmark from above: a bar in the wall that it hangs on.

    Args:
        x, y: Its middle [m].
        facing: Direction of its front [rad].
        side: Its width [m].
        depth: How far it reaches into the wall [m].
    """
    along = np.array([-math.sin(facing), math.cos(facing)])
    into = -np.array([math.cos(facing), math.sin(facing)])
    middle = np.array([x, y])
    ends = [middle - 0.5 * side * along, middle + 0.5 * side * along]
    return shapely.Polygon([*ends, ends[1] + depth * into, ends[0] + depth * into])


# How often the route and the ellipse are drawn afresh [s].
_PERIOD = 0.25
# The ellipse holds the evader with 95 % probability, if the errors are Gaussian.
_CHI = np.sqrt(5.991)
# No larger one is drawn [m].
_LARGEST = 3.0


class SearchLayer:
    """Draws the estimate at `estimate/at`, its ellipse at `doubt`, the route at `route`."""

    def __init__(self, stage: Stage, layout: Layout, free: BaseGeometry) -> None:
        self._stage, self._free = stage, free
        self._line = layout.line
        radius = layout.robot_radius
        stage.raise_to("doubt", layout.level("polygon"))
        stage.raise_to("route", layout.level("ink"))
        stage.raise_to("estimate", 1.2 * layout.robot_height + layout.level("chases"))
        stage.mesh("estimate/at/ring", disc_mesh(1.35 * radius, hole=1.15 * radius), ESTIMATE)
        arms = np.array([[-1.35, 0], [1.35, 0], [0, -1.35], [0, 1.35]]) * radius
        gaps = np.array([[-0.9, 0], [0.9, 0], [0, -0.9], [0, 0.9]]) * radius
        stage.mesh("estimate/at/arms", bar_mesh(arms, gaps, 0.12 * radius), ESTIMATE)
        stage.show("estimate", False)
        self._doubt = Keyframes(stage, "doubt", UNCERTAINTY, period=_PERIOD)
        self._route = Keyframes(stage, "route", ROUTE, period=_PERIOD)

    def update(
        self,
        time: float,
        located: bool,
        evader: np.ndarray,
        covariance: np.ndarray,
        route: np.ndarray,
    ) -> None:
        """Show where the evader may be now.

        Args:
            time: Now [s].
            located: Whether it was ever located.
            evader: Its estimated position, shape (2,) [m].
            covariance: Of it now, shape (2, 2) [m^2].
            route: Corners still to be passed, shape (m, 2) [m].
        """
        self._stage.show("estimate", located)
        if not located:
            return
        self._stage.place("estimate/at", *evader.tolist())
        if self._doubt.due(time):
            area = ellipse(evader, covariance).intersection(self._free)
            parts = [each for each in shapely.get_parts(area) if each.geom_type == "Polygon"]
            if parts:
                self._doubt.draw(flat_mesh(shapely.MultiPolygon(parts)))
            else:
                self._doubt.clear()
        if self._route.due(time):
            start, end = route[:-1], route[1:]
            long = np.hypot(*(end - start).T) > 1e-9
            if long.any():
                width = 2.2 * self._line
                bars = bar_mesh(start[long], end[long], width)
                self._route.draw(merged([bars, *_dots(end[long], 1.4 * width)]))
            else:
                self._route.clear()


def ellipse(middle: np.ndarray, covariance: np.ndarray) -> BaseGeometry:
    """Where something is with 95 % probability, given its mean (2,) [m] and covariance (2, 2).

    Args:
        middle: The mean, shape (2,) [m].
        covariance: Shape (2, 2) [m^2].
    """
    values, axes = np.linalg.eigh(covariance)
    half = np.minimum(_CHI * np.sqrt(np.maximum(values, 1e-8)), _LARGEST)
    circle = shapely.Point(0, 0).buffer(1.0, quad_segs=12)
    (a, b), (c, d) = axes * half
    return shapely.affinity.affine_transform(circle, [a, b, c, d, *middle.tolist()])


def _dots(points: np.ndarray, radius: float):
    return [
        flat_mesh(shapely.Point(*point).buffer(radius, quad_segs=3)) for point in points.tolist()
    ]
