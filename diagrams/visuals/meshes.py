"""Triangle meshes for a map seen from above: flat shapes, extruded shapes, bars and arrows."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import shapely

# Where a nose begins, in radii from the centre.
_NOSE_BASE = 0.58


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles as Meshcat takes them.

    Attributes:
        vertices: Shape (3, n), column-major [m].
        faces: Vertex indices of each triangle, shape (3, m), column-major.
    """

    vertices: np.ndarray
    faces: np.ndarray

    @property
    def area(self) -> float:
        """Total area of the triangles [m^2]."""
        a, b, c = (self.vertices[:, self.faces[k]] for k in range(3))
        return float(0.5 * np.linalg.norm(np.cross(b - a, c - a, axis=0), axis=0).sum())


def mesh_of(points: np.ndarray, faces: np.ndarray, height: float = 0.0) -> Mesh:
    """Make a mesh of points of the plane, shape (n, 2), or of space, (n, 3), and faces (m, 3).

    Args:
        points: Shape (n, 2) or (n, 3) [m].
        faces: Numbers of points, shape (m, 3).
        height: Of points of the plane [m].
    """
    if points.shape[1] == 2:
        points = np.column_stack([points, np.full(len(points), height)])
    return Mesh(
        np.asfortranarray(points.T, dtype=float), np.asfortranarray(faces.T, dtype=np.int32)
    )


def merged(meshes: Iterable[Mesh]) -> Mesh:
    """Join meshes into one."""
    meshes = list(meshes)
    offsets = np.cumsum([0] + [mesh.vertices.shape[1] for mesh in meshes[:-1]])
    return Mesh(
        np.asfortranarray(np.hstack([mesh.vertices for mesh in meshes])),
        np.asfortranarray(
            np.hstack([mesh.faces + k for mesh, k in zip(meshes, offsets, strict=True)]),
            dtype=np.int32,
        ),
    )


def filled_parts(shape: shapely.Geometry) -> shapely.MultiPolygon:
    """The parts of a shape, or of collections in it, that have an area."""
    parts = shapely.get_parts(shapely.get_parts(shape))
    return shapely.MultiPolygon([part for part in parts if part.area > 0])


def unpinched(shape: shapely.Geometry) -> shapely.Geometry:
    """A shape, or its parts with an area if it touches itself: turned and stretched ones may."""
    return shape if shapely.is_valid(shape) else filled_parts(shapely.make_valid(shape))


def flat_mesh(shape: shapely.Geometry, height: float = 0.0) -> Mesh:
    """Fill a polygon, or several, with triangles at one height.

    Args:
        shape: Of the plane [m].
        height: [m].
    """
    triangles = shapely.get_parts(shapely.constrained_delaunay_triangles(unpinched(shape)))
    corners = shapely.get_coordinates(triangles).reshape(-1, 4, 2)[:, :3]
    points, indices = np.unique(corners.reshape(-1, 2), axis=0, return_inverse=True)
    return mesh_of(points, indices.reshape(-1, 3), height)


def extruded_mesh(shape: shapely.Geometry, bottom: float, top: float) -> Mesh:
    """Raise a polygon, or several, into prisms without a floor.

    The walls share no vertices with one another or the roof, so that edges look sharp.

    Args:
        shape: Of the plane [m].
        bottom, top: Heights [m].
    """
    rings = shapely.get_parts(shapely.get_rings(shapely.get_parts(shape)))
    walls = []
    for ring in rings:
        points = shapely.get_coordinates(ring)
        start, end = points[:-1], points[1:]
        low, high = np.full((len(start), 1), bottom), np.full((len(start), 1), top)
        corners = np.stack(
            [
                np.hstack([start, low]),
                np.hstack([end, low]),
                np.hstack([end, high]),
                np.hstack([start, high]),
            ],
            axis=1,
        )
        walls.append(mesh_of(corners.reshape(-1, 3), _quad_faces(len(start))))
    return merged([flat_mesh(shape, top), *walls])


def line_mesh(rings: Iterable[np.ndarray], width: float) -> Mesh:
    """Draw closed rings, each shape (n, 2) [m], as a band of a width [m]."""
    bands = [
        shapely.LinearRing(ring).buffer(width / 2, join_style="mitre", mitre_limit=2.0)
        for ring in rings
    ]
    return flat_mesh(shapely.union_all(bands))


def bar_mesh(start: np.ndarray, end: np.ndarray, width: float) -> Mesh:
    """Draw segments from `start` to `end`, each shape (k, 2) [m], as bars of a width [m]."""
    along = end - start
    length = np.hypot(along[:, 0], along[:, 1])
    scale = 0.5 * width / np.where(length > 0, length, 1.0)
    side = np.column_stack([-along[:, 1] * scale, along[:, 0] * scale])
    corners = np.stack([start - side, end - side, end + side, start + side], axis=1)
    return mesh_of(corners.reshape(-1, 2), _quad_faces(len(start)))


def unit_bar_mesh(width: float) -> Mesh:
    """A bar along the x axis from 0 to 1, to be stretched.

    Args:
        width: [m].
    """
    return bar_mesh(np.array([[0.0, 0.0]]), np.array([[1.0, 0.0]]), width)


def fan_mesh(ring: np.ndarray, apex: np.ndarray) -> Mesh:
    """Fill a ring, shape (n, 2) [m], all of which can be seen from the apex, shape (2,) [m]."""
    n = len(ring)
    k = np.arange(n)
    faces = np.column_stack([k, (k + 1) % n, np.full(n, n)])
    return mesh_of(np.vstack([ring, apex]), faces)


def arrow_mesh(points: np.ndarray, vectors: np.ndarray, length: float) -> Mesh:
    """Draw a slim dart centred on each point, shapes (k, 2), along its vector.

    The longest vector is drawn with the given length [m], the others in proportion.
    """
    size = np.hypot(vectors[:, 0], vectors[:, 1])
    drawn = size > 1e-9 * max(float(size.max(initial=0.0)), 1e-300)
    points, along = points[drawn], vectors[drawn] * (length / float(size.max(initial=1e-300)))
    side = 0.22 * np.column_stack([-along[:, 1], along[:, 0]])
    tail = points - 0.5 * along
    corners = np.stack(
        [points + 0.5 * along, tail + side, points - 0.25 * along, tail - side], axis=1
    )
    return mesh_of(corners.reshape(-1, 2), _quad_faces(len(points)))


def disc_mesh(radius: float, hole: float = 0.0) -> Mesh:
    """A disc, or a ring with a hole, about the origin; both radii in metres.

    Args:
        radius: Of the rim [m].
        hole: Radius of the hole; 0: none [m].
    """
    shape = shapely.Point(0, 0).buffer(radius, quad_segs=12)
    return flat_mesh(shape.difference(shapely.Point(0, 0).buffer(hole, quad_segs=12)))


def nose_mesh(radius: float, top: float) -> Mesh:
    """A wedge that says where a round robot at the origin looks, along the x axis.

    It ends at the rim, so that nothing is drawn where the body is not, and begins beyond a number
    in the middle.

    Args:
        radius: Of the robot [m].
        top: Height [m].
    """
    half = np.sqrt(1.0 - _NOSE_BASE**2)
    wedge = radius * np.array([[_NOSE_BASE, -half], [1.0, 0.0], [_NOSE_BASE, half]])
    return extruded_mesh(shapely.Polygon(wedge), 0.0, top)


def _quad_faces(count: int) -> np.ndarray:
    """Two triangles for each run of four vertices, shape (2 count, 3)."""
    quads = 4 * np.arange(count)[:, None, None] + np.array([[0, 1, 2], [0, 2, 3]])
    return quads.reshape(-1, 3)
