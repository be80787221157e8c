"""Pictures of a maze from any pose in it, by Drake's RgbdSensor and RenderEngineVtk."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from pydrake.common import MemoryFile
from pydrake.geometry import (
    Box,
    ClippingRange,
    ColorRenderCamera,
    Cylinder,
    DepthRange,
    DepthRenderCamera,
    FrameId,
    FramePoseVector,
    GeometryFrame,
    GeometryInstance,
    InMemoryMesh,
    LightParameter,
    MakeRenderEngineVtk,
    Mesh,
    PerceptionProperties,
    RenderCameraCore,
    RenderEngine,
    RenderEngineVtkParams,
    Rgba,
    SceneGraph,
    Shape,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.sensors import CameraInfo, RgbdSensor

from ..drake_parts import AbstractValue
from ..numerics.errors import SightfieldError, require
from ..numerics.social.landmarks.landmark_pictures import landmark_picture, marker_picture
from ..numerics.social.landmarks.maze import Maze, picture_mtl, picture_obj, walls_obj

# Colours of things without a picture.
_WALL, _BODY, _MAST = Rgba(0.72, 0.7, 0.66), Rgba(0.2, 0.22, 0.26), Rgba(0.1, 0.1, 0.1)
_TILES, _TILE_PIXELS, _TILE_TONES = 8, 32, (120, 140)
# Direction in which each light shines, and its strength: together they hardly reach white.
_LIGHTS = (((1.0, 0.6, -0.9), 0.35), ((-0.7, -1.0, -0.9), 0.3), ((0.2, -0.3, -1.0), 0.2))
_HEADLAMP = 0.65
# Only things between these distances are drawn [m].
_NEAREST, _FARTHEST = 0.02, 100.0
# A photograph's pixels are means over their area: rendered rows and columns for each of its own.
_OVERSAMPLING = 2
# Absent robots are placed below the floor.
_NOWHERE = RigidTransform([0.0, 0.0, -50.0])  # pyright: ignore[reportArgumentType, reportCallIssue]  # stubs want a shape


@dataclass(frozen=True, eq=False)
class Poster:
    """A picture that hangs somewhere.

    Attributes:
        picture: Red, green, blue, shape (h, w, 3), uint8.
        corners: Of its top left, top right, bottom right, bottom left; shape (4, 3) [m].
    """

    picture: np.ndarray
    corners: np.ndarray


def posters_of(maze: Maze) -> tuple[Poster, ...]:
    """The maze's landmarks as they hang."""
    return tuple(Poster(landmark_picture(each.number), each.corners) for each in maze.landmarks)


class MazeRenderer:
    """Draws what each common agent's camera sees of the maze and of the other robots.

    Args:
        maze: Walls, cameras, the evader's marker.
        common_agents: Number of common agents.
        posters: Pictures on the walls; by default the maze's landmarks.

    Raises:
        InvalidInput: There are no common agents.
        SightfieldError: The system lacks the graphics library.
    """

    def __init__(
        self, maze: Maze, *, common_agents: int = 1, posters: Sequence[Poster] | None = None
    ) -> None:
        require(common_agents >= 1, "common_agents", "be at least 1", common_agents)
        self._maze, self._agents = maze, common_agents
        self._scene = SceneGraph()
        self._scene.AddRenderer("vtk", _make_engine())
        self._source = self._scene.RegisterSource("maze")
        world = Mesh(InMemoryMesh(mesh_file=_file(walls_obj(maze.world, maze.wall_height), ".obj")))
        self._add(world, _WALL)
        for poster in (_floor(maze), *(posters_of(maze) if posters is None else posters)):
            self._add(_picture_mesh(poster))
        names = [*(f"common_agent_{k}" for k in range(common_agents)), "evader", "pursuer"]
        self._frames = [self._add_robot(name) for name in names]
        builder = DiagramBuilder()
        builder.AddNamedSystem("scene", self._scene)
        self._camera = _camera(maze, self._scene)
        builder.AddNamedSystem("camera", self._camera)
        builder.Connect(self._scene.get_query_output_port(), self._camera.query_object_input_port())
        self._diagram = builder.Build()
        self._context = self._diagram.CreateDefaultContext()

    def render(
        self,
        viewer: int,
        common_agents: np.ndarray,
        evader: np.ndarray | None = None,
        pursuer: np.ndarray | None = None,
    ) -> np.ndarray:
        """What one common agent sees.

        Args:
            viewer: Its number.
            common_agents: Poses: x, y [m], heading [rad], shape (common agents, 3).
            evader, pursuer: The same, shape (3,); None if there is none.

        Returns:
            Red, green, blue without noise, shape (height, width, 3), uint8.

        Raises:
            InvalidInput: There is no such agent, or not a pose for each.
        """
        require(0 <= viewer < self._agents, "viewer", f"be below {self._agents}", viewer)
        shape = np.shape(common_agents)
        require(shape == (self._agents, 3), "common_agents", f"be {self._agents} x 3", shape)
        poses = FramePoseVector()
        for frame, pose in zip(self._frames, [*common_agents, evader, pursuer], strict=True):
            poses.set_value(frame, _NOWHERE if pose is None else _standing(pose, 0.0))
        root = self._context
        self._scene.get_source_pose_port(self._source).FixValue(
            self._scene.GetMyMutableContextFromRoot(root), AbstractValue.Make(poses)
        )
        context = self._camera.GetMyMutableContextFromRoot(root)
        height = self._maze.camera.lens_height
        turned = RigidTransform(RotationMatrix(_LOOKING_AHEAD), np.zeros(3))  # pyright: ignore[reportArgumentType, reportCallIssue]  # stubs want a shape
        self._camera.SetX_PB(context, _standing(common_agents[viewer], height) @ turned)
        image = self._camera.color_image_output_port().Eval(context)
        # The stubs say object.
        fine = np.ascontiguousarray(image.data[..., :3])  # type: ignore[attr-defined]
        size = (self._maze.camera.width, self._maze.camera.height)
        return np.asarray(cv2.resize(fine, size, interpolation=cv2.INTER_AREA))

    def _add_robot(self, name: str) -> FrameId:
        """A body, and on it a block with markers or a mast with a lens."""
        frame = self._scene.RegisterFrame(self._source, GeometryFrame(name))
        maze = self._maze
        body = Cylinder(maze.robot_radius, maze.body_height)
        self._add(body, _BODY, 0.5 * maze.body_height, frame)
        if name == "evader":
            for corners in maze.marker.corners(np.zeros(3)):
                self._add(_picture_mesh(Poster(marker_picture(), corners)), frame=frame)
        elif name != "pursuer":
            # It ends below the lens, which would else see it from inside.
            mast = maze.camera.lens_height - maze.body_height - 0.02
            if mast > 0:
                self._add(Box(0.02, 0.02, mast), _MAST, maze.body_height + 0.5 * mast, frame)
        return frame

    def _add(
        self,
        shape: Shape,
        colour: Rgba | None = None,
        middle_height: float = 0.0,
        frame: FrameId | None = None,
    ) -> None:
        """Register a shape at a height [m], on a robot's frame or in the world."""
        name = f"shape {self._scene.model_inspector().num_geometries()}"
        instance = GeometryInstance(_standing(np.zeros(3), middle_height), shape, name)
        properties = PerceptionProperties()
        if colour is not None:
            properties.AddProperty("phong", "diffuse", colour)
        instance.set_perception_properties(properties)
        if frame is None:
            self._scene.RegisterAnchoredGeometry(self._source, instance)
        else:
            self._scene.RegisterGeometry(self._source, frame, instance)


# A camera's axes (right, down, ahead) in its robot's (ahead, left, up).
_LOOKING_AHEAD = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])


def _standing(pose: np.ndarray, height: float) -> RigidTransform:
    x, y, heading = pose
    place = np.array([x, y, height])
    # Drake's stubs put the dtype of an array where its shape belongs.
    return RigidTransform(RotationMatrix.MakeZRotation(heading), place)  # pyright: ignore[reportArgumentType, reportCallIssue]


def _camera(maze: Maze, scene: SceneGraph) -> RgbdSensor:
    optics, n = maze.camera, _OVERSAMPLING
    # Drake 1.51 draws the axis half a pixel above and to the left of where it is told.
    f, (cx, cy) = n * optics.focal_pixels, n * (optics.centre + 0.5)
    info = CameraInfo(
        width=n * optics.width,
        height=n * optics.height,
        focal_x=f,
        focal_y=f,
        center_x=cx,
        center_y=cy,
    )
    core = RenderCameraCore("vtk", info, ClippingRange(_NEAREST, _FARTHEST), RigidTransform())
    return RgbdSensor(
        scene.world_frame_id(),
        RigidTransform(),
        ColorRenderCamera(core),
        DepthRenderCamera(core, DepthRange(2 * _NEAREST, 0.5 * _FARTHEST)),
    )


def _make_engine() -> RenderEngine:
    lights = [LightParameter(type="directional", frame="camera", intensity=_HEADLAMP)]
    for direction, strength in _LIGHTS:
        unit = np.array(direction) / math.hypot(*direction)
        lights.append(
            LightParameter(type="directional", frame="world", direction=unit, intensity=strength)
        )
    settings = RenderEngineVtkParams(lights=lights, default_clear_color=[0.85, 0.88, 0.9])
    try:
        return MakeRenderEngineVtk(settings)
    except RuntimeError as error:
        # Drake loads the library when it is first asked to draw; pip does not bring it.
        raise SightfieldError(
            "drawing pictures needs a graphics library of the system; on Debian or Ubuntu: "
            f"sudo apt-get install libegl1 libgl1-mesa-dri ({error})"
        ) from None


def _floor(maze: Maze) -> Poster:
    """Tiles of two tones under all of the maze."""
    x0, y0, x1, y1 = maze.world.bounds
    tones = np.indices((_TILES, _TILES)).sum(axis=0) % 2
    grey = np.where(tones, *_TILE_TONES).astype(np.uint8)
    large = np.kron(grey, np.ones((_TILE_PIXELS, _TILE_PIXELS), np.uint8))
    picture = np.repeat(large[..., None], 3, axis=2)
    return Poster(picture, np.array([[x0, y1, 0], [x1, y1, 0], [x1, y0, 0], [x0, y0, 0]]))


def _picture_mesh(poster: Poster) -> Mesh:
    # Slightly in front of the wall that it hangs on.
    normal = np.cross(poster.corners[3] - poster.corners[0], poster.corners[1] - poster.corners[0])
    corners = poster.corners + 2e-4 * normal / np.linalg.norm(normal)
    done, png = cv2.imencode(".png", cv2.cvtColor(poster.picture, cv2.COLOR_RGB2BGR))
    assert done
    files = {
        "poster.mtl": _file(picture_mtl("poster", "poster.png"), ".mtl"),
        # The stubs do not know of binary files.
        "poster.png": MemoryFile(png.tobytes(), ".png", "poster.png"),  # pyright: ignore[reportArgumentType]
    }
    return Mesh(
        InMemoryMesh(
            mesh_file=_file(picture_obj(corners, "poster"), ".obj"), supporting_files=files
        )
    )


def _file(text: str, extension: str) -> MemoryFile:
    return MemoryFile(text, extension, "maze" + extension)
