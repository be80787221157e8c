"""Calibration pictures, simulated or real: a shell at a known place in each."""

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from ...errors import InvalidInput, require, require_positive
from ...geometry.world import make_world
from ..omni_optics import OmniCamera
from ..ray_table import make_ray_table
from ..rendering import render
from ..sensor import Sensor, expose
from ..shells import Shell
from ..surroundings import Surroundings
from .pictures import require_contrast, require_size
from .readings import Readings
from .shell_colours import ShellColour
from .shell_detection import detect_shells

# How far beyond the farthest shell the walls of the simulated room are [m].
_ROOM = 2.0


class LabelledPicture(NamedTuple):
    """One calibration picture.

    Attributes:
        name: For messages, as a file's.
        distance: From the mirror's axis to the shell's near side [m].
        bearing: Of the shell from the robot's front, counter-clockwise [rad].
        picture: Red, green, blue, shape (height, width, 3), uint8.
    """

    name: str
    distance: float
    bearing: float
    picture: np.ndarray


def simulated_pictures(
    camera: OmniCamera,
    sensor: Sensor,
    shell: Shell,
    *,
    distances: Sequence[float],
    directions: int,
) -> Iterator[LabelledPicture]:
    """Take the pictures of 2.2.4.2 with a simulated camera in an empty room.

    Args:
        camera: The true optics.
        sensor: Quality of the pictures.
        shell: What is placed.
        distances: From the axis to the shell's near side [m].
        directions: Number of bearings, evenly round the robot from its front on.

    Raises:
        InvalidInput: No direction, or a distance is not positive.
    """
    require(directions > 0, "directions", "be positive", directions)
    for distance in distances:
        require_positive("distances", distance)
    half = max(distances) + 2 * shell.radius + _ROOM
    corners = [[-half, -half], [half, -half], [half, half], [-half, half]]
    room, rays = Surroundings(world=make_world(corners, [])), make_ray_table(camera)
    for row, distance in enumerate(distances):
        for column in range(directions):
            bearing = math.remainder(2 * math.pi * column / directions, 2 * math.pi)
            at = (distance + shell.radius) * np.array([[math.cos(bearing), math.sin(bearing)]])
            light = render(camera, rays, room, (0.0, 0.0, 0.0), [shell], at)
            picture = expose(sensor, light, row * directions + column)[:, :, :3]
            name = f"{1000 * distance:.1f}mm_{math.degrees(bearing):.2f}deg.png"
            yield LabelledPicture(name, distance, bearing, picture)


def read_pictures(
    pictures: Iterable[LabelledPicture], camera: OmniCamera, colour: ShellColour
) -> tuple[Readings, list[str]]:
    """Find the shell in each picture.

    Args:
        pictures: With known places.
        camera: Size of the pictures, and roughly where the mirror's axis is.
        colour: Of the shell.

    Returns:
        The readings, and a line "name: reason" for each picture without a whole shell in it.

    Raises:
        InvalidInput: A picture of another size or all one colour, or too few shells are found.
    """
    found, skipped = [], []
    for name, distance, bearing, picture in pictures:
        require_size(picture, camera.width, camera.height, name)
        require_contrast(picture, name)
        (detection,) = detect_shells(picture, [colour], camera.axis_pixel)
        if detection.outcome.has_estimate:
            found.append((distance, bearing, *detection.pixel))
        else:
            skipped.append(f"{name}: {detection.outcome.words}")
    if not found:
        reason = skipped[0] if skipped else "none at all"
        raise InvalidInput(f"`pictures` must show {colour.name} shells; got {reason}")
    table = np.array(found)
    readings = Readings(distance=table[:, 0], bearing=table[:, 1], pixels=table[:, 2:])
    return readings, skipped
