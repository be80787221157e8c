"""Who waits for whom, in arrays, so that it can be asked in every step."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...compiled import compiled
from ..field.pace import Holds


class PackedHolds(NamedTuple):
    """Several `Holds`, one after the other.

    Attributes:
        pairs: Waiting combine and the other, shape (k, 2).
        starts: Where each one's rows begin, shape (k + 1,).
        stations: Where the one waits [m].
        needs: Until the other is at this station [m].
    """

    pairs: np.ndarray
    starts: np.ndarray
    stations: np.ndarray
    needs: np.ndarray


def pack_holds(holds: Sequence[Holds]) -> PackedHolds:
    """Holds in arrays."""
    pairs = np.array([(h.waiting, h.other) for h in holds], dtype=np.int64).reshape(-1, 2)
    starts = np.cumsum([0, *(len(h.stations) for h in holds)])
    empty = np.zeros(0)
    stations = np.concatenate([empty, *(h.stations for h in holds)])
    needs = np.concatenate([empty, *(h.needs for h in holds)])
    return PackedHolds(pairs, starts.astype(np.int64), stations, needs)


@compiled
def limits_of(holds, progress):
    """How far each combine may drive for now, shape (N,) -> (N,) [m]; see `station_limits`."""
    limits = np.full(len(progress), np.inf)
    for k in range(len(holds.pairs)):
        one, other = holds.pairs[k, 0], holds.pairs[k, 1]
        low, high = holds.starts[k], holds.starts[k + 1]
        index = np.searchsorted(holds.needs[low:high], progress[other] + 1e-9, side="right")
        if low + index < high:
            limits[one] = min(limits[one], holds.stations[low + index])
    return limits
