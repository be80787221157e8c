"""One estimate of each evader from the pictures of all pursuers, kept while nobody sees it.

The evader's position is a random walk whose step is bounded by its speed, so the estimate is a
Kalman filter with the position alone as its state: between measurements it stays where it is and
grows less certain.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from ..geometry.world import World

# A measurement further off than this many standard deviations is a mistake, and left out. While
# measurements are left out the estimate grows less certain, until they are believed again.
GATE = 4.0
# An evader keeps its way for about this many pictures: its steps add up further than at random.
PERSISTENCE = 4.0


@dataclass(frozen=True, eq=False)
class Tracks:
    """What is known of m evaders.

    Attributes:
        positions: Shape (m, 2) [m]; NaN for an evader that was never seen.
        covariances: Shape (m, 2, 2) [m^2].
    """

    positions: np.ndarray
    covariances: np.ndarray

    @property
    def known(self) -> np.ndarray:
        """Which evaders have been seen at all, shape (m,)."""
        return ~np.isnan(self.positions[:, 0])


def no_tracks(count: int) -> Tracks:
    """Nothing is known of any evader.

    Args:
        count: Number of evaders.
    """
    return Tracks(np.full((count, 2), np.nan), np.zeros((count, 2, 2)))


def predict(tracks: Tracks, speed: float, step: float) -> Tracks:
    """Let time pass.

    Args:
        tracks: Before.
        speed: Of the evaders, at most [m/s].
        step: How long [s].
    """
    growth = PERSISTENCE * (speed * step) ** 2 * np.eye(2)
    return Tracks(tracks.positions, tracks.covariances + growth)


def correct(
    tracks: Tracks, valid: np.ndarray, positions: np.ndarray, covariances: np.ndarray
) -> Tracks:
    """Take in one camera's measurements.

    Args:
        tracks: Before.
        valid: Which evaders it measured, shape (m,), bool.
        positions: Where it puts them, shape (m, 2) [m].
        covariances: How sure it is, shape (m, 2, 2) [m^2].
    """
    means, spreads = tracks.positions.copy(), tracks.covariances.copy()
    known = tracks.known
    for j in np.flatnonzero(valid):
        if not known[j]:
            means[j], spreads[j] = positions[j], covariances[j]
            continue
        surprise, scatter = positions[j] - means[j], spreads[j] + covariances[j]
        weighted = np.linalg.solve(scatter, np.column_stack([surprise, spreads[j]]))
        if surprise @ weighted[:, 0] > GATE**2:
            continue
        means[j] = means[j] + spreads[j] @ weighted[:, 0]
        spread = spreads[j] - spreads[j] @ weighted[:, 1:]
        spreads[j] = 0.5 * (spread + spread.T)
    return Tracks(means, spreads)


class Whereabouts:
    """Where an evader can be, and where it is put that has never been seen."""

    def __init__(self, regions: Sequence[World]):
        self._free = shapely.union_all([region.polygon for region in regions])
        shapely.prepare(self._free)
        west, south, east, _ = self._free.bounds
        self._nowhere = np.array([west - (east - west), south - (east - west)])

    def places(self, tracks: Tracks) -> np.ndarray:
        """Positions for whoever asks where the evaders are, shape (m, 2) [m].

        An estimate inside a wall is moved to the nearest place where an evader can be. One that
        was never seen is put outside the world, from where nothing is in sight.
        """
        places = np.where(tracks.known[:, None], tracks.positions, self._nowhere)
        for j in np.flatnonzero(tracks.known):
            point = shapely.Point(places[j])
            if not self._free.contains(point):
                nearest = shapely.shortest_line(self._free, point).coords[0]
                places[j] = nearest
        return places
