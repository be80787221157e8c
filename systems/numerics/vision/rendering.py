"""Pictures of an omni-directional camera among walls and shells, before its sensor."""

import math
from collections.abc import Sequence

import numpy as np

from ..errors import require
from .omni_optics import OmniCamera
from .ray_table import SECTORS, RayTable
from .ray_tracing import trace
from .shells import Shell
from .surroundings import Surroundings
from .wall_sectors import edges_by_sector

# Row of the palette for pixels that show no mirror.
_BACKDROP = 6


def render(
    camera: OmniCamera,
    rays: RayTable,
    surroundings: Surroundings,
    pose: Sequence[float] | np.ndarray,
    shells: Sequence[Shell],
    positions: np.ndarray,
) -> np.ndarray:
    """What the camera sees: one exact ray for each pixel, and whatever it meets first.

    Args:
        camera: Whose picture.
        rays: Its own, from `make_ray_table`.
        surroundings: Floor and walls.
        pose: Of the camera: x, y [m] in free space, heading [rad], shape (3,).
        shells: Of robots; one around the camera itself is seen from above.
        positions: Of the shells' axes, shape (m, 2) [m].

    Returns:
        Light on the sensor, shape (height, width, 3), red, green and blue from 0 to 1.

    Raises:
        InvalidInput: The shells and their positions differ in number.
    """
    x, y, heading = (float(value) for value in pose)
    positions = np.asarray(positions, dtype=float).reshape(-1, 2)
    require(len(positions) == len(shells), "positions", f"be {len(shells)}", len(positions))
    # From the world to the camera frame.
    cosine, sine = math.cos(heading), math.sin(heading)
    turn = np.array([[cosine, -sine], [sine, cosine]])
    edges = ((surroundings.edges.reshape(-1, 2, 2) - [x, y]) @ turn).reshape(-1, 4)
    sizes = np.array([(each.radius, each.base, each.top) for each in shells]).reshape(-1, 3)
    colours = np.array([each.colour for each in shells], dtype=np.float32).reshape(-1, 3) / 255
    angle = surroundings.light_heading - heading
    picture = np.empty((camera.height * camera.width, 3), dtype=np.float32)
    picture[:] = surroundings.palette[_BACKDROP]
    trace(
        picture,
        *rays,
        edges,
        *edges_by_sector(edges, SECTORS),
        surroundings.wall_height,
        np.hstack([(positions - [x, y]) @ turn, sizes]),
        colours,
        surroundings.palette,
        np.array([x, y, heading]),
        surroundings.tile,
        np.array([math.cos(angle), math.sin(angle), surroundings.shading]),
    )
    return picture.reshape(camera.height, camera.width, 3)
