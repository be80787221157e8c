"""Positions of camera and evader from lengths of vertical edges, Zhang 2014, (2.14) and (2.15).

d_1 = f d_landmark / (n_edge / k_ppm) and theta = atan(n_dev / k_ppm / f). The printed (2.14) gives
the depth of an edge along the camera's axis, not its distance: an edge that appears at theta to the
side is farther by 1 / cos(theta), 15% at 30 degrees. With `printed` the equation is used
unchanged.
"""

import math

import numpy as np

from ...errors import require_positive
from ..landmarks.forward_camera import ForwardCamera


def edge_distance(
    camera: ForwardCamera,
    length: float,
    pixels: float,
    bearing: float = 0.0,
    *,
    printed: bool = False,
) -> float:
    """Distance on the floor between the camera and a vertical edge, (2.14) [m].

    Args:
        camera: Its optics.
        length: Of the edge, d_landmark [m].
        pixels: Its length in the picture, n_edge [px].
        bearing: Of the edge off the camera's axis, theta of (2.15) [rad].
        printed: Whether to ignore the bearing, as the printed equation does.

    Raises:
        InvalidInput: A length is not positive.
    """
    require_positive("length", length)
    require_positive("pixels", pixels)
    depth = camera.focal_length * length / (pixels / camera.pixel_density)
    return depth if printed else depth / math.cos(bearing)


def edge_bearing(camera: ForwardCamera, column: float) -> float:
    """theta of (2.15), positive to the left [rad], of an edge at a column of the picture [px]."""
    deviation = (camera.centre[0] - column) / camera.pixel_density
    return math.atan(deviation / camera.focal_length)


def square_by_edges(
    camera: ForwardCamera, corners: np.ndarray, side: float, *, printed: bool = False
) -> np.ndarray | None:
    """Pose of a landmark's square relative to the camera, by Figure 2.28.

    The distances d_1 and d_2 of its two vertical edges, which are `side` apart, make a triangle
    with the camera; the bearings of both edges, on average, turn it.

    Args:
        camera: Its optics.
        corners: Of the square, shape (4, 2) [px].
        side: [m].
        printed: As the printed (2.14).

    Returns:
        Ahead and to the left of the camera [m], and the direction of its front's normal from the
        camera's heading [rad], shape (3,); None if there is no such triangle, its sides being off.
    """
    heights = corners[[3, 2], 1] - corners[[0, 1], 1]
    if (heights <= 0).any():
        return None
    columns = 0.5 * (corners[[3, 2], 0] + corners[[0, 1], 0])
    left, right = (edge_bearing(camera, float(column)) for column in columns)
    d_1, d_2 = (
        edge_distance(camera, side, float(height), bearing, printed=printed)
        for height, bearing in zip(heights, (left, right), strict=True)
    )
    # At the left edge, between the square and the way to the camera.
    cos = (d_1**2 + side**2 - d_2**2) / (2 * d_1 * side)
    if abs(cos) >= 1:
        return None
    # A frame whose x axis leads from the left edge to the right one, the camera below it.
    place = np.array([d_1 * cos, -d_1 * math.sqrt(1 - cos**2)])
    ways = [math.atan2(-place[1], -place[0]), math.atan2(-place[1], side - place[0])]
    # The camera's heading in that frame, so that both edges appear where they do.
    offsets = [way - bearing for way, bearing in zip(ways, (left, right), strict=True)]
    heading = math.atan2(sum(map(math.sin, offsets)), sum(map(math.cos, offsets)))
    c, s = math.cos(heading), math.sin(heading)
    middle = np.array([0.5 * side, 0.0]) - place
    ahead, leftward = c * middle[0] + s * middle[1], -s * middle[0] + c * middle[1]
    # The front's normal points down in that frame, to the camera.
    facing = -0.5 * math.pi - heading
    return np.array([ahead, leftward, math.atan2(math.sin(facing), math.cos(facing))])


def middle_by_size(
    camera: ForwardCamera, corners: np.ndarray, side: float, *, printed: bool = False
) -> np.ndarray | None:
    """Where the middle of a square is, from its apparent size: ahead and left, shape (2,) [m].

    Args:
        camera: Its optics.
        corners: Of the square in the picture, shape (4, 2) [px].
        side: Of the square [m].
        printed: Leave the bearing out, as the printed equation does.
    """
    heights = corners[[3, 2], 1] - corners[[0, 1], 1]
    if (heights <= 0).any():
        return None
    bearing = edge_bearing(camera, float(corners[:, 0].mean()))
    # The nearer edge looks longer: depths average, lengths do not.
    height = 2 / float(np.sum(1 / heights))
    distance = edge_distance(camera, side, height, bearing, printed=printed)
    return distance * np.array([math.cos(bearing), math.sin(bearing)])
