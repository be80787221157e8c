"""Where a friend's picture was taken, and where the evader in it is, with covariances."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
import shapely

from ...errors import InvalidInput, require_one_of
from ...geometry.edge_index import build_edge_index
from ...geometry.segment_sight import are_clear
from ..landmarks.forward_camera import project_forward
from ..landmarks.maze import Landmark, Maze
from ..network.interface import Picture
from ..recognition.picture_files import decode_picture
from ..recognition.recognition import NOTHING, LandmarkDetection, Recognition, Stance, recognise
from ..recognition.references import References
from .perspective import slopes
from .relative import METHODS, EvaderPlace, Relative, evader_place, relative_poses

# Scale of the robust weight: a landmark's weight falls as the sum of squares of its eight residuals
# passes this (Geman and McClure 1987); one with a weight below a quarter is not used.
_DOUBTFUL, _USED = 60.0, 0.25
_STEPS, _ENOUGH = 15, 1e-6
# Two estimates nearer than this are one [m or rad].
_SAME = 0.01
# Estimates whose cost exceeds the best one's by this are dropped.
_WORSE = 25.0
# Estimates of the camera may lie this far inside a wall [m].
_WALL_SLACK = 0.05


@dataclass(frozen=True, eq=False)
class CameraPose:
    """A pose and what it rests on.

    Attributes:
        pose: x, y [m], heading [rad], shape (3,).
        covariance: Shape (3, 3).
        cost: Robust sum of squared residuals, in units of their variances.
        used: Numbers of the landmarks that agree with it.
    """

    pose: np.ndarray
    covariance: np.ndarray
    cost: float
    used: tuple[int, ...]


def camera_poses(
    maze: Maze, landmarks: Sequence[LandmarkDetection], method: str
) -> list[CameraPose]:
    """Poses from which a picture may have been taken, the likeliest first.

    Method "level" fits all landmarks at once, with robust weights that reduce the influence of
    those that disagree. With the other methods each landmark gives its own poses, and around each
    of them those that agree are averaged by their covariances.

    Args:
        maze: Map of the landmarks.
        landmarks: Detections of upright landmarks of the maze.
        method: One of METHODS.

    Returns:
        Poses inside the maze only; may be empty.
    """
    single = []
    for detection in landmarks:
        landmark = maze.landmark(detection.subject)
        for each in relative_poses(
            maze.camera, detection, landmark.side, landmark.middle_height, method
        ):
            single.append(_placed(landmark, each))
    if method == "level":
        fitted = [_fit(maze, landmarks, start.pose) for start in single]
    else:
        fitted = [_average(single, around) for around in single]
    room = maze.world.polygon.buffer(_WALL_SLACK)
    found: list[CameraPose] = []
    for each in sorted((each for each in fitted if each is not None), key=lambda each: each.cost):
        known = any(np.abs(_difference(each.pose, other.pose)).max() < _SAME for other in found)
        if not known and shapely.contains_xy(room, *each.pose[:2]):
            found.append(each)
    return [each for each in found if each.cost < found[0].cost + _WORSE]


def _placed(landmark: Landmark, relative: Relative) -> CameraPose:
    """Camera pose in the world, from a landmark's pose relative to the camera."""

    def camera(pose: np.ndarray) -> np.ndarray:
        heading = landmark.facing - pose[2]
        c, s = math.cos(heading), math.sin(heading)
        x = landmark.x - (c * pose[0] - s * pose[1])
        return np.array([x, landmark.y - (s * pose[0] + c * pose[1]), heading])

    slope = slopes(camera, relative.pose)
    pose = camera(relative.pose)
    return CameraPose(
        _wrapped(pose), slope @ relative.covariance @ slope.T, relative.cost, (landmark.number,)
    )


def _fit(
    maze: Maze, landmarks: Sequence[LandmarkDetection], start: np.ndarray
) -> CameraPose | None:
    """Fit all landmarks at once (Gauss and Newton, reweighted)."""
    points = [maze.landmark(each.subject).corners for each in landmarks]
    weights = [np.linalg.inv(each.covariance) for each in landmarks]
    pose = np.asarray(start, dtype=float)

    def residuals(at: np.ndarray) -> np.ndarray:
        return np.concatenate(
            [
                (project_forward(maze.camera, at, corners) - each.corners).ravel()
                for corners, each in zip(points, landmarks, strict=True)
            ]
        )

    information, squares = np.eye(3), np.zeros(len(landmarks))
    for _ in range(_STEPS):
        error = residuals(pose).reshape(-1, 8)
        slope = slopes(residuals, pose).reshape(-1, 8, 3)
        # A landmark that would be behind the camera is ignored.
        ahead = np.array(
            [
                np.isfinite(e).all() and np.isfinite(j).all()
                for e, j in zip(error, slope, strict=True)
            ]
        )
        error[~ahead], slope[~ahead] = 0.0, 0.0
        squares = np.array([e @ w @ e for e, w in zip(error, weights, strict=True)])
        squares[~ahead] = np.inf
        share = (1 / (1 + squares / _DOUBTFUL)) ** 2
        information, pull = np.zeros((3, 3)), np.zeros(3)
        for e, j, w, k in zip(error, slope, weights, share, strict=True):
            information += k * j.T @ w @ j
            pull += k * j.T @ w @ e
        if np.linalg.cond(information) > 1e12:
            return None
        change = -np.linalg.solve(information, pull)
        change *= min(1.0, 0.3 / max(float(np.abs(change).max()), 1e-12))
        pose = pose + change
        if np.abs(change).max() < _ENOUGH:
            break
    used = squares < (1 / math.sqrt(_USED) - 1) * _DOUBTFUL
    if not used.any():
        return None
    freedom = 8 * int(used.sum()) - 3
    scale = max(1.0, float(squares[used].sum()) / freedom)
    # Each landmark costs at most as much as if it were not one.
    cost = float(np.sum(_DOUBTFUL * (1 - 1 / (1 + squares / _DOUBTFUL))))
    numbers = tuple(each.subject for each, use in zip(landmarks, used, strict=True) if use)
    return CameraPose(_wrapped(pose), scale * np.linalg.inv(information), cost, numbers)


def _average(single: Sequence[CameraPose], around: CameraPose) -> CameraPose | None:
    """Mean of the poses that agree with a given one, weighted by their information."""
    information, pull, cost = np.zeros((3, 3)), np.zeros(3), 0.0
    used = []
    for number in dict.fromkeys(each.used[0] for each in single):
        nearest, square, away = None, math.inf, np.zeros(3)
        for each in (each for each in single if each.used[0] == number):
            apart = _difference(each.pose, around.pose)
            doubt = each.covariance + around.covariance + 1e-9 * np.eye(3)
            far = each.cost + float(apart @ np.linalg.solve(doubt, apart))
            if far < square:
                nearest, square, away = each, far, apart
        # Each landmark costs at most as much as if it were not one.
        cost += _DOUBTFUL * (1 - 1 / (1 + square / _DOUBTFUL))
        if nearest is not None and square < _DOUBTFUL:
            weight = np.linalg.inv(nearest.covariance + 1e-9 * np.eye(3))
            information, pull = information + weight, pull + weight @ away
            used.append(number)
    if not used:
        return None
    pose = around.pose + np.linalg.solve(information, pull)
    return CameraPose(_wrapped(pose), np.linalg.inv(information), cost, tuple(used))


def _difference(pose: np.ndarray, other: np.ndarray) -> np.ndarray:
    return _wrapped(pose - other)


def _wrapped(pose: np.ndarray) -> np.ndarray:
    turned = math.atan2(math.sin(pose[2]), math.cos(pose[2]))
    return np.array([pose[0], pose[1], turned])


class Outcome(IntEnum):
    """Whether there is a location, or why not. Only the first two come with one."""

    LOCATED = 0
    # It seemed to be a little inside a wall, and is given at the nearest place where it can be.
    AT_A_WALL = 1
    # Not bytes of a picture of the camera's size.
    NO_PICTURE = 2
    NO_EVADER = 3
    NO_LANDMARK = 4
    # Landmarks, but none that hangs as the map says.
    NOT_UPRIGHT = 5
    # No place in the maze explains the landmarks.
    CAMERA_OUTSIDE = 6
    EVADER_OUTSIDE = 7
    # A wall of the map stands between.
    BEHIND_A_WALL = 8
    # The evader could be almost anywhere.
    TOO_UNSURE = 9

    @property
    def has_location(self) -> bool:
        """Whether a location comes with it."""
        return self <= Outcome.AT_A_WALL

    @property
    def words(self) -> str:
        """For people: as "no evader"."""
        return self.name.lower().replace("_", " ")


# How far a location may lie inside a wall, in standard deviations, and at most [m].
_DEVIATIONS, _FARTHEST = 3.0, 0.3
# Locations with a larger standard deviation than this are discarded [m].
_UNSURE = 0.5
# Least deviations of the camera's pose, for errors of the lens's mounting and the map [m], [rad].
_PLACE_FLOOR, _TURN_FLOOR = 2e-3, 1e-3
# Poses of the camera are weighted by their costs, divided by this, as corners err by more than
# their covariances say.
_TEMPER = 4.0


@dataclass(frozen=True, eq=False, kw_only=True)
class Location:
    """Where the evader was when a picture was taken.

    Attributes:
        outcome: Whether there is a location, or why not.
        position: Shape (2,) [m]; NaN without a location.
        covariance: Shape (2, 2) [m^2]; infinite on its diagonal without a location.
        camera: Where the picture was taken, if known from landmarks, even without the evader; else
            None.
        copies: Number of copies of the marker that it rests on.
    """

    outcome: Outcome
    position: np.ndarray
    covariance: np.ndarray
    camera: CameraPose | None = None
    copies: int = 0


def no_location(outcome: Outcome, camera: CameraPose | None = None) -> Location:
    """Make a result without a location, with the reason."""
    nowhere, anywhere = np.full(2, math.nan), np.diag([math.inf, math.inf])
    return Location(outcome=outcome, position=nowhere, covariance=anywhere, camera=camera)


def locate_evader(recognition: Recognition, maze: Maze, method: str = "level") -> Location:
    """Locate camera and evader.

    Args:
        recognition: What the picture shows.
        maze: The map.
        method: One of METHODS.

    Returns:
        A location in the maze's free space, or none and why.

    Raises:
        InvalidInput: No such method.
    """
    require_one_of("method", method, METHODS)
    landmarks = [each for each in recognition.landmarks if each.stance is Stance.UPRIGHT]
    markers = [each for each in recognition.markers if each.stance is Stance.UPRIGHT]
    if not landmarks:
        lack = Outcome.NOT_UPRIGHT if recognition.landmarks else Outcome.NO_LANDMARK
        return no_location(lack if markers else Outcome.NO_EVADER)
    poses = camera_poses(maze, landmarks, method)
    if not poses:
        return no_location(Outcome.CAMERA_OUTSIDE)
    place = evader_place(maze.camera, maze.marker, markers, method) if markers else None
    if place is None:
        return no_location(Outcome.NO_EVADER, poses[0])
    located = [(pose, *_in_world(pose, place)) for pose in poses]
    judged = [(*each, _judge(maze, *each)) for each in located]
    possible = [each for each in judged if each[3].has_location]
    if not possible:
        return no_location(judged[0][3], poses[0])
    cost = np.array([each[0].cost for each in possible])
    likely = np.exp(-0.5 * (cost - cost[0]) / _TEMPER)
    share = likely / likely.sum()
    position = share @ np.array([each[1] for each in possible])
    covariance = np.zeros((2, 2))
    for k, (_, where, spread, _) in zip(share, possible, strict=True):
        covariance += k * (spread + np.outer(where - position, where - position))
    if math.sqrt(float(np.linalg.eigvalsh(covariance)[-1])) > _UNSURE:
        return no_location(Outcome.TOO_UNSURE, poses[0])
    inside = nearest_free(maze, position)
    return Location(
        outcome=Outcome.LOCATED if np.array_equal(inside, position) else Outcome.AT_A_WALL,
        position=inside,
        covariance=covariance,
        camera=possible[0][0],
        copies=place.copies,
    )


def _in_world(camera: CameraPose, place: EvaderPlace) -> tuple[np.ndarray, np.ndarray]:
    """The evader's position, and its covariance from those of camera pose and relative place."""

    def position(values: np.ndarray) -> np.ndarray:
        x, y, heading, ahead, left = values
        c, s = math.cos(heading), math.sin(heading)
        return np.array([x + c * ahead - s * left, y + s * ahead + c * left])

    values = np.concatenate([camera.pose, place.place])
    spread = np.zeros((5, 5))
    floor = np.diag([_PLACE_FLOOR**2, _PLACE_FLOOR**2, _TURN_FLOOR**2])
    spread[:3, :3], spread[3:, 3:] = camera.covariance + floor, place.covariance
    slope = slopes(position, values)
    return position(values), slope @ spread @ slope.T


def _judge(maze: Maze, camera: CameraPose, position: np.ndarray, covariance: np.ndarray) -> Outcome:
    """Whether the evader can be there, and be seen from the camera."""
    nearest = nearest_free(maze, position)
    depth = float(np.hypot(*(nearest - position)))
    deviation = math.sqrt(float(np.linalg.eigvalsh(covariance)[-1]))
    if depth > min(_DEVIATIONS * deviation + maze.marker.depth, _FARTHEST):
        return Outcome.EVADER_OUTSIDE
    # Visible if at least one end is: allow for the block's width and the uncertainty of position.
    way = nearest - camera.pose[:2]
    aside = np.array([-way[1], way[0]]) / max(float(np.hypot(*way)), 1e-9)
    aside = aside * (maze.marker.radius + _DEVIATIONS * deviation)
    lens = nearest_free(maze, camera.pose[:2])
    ends = np.array([nearest, nearest + aside, nearest - aside])
    ends = np.array([nearest_free(maze, end) for end in ends])
    index = build_edge_index(maze.world)
    clear = are_clear(index, np.tile(lens, (3, 1)), ends).any()
    return Outcome.LOCATED if clear else Outcome.BEHIND_A_WALL


def nearest_free(maze: Maze, position: np.ndarray) -> np.ndarray:
    """The nearest point of the free region, shape (2,) [m].

    Args:
        maze: Its walls.
        position: Shape (2,) [m].
    """
    free = maze.world.polygon
    if shapely.contains_xy(free, *position):
        return position
    point = shapely.Point(*position)
    return shapely.get_coordinates(shapely.shortest_line(free, point))[0]


@dataclass(frozen=True, eq=False)
class Reading:
    """The pursuer's interpretation of a picture.

    Attributes:
        picture: The picture as it was posted.
        recognition: What it shows; `NOTHING` if the file is no valid picture.
        location: Where the evader was when it was taken, or why that is not known.
    """

    picture: Picture
    recognition: Recognition
    location: Location


def read_picture(
    picture: Picture, maze: Maze, references: References, method: str = "level"
) -> Reading:
    """Read a picture, whatever it holds.

    Args:
        picture: Picture from the network.
        maze: The map.
        references: References of the maze.
        method: Method of localisation.

    Raises:
        InvalidInput: No such method; an invalid picture never raises.
    """
    try:
        pixels = decode_picture(picture.data, maze.camera.width, maze.camera.height)
    except InvalidInput:
        return Reading(picture, NOTHING, no_location(Outcome.NO_PICTURE))
    recognition = recognise(pixels, references)
    return Reading(picture, recognition, locate_evader(recognition, maze, method))
