"""Figure 2.24 in Meshcat: the mini-map with robots, sight lines and chases.

The scene is meshcat-python's, drawn from inside its server's process.
"""

import math
from typing import Any

import numpy as np
import shapely
import umsgpack
from meshcat.commands import Delete, SetObject, SetProperty, SetTransform
from meshcat.geometry import MeshBasicMaterial, MeshLambertMaterial, TriangularMeshGeometry
from meshcat.path import Path
from meshcat.servers.tree import SceneTree
from meshcat.servers.zmqserver import ZMQWebSocketBridge

from ...diagrams.visuals.meshes import (
    Mesh,
    bar_mesh,
    extruded_mesh,
    flat_mesh,
    line_mesh,
    nose_mesh,
)
from ...diagrams.visuals.text import text_mesh
from .messages import Scene, State


class _Nobody:
    """Takes the answers that the server would send to another process."""

    def send(self, data: bytes) -> None:
        """Drop one."""


class SceneStore(ZMQWebSocketBridge):
    """Meshcat's own server, without the socket by which other processes draw.

    It keeps the scene and sends it to every page that connects.
    """

    def __init__(self) -> None:
        # The base's constructor is not called: it would open ports.
        self.websocket_pool: set[Any] = set()
        self.tree = SceneTree()
        self.zmq_socket = _Nobody()

    def set_object(self, path: str, geometry: Any, material: Any = None) -> None:
        """Draw something at a path, in place of what was there.

        Args:
            path: Where.
            geometry: Its shape.
            material: Its looks.
        """
        self._send(SetObject(geometry, material, _path_of(path)))

    def set_transform(self, path: str, matrix: Any) -> None:
        """Move what is at a path; `matrix` has shape (4, 4)."""
        self._send(SetTransform(matrix, _path_of(path)))

    def set_property(self, path: str, key: str, value: Any) -> None:
        """Set a property of what is at a path.

        Args:
            path: Of what.
            key: Name of the property.
            value: Its value.
        """
        self._send(SetProperty(key, value, _path_of(path)))

    def delete(self, path: str) -> None:
        """Take away what is at a path, and below it."""
        self._send(Delete(_path_of(path)))

    def _send(self, command: Any) -> None:
        lowered = command.lower()
        frames = [lowered["type"].encode(), lowered["path"].encode(), umsgpack.packb(lowered)]
        self.handle_zmq(frames)


def _path_of(path: str) -> Path:
    """An absolute path as meshcat has it."""
    parts = tuple(part for part in path.split("/") if part)
    return Path(parts)


# The thesis's colours: black sight lines, purple chases, green obstacles, orange limits.
FLOOR, OBSTACLE, LIMIT = 0xFBFBFA, 0x4CA85E, 0xF28C21
PURSUER, EVADER, UNSEEN = 0x215FCC, 0xD92E33, 0x9AA1AB
# A robot's nose is darker than its body.
NOSES = {PURSUER: 0x0F3380, EVADER: 0x850F17, UNSEEN: 0x6B727C}
SIGHT, CHASE, NUMBER = 0x0F0F14, 0x9438D6, 0xFFFFFF

_OBSTACLE_HEIGHT, _ROBOT_HEIGHT = 0.12, 0.18
_LINE, _BAND, _BAR = 0.012, 0.016, 0.034


class Drawing:
    """Draws scenes and states of runs into a store.

    Args:
        store: Of the pages that watch.
    """

    def __init__(self, store: SceneStore) -> None:
        self._store = store
        self._colours: list[int] = []
        for helper in ("/Grid", "/Axes"):
            store.set_property(helper, "visible", False)
        for end in ("top_color", "bottom_color"):
            store.set_property("/Background", end, [0.914, 0.925, 0.941])

    def scene(self, scene: Scene) -> None:
        """Draw another run's world, in place of what was there."""
        store = self._store
        store.delete("/laboratory")
        self._colours = []
        floor = shapely.Polygon(scene.boundary)
        self._put("/laboratory/floor", flat_mesh(floor), MeshBasicMaterial(color=FLOOR))
        if scene.obstacles:
            blocks = shapely.MultiPolygon([shapely.Polygon(ring) for ring in scene.obstacles])
            mesh = extruded_mesh(blocks, 0.0, _OBSTACLE_HEIGHT)
            self._put("/laboratory/obstacles", mesh, _solid(OBSTACLE))
        limits = [np.asarray(ring) for ring in scene.limits]
        self._put("/laboratory/limits", line_mesh(limits, _BAND), MeshBasicMaterial(color=LIMIT))
        store.set_transform("/laboratory/limits", _at(0.0, 0.0, 0.004))
        west, south, east, north = floor.bounds
        # The camera looks at the origin: the laboratory's middle goes there.
        middle = _at(-(west + east) / 2, -(south + north) / 2, 0.0)
        store.set_transform("/laboratory", middle)
        size = max(east - west, north - south)
        # x east, height, y south.
        eye = [0.0, 0.72 * size, 0.22 * size]
        store.set_property("/Cameras/default/rotated/<object>", "position", eye)

    def state(self, scene: Scene, state: State, *, stale: bool) -> None:
        """Draw the state of a run; robots that are not seen, or all if stale, in grey."""
        pursuers = len(scene.pursuers)
        teams = [PURSUER if k < pursuers else EVADER for k in range(len(state.poses))]
        colours = [
            colour if valid and not stale else UNSEEN
            for colour, valid in zip(teams, state.valid, strict=True)
        ]
        for k, (x, y, heading) in enumerate(state.poses):
            path = f"/laboratory/robots/{k}"
            if self._colours[k : k + 1] != [colours[k]]:
                body, nose = _robot(scene.radius)
                self._put(f"{path}/body", body, _solid(colours[k]))
                self._put(f"{path}/nose", nose, _solid(NOSES[colours[k]]))
                number = text_mesh(
                    str(k if k < pursuers else k - pursuers),
                    0.85 * scene.radius,
                    bold=True,
                    align="centre",
                )
                self._put(f"/laboratory/numbers/{k}", number, MeshBasicMaterial(color=NUMBER))
            self._store.set_transform(path, _at(x, y, 0.0, heading))
            self._store.set_transform(f"/laboratory/numbers/{k}", _at(x, y, _ROBOT_HEIGHT + 0.01))
        self._colours = colours
        points = np.array(state.poses)[:, :2]
        seen = [(i, pursuers + j) for i, row in enumerate(state.sight) for j in np.flatnonzero(row)]
        chased = [(i, pursuers + j) for i, j in enumerate(state.assignment) if j >= 0]
        self._lines("/laboratory/chases", points, chased, _BAR, 0.06, CHASE)
        self._lines("/laboratory/sight", points, seen, _LINE, 0.07, SIGHT)

    def _lines(self, path, points, pairs, width, height, colour) -> None:
        if not pairs:
            self._store.delete(path)
            return
        ends = points[np.array(pairs)]
        mesh = bar_mesh(ends[:, 0], ends[:, 1], width)
        self._put(path, mesh, MeshBasicMaterial(color=colour))
        self._store.set_transform(path, _at(0.0, 0.0, height))

    def _put(self, path: str, mesh: Mesh, material: MeshBasicMaterial | MeshLambertMaterial):
        geometry = TriangularMeshGeometry(
            mesh.vertices.T.astype(np.float32), mesh.faces.T.astype(np.uint32)
        )
        self._store.set_object(path, geometry, material)


def _robot(radius: float) -> tuple[Mesh, Mesh]:
    """A robot at the origin that looks east: its body, and its nose."""
    body = extruded_mesh(shapely.Point(0, 0).buffer(radius), 0.0, _ROBOT_HEIGHT)
    return body, nose_mesh(radius, 1.01 * _ROBOT_HEIGHT)


def _solid(colour: int) -> MeshLambertMaterial:
    return MeshLambertMaterial(color=colour)


def _at(x: float, y: float, z: float, heading: float = 0.0) -> np.ndarray:
    """A pose in space, shape (4, 4)."""
    c, s = math.cos(heading), math.sin(heading)
    return np.array([[c, -s, 0, x], [s, c, 0, y], [0, 0, 1, z], [0, 0, 0, 1]], dtype=float)
