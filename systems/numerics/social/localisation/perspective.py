"""Poses of an upright square before a level camera: by its edges, by solvePnP, by least squares.

A relative pose consists of the distances ahead of the camera and to its left [m], and the direction
of the square's front from the camera's heading [rad]. For a small or far square two poses fit
almost equally well, with its left or its right side nearer.

By the lengths of vertical edges, Zhang 2014, (2.14) and (2.15):

    d_1 = f d_landmark / (n_edge / k_ppm),    theta = atan(n_dev / k_ppm / f).

The printed (2.14) gives the depth of an edge along the camera's axis, not its distance: an edge
that appears at theta to the side is farther by 1 / cos(theta), 15% at 30 degrees. With `printed`
the equation is used unchanged.
"""

import math

import cv2
import numpy as np

from ...errors import require_positive
from ..landmarks.forward_camera import ForwardCamera, project_forward
from ..landmarks.maze import upright_square

_STEPS, _ENOUGH = 12, 1e-6
# How far the front is turned from the camera at first [rad].
_TURN = 0.7


def starting_poses(camera: ForwardCamera, corners: np.ndarray, side: float) -> list[np.ndarray]:
    """Rough relative poses, shape (3,): by apparent size, the front turned either way.

    Args:
        camera: Its optics.
        corners: Of the square in the picture, shape (4, 2) [px].
        side: Of the square [m].
    """
    middle = middle_by_size(camera, corners, side)
    if middle is None:
        return []
    back = math.atan2(-middle[1], -middle[0])
    return [np.array([*middle, back + turn]) for turn in (_TURN, -_TURN)]


def square_by_pnp(
    camera: ForwardCamera, corners: np.ndarray, side: float, start: np.ndarray
) -> tuple[np.ndarray, float] | None:
    """Pose from four corners by OpenCV's solvePnP: all six degrees of freedom, unweighted.

    It iterates from a given pose: in OpenCV 5.0 the closed form for squares (SOLVEPNP_IPPE_SQUARE)
    divides by nearly zero if edges are upright in the picture, as all are here.

    Args:
        camera: Its optics.
        corners: Shape (4, 2) [px].
        side: Of the square [m].
        start: A relative pose, shape (3,).

    Returns:
        The relative pose, projected onto the floor, shape (3,), and the remaining sum of squares
        [px^2]; None if there is no pose before the camera.
    """
    h = 0.5 * side
    square = np.array([[-h, h, 0], [h, h, 0], [h, -h, 0], [-h, -h, 0]])
    ahead, left, facing = start
    # The square's axes in the camera's: to the right of its picture, up, and out of its front.
    out = np.array([-math.sin(facing), 0.0, math.cos(facing)])
    up = np.array([0.0, -1.0, 0.0])
    turn, _ = cv2.Rodrigues(np.column_stack([np.cross(up, out), up, out]))
    move = np.array([[-left], [0.0], [ahead]])
    pixels = corners.reshape(-1, 1, 2)
    try:
        done, turn, move = cv2.solvePnP(
            square, pixels, camera.matrix, None, turn, move, True, cv2.SOLVEPNP_ITERATIVE
        )
    except cv2.error:
        return None
    if not done or not (np.isfinite(turn).all() and np.isfinite(move).all()) or move[2, 0] <= 0:
        return None
    seen, _ = cv2.projectPoints(square, turn, move, camera.matrix, None)
    normal = cv2.Rodrigues(turn)[0][:, 2]
    pose = np.array([move[2, 0], -move[0, 0], math.atan2(-normal[0], normal[2])])
    return pose, float(np.sum((seen - pixels) ** 2))


def fit_square(
    camera: ForwardCamera,
    corners: np.ndarray,
    covariance: np.ndarray,
    side: float,
    middle_height: float,
    start: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, float] | None:
    """Relative pose that explains the corners best, the camera being level (Gauss and Newton).

    Args:
        camera: Its optics.
        corners: Shape (4, 2) [px].
        covariance: Of the corners, shape (8, 8) [px^2].
        side, middle_height: Of the square [m].
        start: A relative pose, shape (3,).

    Returns:
        Relative pose, shape (3,); its covariance, shape (3, 3); and the remaining sum of squares,
        with 5 degrees of freedom. None if the square passes behind the camera.
    """
    weight = np.linalg.inv(covariance)

    def residual(pose: np.ndarray) -> np.ndarray:
        middle = np.array([pose[0], pose[1], middle_height])
        return (
            project_forward(camera, np.zeros(3), upright_square(middle, side, pose[2])) - corners
        ).ravel()

    pose = np.asarray(start, dtype=float).copy()
    error = residual(pose)
    for _ in range(_STEPS):
        if not np.isfinite(error).all():
            return None
        slope = slopes(residual, pose)
        if not np.isfinite(slope).all():
            return None
        information = slope.T @ weight @ slope + 1e-9 * np.eye(3)
        change = -np.linalg.solve(information, slope.T @ weight @ error)
        shrink = 1.0
        cost = error @ weight @ error
        while shrink > 1e-3:
            trial = residual(pose + shrink * change)
            if np.isfinite(trial).all() and trial @ weight @ trial <= cost:
                break
            shrink *= 0.5
        else:
            break
        pose, error = pose + shrink * change, trial
        if np.abs(change).max() < _ENOUGH:
            break
    slope = slopes(residual, pose)
    if not np.isfinite(slope).all():
        return None
    pose[2] = math.atan2(math.sin(pose[2]), math.cos(pose[2]))
    return pose, np.linalg.inv(slope.T @ weight @ slope), float(error @ weight @ error)


def slopes(function, at: np.ndarray, step: float = 1e-5) -> np.ndarray:
    """Derivatives of a vector function by central differences, shape (values, arguments).

    Args:
        function: From a vector to a vector.
        at: Where, shape (arguments,).
        step: Half of each difference, in the arguments' units [-].
    """
    columns = []
    for k in range(len(at)):
        moved = np.zeros(len(at))
        moved[k] = step
        columns.append((function(at + moved) - function(at - moved)) / (2 * step))
    return np.column_stack(columns)


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
