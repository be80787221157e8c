"""What a camera sees: coloured shells on robots, floor, walls and the room above them.

Shells are upright cylinders that a camera tells apart by colour.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..checked import Checked, Finite, NonNegative, Positive
from ..errors import require
from ..geometry.world import World

# The shells of Figures 2.26 and 2.27, and others that differ from them in hue.
SHELL_COLOURS: dict[str, tuple[int, int, int]] = {
    "red": (205, 30, 35),
    "green": (30, 165, 60),
    "blue": (35, 70, 200),
    "yellow": (225, 200, 30),
    "magenta": (200, 40, 180),
}


@dataclass(frozen=True, kw_only=True)
class Shell(Checked):
    """A coloured upright cylinder around a robot.

    The defaults fit the testbed's robots, whose centres keep 0.16 m from obstacles, and which
    stand on wheels: the shell's bottom edge, to which ranges are measured, is above the floor.

    Raises:
        InvalidInput: A number is out of its range.
    """

    # Of the cylinder [m].
    radius: Positive = 0.1
    # Height of the bottom edge above the floor [m].
    base: NonNegative = 0.04
    # Height of the top edge above the floor [m].
    top: Positive = 0.2
    # Red, green and blue in full white light, each 0 to 255.
    colour: tuple[int, int, int] = SHELL_COLOURS["red"]

    def __post_init__(self) -> None:
        super().__post_init__()
        require(self.top > self.base, "top", f"be above the base, {self.base} m", self.top)
        require(len(self.colour) == 3, "colour", "be (red, green, blue)", self.colour)
        for value in self.colour:
            whole = isinstance(value, int) and not isinstance(value, bool)
            require(whole and 0 <= value <= 255, "colour", "hold whole numbers 0 to 255", value)


def shell_of(colour: str, **sizes: float) -> Shell:
    """A shell in a colour named in SHELL_COLOURS, with sizes [m] other than the defaults.

    Raises:
        InvalidInput: No shell has that colour, or a size is out of its range.
    """
    require(
        colour in SHELL_COLOURS, "colour", f"be one of {', '.join(SHELL_COLOURS)}", repr(colour)
    )
    return Shell(colour=SHELL_COLOURS[colour], **sizes)


Colour = tuple[int, int, int]


@dataclass(frozen=True, kw_only=True)
class Surroundings(Checked):
    """A world raised to walls of one height, and its colours under full white light.

    Walls are higher than the default camera's mirror, so that they hide all that is behind them:
    sight in pictures is then the plane's line of sight. Lower walls show their tops, and what is
    beyond them.

    Raises:
        InvalidInput: A number is out of its range.
    """

    # Free region; everything outside it is wall.
    world: World
    # Of all walls [m].
    wall_height: Positive = 0.5
    # Side of the floor's square tiles [m].
    tile: Positive = 0.5
    # Of the floor's tiles, in turn; equal colours make a plain floor.
    floor: tuple[Colour, Colour] = ((150, 150, 147), (138, 139, 141))
    # Of the walls' sides, facing the light.
    wall: Colour = (203, 196, 182)
    # Of the walls' tops.
    wall_top: Colour = (120, 118, 114)
    # Of the room above the walls.
    room: Colour = (226, 229, 233)
    # Of robots' tops and of what carries their shells.
    robot: Colour = (42, 43, 46)
    # Of what is beside the mirror in the picture.
    backdrop: Colour = (16, 16, 18)
    # Heading of the walls' and shells' sides that are lit best [rad].
    light_heading: Finite = 0.9
    # What the sides facing away lose of it, in [0, 1).
    shading: float = 0.3

    def __post_init__(self) -> None:
        super().__post_init__()
        require(0 <= self.shading < 1, "shading", "lie in [0, 1)", self.shading)
        for colour in (*self.floor, *self._others):
            require(
                len(colour) == 3 and all(0 <= value <= 255 for value in colour),
                "colours",
                "be (red, green, blue), each 0 to 255",
                colour,
            )

    @property
    def _others(self) -> tuple[Colour, ...]:
        return (self.wall, self.wall_top, self.room, self.robot, self.backdrop)

    @cached_property
    def palette(self) -> np.ndarray:
        """Rows: floor tiles (2), wall, wall top, room, robot, backdrop; shape (7, 3), 0 to 1."""
        return np.array([*self.floor, *self._others], dtype=np.float32) / 255
