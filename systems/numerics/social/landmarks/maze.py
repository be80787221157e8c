"""A maze with landmarks on its walls, what the robots in it look like, and its surfaces.

The surfaces, walls and flat pictures, are Wavefront OBJ texts for renderers.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np
import shapely

from ...checked import Checked, Count, Finite, Positive, at_least
from ...errors import require
from ...geometry.world import World
from .forward_camera import ForwardCamera


def upright_square(middle: np.ndarray, side: float, facing: float) -> np.ndarray:
    """Corners of an upright square: top left, top right, bottom right, bottom left as seen.

    Args:
        middle: x, y and height, shape (3,) [m].
        side: [m].
        facing: Direction of its front's normal [rad].

    Returns:
        Shape (4, 3) [m].
    """
    left = np.array([math.sin(facing), -math.cos(facing), 0.0])
    up = np.array([0.0, 0.0, 1.0])
    half = 0.5 * side
    signs = ((1, 1), (-1, 1), (-1, -1), (1, -1))
    return np.array([middle + half * (across * left + above * up) for across, above in signs])


@dataclass(frozen=True, kw_only=True)
class Landmark(Checked):
    """A square picture, unlike all others, that hangs upright on a wall.

    Raises:
        InvalidInput: A number is out of its range.
    """

    # Which picture: of `landmark_picture`.
    number: Count
    # Of its middle, on the wall [m].
    x: Finite
    y: Finite
    # Of its middle above the floor [m].
    middle_height: float = 0.18
    # Direction of the wall's normal, into free space [rad].
    facing: Finite
    # [m].
    side: Positive = 0.26

    def __post_init__(self) -> None:
        super().__post_init__()
        require(
            self.middle_height >= 0.5 * self.side,
            "middle_height",
            f"be at least half the side, {0.5 * self.side:g} m",
            self.middle_height,
        )

    @property
    def corners(self) -> np.ndarray:
        """Top left, top right, bottom right, bottom left as seen, shape (4, 3) [m]."""
        middle = np.array([self.x, self.y, self.middle_height])
        return upright_square(middle, self.side, self.facing)


@dataclass(frozen=True, kw_only=True)
class MarkerBlock(Checked):
    """An upright block on the evader's axis that shows the marker on every side.

    Side k faces the evader's heading plus 2 pi k / copies.

    Raises:
        InvalidInput: A number is out of its range, or the block is too slim for its copies.
    """

    copies: Annotated[int, at_least(3)] = 4
    # Of a square marker, as wide as the block's side [m].
    side: Positive = 0.14
    # Of the markers' middles above the floor [m].
    middle_height: float = 0.16

    def __post_init__(self) -> None:
        super().__post_init__()
        require(
            self.middle_height >= 0.5 * self.side,
            "middle_height",
            f"be at least half the side, {0.5 * self.side:g} m",
            self.middle_height,
        )

    @property
    def depth(self) -> float:
        """From the axis to a side [m]."""
        return 0.5 * self.side / math.tan(math.pi / self.copies)

    @property
    def radius(self) -> float:
        """From the axis to an edge [m]."""
        return 0.5 * self.side / math.sin(math.pi / self.copies)

    def corners(self, pose: np.ndarray) -> np.ndarray:
        """Corners of every copy when the evader is at a pose, shape (copies, 4, 3) [m]."""
        x, y, heading = pose
        facings = heading + 2 * math.pi * np.arange(self.copies) / self.copies
        return np.array(
            [
                upright_square(
                    np.array(
                        [
                            x + self.depth * math.cos(facing),
                            y + self.depth * math.sin(facing),
                            self.middle_height,
                        ]
                    ),
                    self.side,
                    facing,
                )
                for facing in facings
            ]
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class Maze(Checked):
    """What all robots know of their surroundings, and the looks of the evader.

    Attributes:
        world: Free region between the walls.
        landmarks: On its walls, no two with the same number.
        marker: What the evader wears.
        camera: Of every common agent.
        wall_height: Of walls and obstacles alike [m].
        robot_radius: Of every robot; the evader's block does not reach beyond it [m].
        body_height: Of every robot without camera or block [m].

    Raises:
        InvalidInput: A height or radius is out of its range, two landmarks have one number, or one
            does not hang on a wall.
    """

    world: World
    landmarks: tuple[Landmark, ...]
    marker: MarkerBlock = field(default_factory=MarkerBlock)
    camera: ForwardCamera = field(default_factory=ForwardCamera)
    wall_height: Positive = 0.45
    robot_radius: Positive = 0.1
    body_height: Positive = 0.08

    def __post_init__(self) -> None:
        super().__post_init__()
        require(
            self.body_height <= min(self.marker.middle_height, self.camera.lens_height),
            "body_height",
            "stay below lens and marker",
            self.body_height,
        )
        require(
            self.marker.radius <= self.robot_radius + 1e-9,
            "robot_radius",
            f"cover the marker block, {self.marker.radius:.4g} m",
            self.robot_radius,
        )
        numbers = [landmark.number for landmark in self.landmarks]
        require(len(set(numbers)) == len(numbers), "landmarks", "differ in number", numbers)
        for i, landmark in enumerate(self.landmarks):
            _require_on_wall(self, f"landmarks[{i}]", landmark)

    def landmark(self, number: int) -> Landmark:
        """The landmark of a number."""
        return next(each for each in self.landmarks if each.number == number)


def _require_on_wall(maze: Maze, name: str, landmark: Landmark) -> None:
    """Refuse a landmark that does not lie flat on a wall with its front to free space."""
    free, near = maze.world.polygon, 1e-6 * maze.world.size
    base = shapely.LineString(landmark.corners[:2, :2])
    require(free.boundary.buffer(near).covers(base), name, "hang on one wall, all of it", landmark)
    step = 10 * near
    front = shapely.Point(
        landmark.x + step * math.cos(landmark.facing),
        landmark.y + step * math.sin(landmark.facing),
    )
    require(free.contains(front), name, "face free space", landmark)
    top = landmark.middle_height + 0.5 * landmark.side
    require(top <= maze.wall_height + 1e-9, name, "end below the wall's top", f"{top:g} m")


# Of the outer wall [m].
_THICKNESS = 0.06


def picture_obj(corners: np.ndarray, material: str) -> str:
    """A flat rectangle that shows a picture.

    Args:
        corners: Of the picture's top left, top right, bottom right, bottom left; shape (4, 3) [m].
        material: Name of its library file without ending, and of the material in it.
    """
    normal = np.cross(corners[3] - corners[0], corners[1] - corners[0])
    normal /= np.linalg.norm(normal)
    lines = [f"mtllib {material}.mtl"]
    lines += [_row("v", corner) for corner in corners]
    lines += [_row("vt", place) for place in ((0, 1), (1, 1), (1, 0), (0, 0))]
    # Corners run clockwise seen from the front; the face runs the other way.
    lines += [_row("vn", normal), f"usemtl {material}", "f 4/4/1 3/3/1 2/2/1 1/1/1", ""]
    return "\n".join(lines)


def picture_mtl(material: str, file: str) -> str:
    """The material library that belongs to `picture_obj`, showing a picture file."""
    return f"newmtl {material}\nKd 1 1 1\nmap_Kd {file}\n"


def walls_obj(world: World, height: float) -> str:
    """Obstacles and an outer wall around the free region, up to a height [m]."""
    outline = shapely.Polygon(world.boundary)
    solid = outline.buffer(_THICKNESS, join_style="mitre").difference(world.polygon)
    faces: list[np.ndarray] = []
    for ring in shapely.get_parts(shapely.get_rings(shapely.get_parts(shapely.normalize(solid)))):
        points = shapely.get_coordinates(ring)
        # Shapely's normal form runs clockwise around the solid: outside lies to the left.
        for start, end in zip(points[1:], points[:-1], strict=True):
            faces.append(np.array([(*start, 0.0), (*end, 0.0), (*end, height), (*start, height)]))
    for triangle in shapely.get_parts(shapely.constrained_delaunay_triangles(solid)):
        points = shapely.get_coordinates(triangle.exterior)[:3]
        if not shapely.is_ccw(triangle.exterior):
            points = points[::-1]
        faces.append(np.column_stack([points, np.full(3, height)]))
    return _obj(faces)


def _obj(faces: Iterable[np.ndarray]) -> str:
    """Flat faces, each of corners counter-clockwise seen from outside, shape (n, 3)."""
    lines: list[str] = []
    count = 0
    for number, face in enumerate(faces, start=1):
        normal = np.cross(face[1] - face[0], face[2] - face[0])
        lines += [_row("v", corner) for corner in face]
        lines.append(_row("vn", normal / np.linalg.norm(normal)))
        corners = " ".join(f"{count + k + 1}//{number}" for k in range(len(face)))
        lines.append(f"f {corners}")
        count += len(face)
    return "\n".join([*lines, ""])


def _row(kind: str, numbers: Iterable[float]) -> str:
    return " ".join([kind, *(f"{float(number):.9g}" for number in numbers)])
