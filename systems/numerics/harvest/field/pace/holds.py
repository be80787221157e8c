"""Holds: stations beyond which a combine drives only when another has got far enough."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ....compiled import compiled


@dataclass(frozen=True, eq=False)
class Holds:
    """Stations beyond which one combine drives only when another has got far enough.

    Attributes:
        waiting: Number of the one.
        other: Number of the other.
        beside: Whether the crop is on the one's left; else it is in its way.
        stations: Of the one, never decreasing, shape (k,) [m].
        passed: Station at which the other cuts the crop there, shape (k,) [m].
        needs: Station that the other has to have reached, never decreasing, shape (k,) [m].
    """

    waiting: int
    other: int
    beside: bool
    stations: np.ndarray
    passed: np.ndarray
    needs: np.ndarray


class PackedHolds(NamedTuple):
    """Several `Holds`, one after the other.

    Attributes:
        pairs: Waiting combine and the other, shape (k, 2).
        starts: Where each one's rows begin, shape (k + 1,).
        stations: Where the one waits, shape (m,) [m].
        needs: Until the other is at this station, shape (m,) [m].
    """

    pairs: np.ndarray
    starts: np.ndarray
    stations: np.ndarray
    needs: np.ndarray


def pack_holds(holds: Sequence[Holds]) -> PackedHolds:
    """Holds in arrays, so that they can be asked in every step."""
    pairs = np.array([(h.waiting, h.other) for h in holds], dtype=np.int64).reshape(-1, 2)
    starts = np.cumsum([0, *(len(h.stations) for h in holds)])
    empty = np.zeros(0)
    stations = np.concatenate([empty, *(h.stations for h in holds)])
    needs = np.concatenate([empty, *(h.needs for h in holds)])
    return PackedHolds(pairs, starts.astype(np.int64), stations, needs)


def station_limits(holds: Sequence[Holds], progress: np.ndarray) -> np.ndarray:
    """How far each combine may drive for now, shape (combines,) -> (combines,) [m].

    Args:
        holds: Who waits for whom.
        progress: Stations now, shape (combines,) [m].
    """
    return limits_of(pack_holds(holds), np.asarray(progress, dtype=float))


@compiled
def limits_of(holds, progress):
    """The same of packed holds.

    Args:
        holds: Packed.
        progress: Stations now, shape (combines,) [m].
    """
    limits = np.full(len(progress), np.inf)
    for k in range(len(holds.pairs)):
        one, other = holds.pairs[k, 0], holds.pairs[k, 1]
        low, high = holds.starts[k], holds.starts[k + 1]
        index = np.searchsorted(holds.needs[low:high], progress[other] + 1e-9, side="right")
        if low + index < high:
            limits[one] = min(limits[one], holds.stations[low + index])
    return limits
