"""Reading a picture of a friend's album: from bytes to a location."""

from dataclasses import dataclass

from ...errors import InvalidInput
from ..landmarks.maze import Maze
from ..network.interface import Picture
from ..recognition.picture_files import decode_picture
from ..recognition.recognition import NOTHING, Recognition, recognise
from ..recognition.references import References
from .location import Location, locate_evader, no_location
from .outcomes import Outcome


@dataclass(frozen=True, eq=False)
class Reading:
    """What the pursuer makes of a picture.

    Attributes:
        picture: As it was posted.
        recognition: What it shows; nothing if it is no picture.
        location: Where the evader was when it was taken, or why there is no telling.
    """

    picture: Picture
    recognition: Recognition
    location: Location


def read_picture(
    picture: Picture, maze: Maze, references: References, method: str = "level"
) -> Reading:
    """Read a picture, whatever it holds.

    Args:
        picture: Of the network.
        maze: The map.
        references: Of the maze.
        method: Of localisation.

    Raises:
        InvalidInput: No such method. Never because of the picture.
    """
    try:
        pixels = decode_picture(picture.data, maze.camera.width, maze.camera.height)
    except InvalidInput:
        return Reading(picture, NOTHING, no_location(Outcome.NO_PICTURE))
    recognition = recognise(pixels, references)
    return Reading(picture, recognition, locate_evader(recognition, maze, method))
