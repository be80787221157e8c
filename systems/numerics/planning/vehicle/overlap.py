"""How deep a moving vehicle reaches into walls, measured against the polygons themselves."""

import numpy as np

from ...geometry.world import World
from .footprint import Discs
from .free_distance import signed_distance


def deepest_overlap(world: World, discs: Discs, states: np.ndarray, between: int = 8) -> float:
    """Largest depth of a disc in a wall, negative: the least free distance [m].

    Args:
        world: The walls.
        discs: What the vehicle covers.
        states: Shape (n, 4), close enough together to be interpolated.
        between: How many places to look at from each state to the next.
    """
    places = np.arange(between * (len(states) - 1) + 1) / between
    fine = np.array([np.interp(places, np.arange(len(states)), column) for column in states.T])
    return float(
        max(
            discs.radii[k] - signed_distance(world, np.stack(discs.centre(k, fine), axis=1)).min()
            for k in range(len(discs))
        )
    )
