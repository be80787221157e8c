"""What a camera sees besides shells: floor, walls and the room above them."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..errors import require, require_finite, require_positive
from ..geometry.world import World

Colour = tuple[int, int, int]


@dataclass(frozen=True, kw_only=True)
class Surroundings:
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
    wall_height: float = 0.5
    # Side of the floor's square tiles [m].
    tile: float = 0.5
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
    light_heading: float = 0.9
    # What the sides facing away lose of it, in [0, 1).
    shading: float = 0.3

    def __post_init__(self) -> None:
        require_positive("wall_height", self.wall_height)
        require_positive("tile", self.tile)
        require_finite("light_heading", self.light_heading)
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
    def edges(self) -> np.ndarray:
        """Walls from above, x0 y0 x1 y1 with free space on the left, shape (k, 4) [m]."""
        rings = [np.hstack([ring, np.roll(ring, -1, axis=0)]) for ring in self.world.rings]
        return np.ascontiguousarray(np.concatenate(rings))

    @cached_property
    def palette(self) -> np.ndarray:
        """Rows: floor tiles (2), wall, wall top, room, robot, backdrop; shape (7, 3), 0 to 1."""
        return np.array([*self.floor, *self._others], dtype=np.float32) / 255
