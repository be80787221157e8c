"""The 8 ft x 8 ft maze of Zhang 2014, 2.3.4, with obstacles of our own: its figure is no plan."""

from ...geometry.world import make_world
from .hanging import hang_landmarks
from .maze import Maze

FOOT = 0.3048
SIDE = 8 * FOOT
LANDMARKS = 13


def thesis_maze() -> Maze:
    """The maze with its thirteen landmarks.

    Passages are at least 0.35 m wide: two robots of 0.1 m radius cannot pass each other
    everywhere, but each can go everywhere.
    """
    obstacles = [
        # An angle, a spur from the north wall, a short wall, a block and a wedge.
        [[0.5, 1.5], [1.0, 1.5], [1.0, 1.6], [0.6, 1.6], [0.6, 1.95], [0.5, 1.95]],
        [[1.3, 1.9], [1.4, 1.9], [1.4, SIDE], [1.3, SIDE]],
        [[1.8, 1.25], [1.9, 1.25], [1.9, 1.75], [1.8, 1.75]],
        [[1.4, 0.5], [1.8, 0.5], [1.8, 0.85], [1.4, 0.85]],
        [[0.5, 0.45], [0.95, 0.6], [0.6, 0.95]],
    ]
    world = make_world([[0, 0], [SIDE, 0], [SIDE, SIDE], [0, SIDE]], obstacles)
    return Maze(world=world, landmarks=hang_landmarks(world, LANDMARKS))
