"""Whether robots are where they may be: on the floor, and not within one another."""

import numpy as np
import shapely

from ..geometry.world import World
from .reasons import Reason


class FloorWatch:
    """The floor of a world, for robots with radii.

    Args:
        world: The free region.
        radii: Of the robots, shape (N,) [m].
        slack: By how much a robot may be nearer to a wall, or to another, than its radius [m].
    """

    def __init__(self, world: World, radii: np.ndarray, slack: float) -> None:
        self._radii, self._slack = np.asarray(radii, dtype=float), slack
        self._free = [world.polygon.buffer(slack - radius) for radius in self._radii]
        for each in self._free:
            shapely.prepare(each)

    def breaches(self, places: np.ndarray) -> np.ndarray:
        """FENCE, SPACING or NONE of each robot, as numbers of Reason, shape (N,).

        Args:
            places: Of the centres, shape (N, 2) [m].
        """
        pairs = zip(self._free, places, strict=True)
        out = np.array([not shapely.intersects_xy(free, *place) for free, place in pairs])
        apart = np.hypot(*(places[:, np.newaxis] - places).transpose(2, 0, 1))
        gaps = apart - self._radii[:, np.newaxis] - self._radii
        np.fill_diagonal(gaps, np.inf)
        near = (gaps < -self._slack).any(axis=1)
        faults = np.where(out, Reason.FENCE, np.where(near, Reason.SPACING, Reason.NONE))
        return faults.astype(float)
