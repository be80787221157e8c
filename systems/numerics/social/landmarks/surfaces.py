"""The maze's surfaces as Wavefront OBJ texts, for renderers: walls, and flat pictures."""

from collections.abc import Iterable

import numpy as np
import shapely

from ...geometry.world import World

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
