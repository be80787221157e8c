"""Trial pictures: known poses, rendered, recognised and located, to count and measure with."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from ....systems.numerics.geometry.edge_index import build_edge_index
from ....systems.numerics.geometry.segment_sight import are_clear
from ....systems.numerics.geometry.world import shrink_world
from ....systems.numerics.social.landmarks.forward_camera import project_forward
from ....systems.numerics.social.landmarks.maze import Maze
from ....systems.numerics.social.recognition.references import MARKER
from ....systems.numerics.vision.sensor import Sensor, expose
from ....systems.social.maze_renderer import MazeRenderer, Poster, posters_of

# Robots keep this distance at least, in radii.
_SPACING = 2.1
# In so many trials of a hundred the camera is turned to about where the evader is.
_TURNED, _ABOUT = 60, 0.4


@dataclass(frozen=True, eq=False)
class Square:
    """A landmark or copy of the marker that a camera may see.

    Attributes:
        subject: Number of the landmark, or MARKER.
        corners: Where they appear, shape (4, 2) [px].
        distance: Of its middle [m].
        obliqueness: Of the view, off its normal [rad].
        whole: All of it is in the frame, and neither wall nor robot hides a part.
    """

    subject: int
    corners: np.ndarray
    distance: float
    obliqueness: float
    whole: bool

    @property
    def size(self) -> float:
        """Mean length of its upright edges [px]."""
        return float(np.mean(np.abs(self.corners[[3, 2], 1] - self.corners[[0, 1], 1])))


@dataclass(frozen=True, eq=False)
class Trial:
    """A picture and the truth.

    Attributes:
        picture: Red, green, blue, shape (height, width, 3), uint8.
        camera, evader: Poses: x, y [m], heading [rad], shape (3,); no evader is None.
        squares: That face the camera and are before it.
    """

    picture: np.ndarray
    camera: np.ndarray
    evader: np.ndarray | None
    squares: tuple[Square, ...]


def make_trials(
    maze: Maze,
    count: int,
    seed: int,
    *,
    sensor: Sensor | None = None,
    decoys: Sequence[Poster] = (),
    posters: Sequence[Poster] | None = None,
    without_evader: float = 0.2,
) -> Iterator[Trial]:
    """Take pictures from random poses among an evader, a pursuer and another common agent.

    Args:
        maze: Where.
        count: How many.
        seed: Of poses; the sensor has its own.
        sensor: Quality of the pictures.
        decoys: Further pictures on the walls.
        posters: What hangs there instead of the maze's landmarks, if anything.
        without_evader: Share of the pictures in which there is none.
    """
    rng = np.random.default_rng(seed)
    hung = posters_of(maze) if posters is None else posters
    renderer = MazeRenderer(maze, common_agents=2, posters=[*hung, *decoys])
    sensor = Sensor() if sensor is None else sensor
    for number in range(count):
        poses = _draw_poses(maze, rng)
        camera, other, pursuer, evader = poses
        if rng.integers(100) < _TURNED:
            way = evader[:2] - camera[:2]
            camera[2] = math.atan2(way[1], way[0]) + rng.uniform(-_ABOUT, _ABOUT)
        present = None if rng.random() < without_evader else evader
        seen = renderer.render(0, np.array([camera, other]), present, pursuer)
        picture = expose(sensor, seen / np.float32(255), number)[..., :3]
        robots = [each for each in (other, pursuer, present) if each is not None]
        squares = _squares(maze, camera, present, robots)
        yield Trial(np.ascontiguousarray(picture), camera, present, squares)


def _draw_poses(maze: Maze, rng: np.random.Generator) -> list[np.ndarray]:
    """Four robots apart from one another and from walls."""
    room = shrink_world(maze.world, maze.robot_radius)[0]
    low, high = room.bounds[:2], room.bounds[2:]
    poses: list[np.ndarray] = []
    while len(poses) < 4:
        place = rng.uniform(low, high)
        gaps = [math.dist(place, each[:2]) for each in poses]
        if shapely.contains_xy(room.polygon, *place) and min(gaps, default=9) > (
            _SPACING * maze.robot_radius
        ):
            poses.append(np.array([*place, rng.uniform(-math.pi, math.pi)]))
    return poses


def _squares(
    maze: Maze, camera: np.ndarray, evader: np.ndarray | None, robots: Sequence[np.ndarray]
) -> tuple[Square, ...]:
    """The squares before the camera that face it."""
    known = [(each.number, each.corners) for each in maze.landmarks]
    if evader is not None:
        known += [(MARKER, corners) for corners in maze.marker.corners(evader)]
    index = build_edge_index(maze.world)
    found = []
    for subject, corners in known:
        seen = project_forward(maze.camera, camera, corners)
        middle = corners.mean(axis=0)[:2]
        along = corners[1, :2] - corners[0, :2]
        normal = np.array([along[1], -along[0]]) / np.hypot(*along)
        way = camera[:2] - middle
        obliqueness = math.acos(np.clip(way @ normal / np.hypot(*way), -1, 1))
        if obliqueness >= 0.5 * math.pi or not np.isfinite(seen).all():
            continue
        hiding = [each for each in robots if not (subject == MARKER and each is evader)]
        base = corners[0, :2] + np.linspace(0.01, 0.99, 7)[:, None] * along + 1e-6 * normal
        clear = bool(are_clear(index, np.tile(camera[:2], (7, 1)), base).all())
        clear = clear and not any(_hides(maze, camera, base, each) for each in hiding)
        frame = np.array([maze.camera.width - 1, maze.camera.height - 1])
        framed = bool(((seen >= 0) & (seen <= frame)).all())
        distance = float(np.hypot(*way))
        found.append(Square(subject, seen, distance, obliqueness, clear and framed))
    return tuple(found)


def _hides(maze: Maze, camera: np.ndarray, base: np.ndarray, robot: np.ndarray) -> bool:
    """Whether a robot stands between the camera and some point of a wall."""
    ways = base - camera[:2]
    share = np.clip((robot[:2] - camera[:2]) @ ways.T / (ways**2).sum(axis=1), 0.0, 1.0)
    apart = np.hypot(*(camera[:2] + share[:, None] * ways - robot[:2]).T)
    return bool((apart < 1.05 * maze.robot_radius).any())
