"""The robots: the pursuer, the evader, and the common agents with what their cameras see."""

import math

import numpy as np
import shapely
from pydrake.geometry import Rgba
from shapely.geometry.base import BaseGeometry

from ....systems.numerics.geometry.edge_index import build_edge_index
from ....systems.numerics.geometry.visibility_polygon import visibility_polygon
from ....systems.numerics.social.landmarks.maze import Maze
from ...tracking.scene.layout import EVADER, PAPER, PURSUER, Layout
from ...visuals.keyframes import Keyframes
from ...visuals.meshes import extruded_mesh, flat_mesh
from ...visuals.stage import Stage
from ...visuals.text import text_mesh
from .palette import agent_paint

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
