"""The evader's position, with a realistic covariance, from a picture of a friend's album."""

import math
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
import shapely

from ...errors import InvalidInput, require_one_of
from ...geometry.edge_index import build_edge_index
from ...geometry.segment_sight import are_clear
from ..landmarks.maze import Maze
from ..network.interface import Picture
from ..recognition.picture_files import decode_picture
from ..recognition.recognition import NOTHING, Recognition, Stance, recognise
from ..recognition.references import References
from .camera_pose import CameraPose, camera_poses
from .perspective import slopes
from .relative import METHODS, EvaderPlace, evader_place


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
