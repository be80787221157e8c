"""What tanks hold over time, as combines cut and carts take grain over."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...compiled import kernel
from ..field.yield_map import YieldMap, grain_on_cells
from ..machines import Combine
from .cart_plan import CartVisit
from .cut_times import CELL, CutTimes

# Time between moments at which loads are known; between them they are linear [s].
TICK = 1.0
# How long at most a cart stays beside an empty tank to take the last grain of its combine [s].
LAST_GRAIN = 45.0
# A tank of which less is left is empty [kg].
EMPTY = 1.0


@dataclass(frozen=True, eq=False)
class Pour:
    """What an auger delivers in one visit.

    Attributes:
        begin, end: [s].
        taken: [kg].
    """

    begin: float
    end: float
    taken: float


class Tank:
    """What one combine has cut over time, and what is in its tank.

    Args:
        combine: The combine.
        times: Moments TICK apart from 0 on, shape (T,) [s].
        cut: All that was cut until then, shape (T,) [kg].

    Attributes:
        times: As given, shape (T,) [s].
        cut: As given, shape (T,) [kg].
        load: In the tank, after all visits that have been accounted for, shape (T,) [kg].
    """

    def __init__(self, combine: Combine, times: np.ndarray, cut: np.ndarray):
        self._combine = combine
        self.times, self.cut, self.load = times, cut, cut.copy()

    @property
    def capacity(self) -> float:
        """Of the tank [kg]."""
        return self._combine.capacity

    def full_at(self) -> float:
        """The first moment at which it is full; infinite if there is none [s]."""
        over = np.flatnonzero(self.load >= self._combine.capacity)
        return float(self.times[over[0]]) if len(over) else np.inf

    def pour(self, begin: float, latest: float, room: float) -> Pour:
        """What a cart takes from `begin` until the tank is empty, the cart is full, or `latest`.

        Args:
            begin, latest: When it comes, and when it has to leave [s].
            room: In the cart [kg].
        """
        # Grain that later visits take, which are planned already, is not available to this one.
        spare = np.minimum.accumulate(self.load[::-1])[::-1]
        lasting = np.append(np.arange(0.0, min(latest - begin, 3600.0), TICK / 2), latest - begin)
        lasting = lasting[np.isfinite(lasting)]
        gone = self._combine.unload_rate * lasting
        there = np.maximum(np.interp(begin + lasting, self.times, spare), 0.0)
        done = np.flatnonzero((gone >= there) | (gone >= room))
        if len(done):
            k = int(done[0])
            pour = Pour(begin, begin + float(lasting[k]), float(min(there[k], room)))
        else:
            pour = Pour(begin, begin + float(lasting[-1]), float(gone[-1]))
        return self._to_the_last(pour, latest, room)

    def _to_the_last(self, pour: Pour, latest: float, room: float) -> Pour:
        """The same visit, or, if the combine will soon have done its work, one that takes all.

        A visit that ends while the last grain is cut, and cannot be extended, leaves what is cut
        in that moment, and a little more, to another one: for less no cart would come.
        """
        # What is cut last has to flow too.
        end = float(self.times[np.searchsorted(self.cut, self.cut[-1])]) + TICK
        longer, more = end - pour.end, self.left - pour.taken
        if longer <= 0.0:
            return pour
        soon = longer <= LAST_GRAIN and end <= latest and self.left <= room
        if soon and 0.0 <= more <= self._combine.unload_rate * longer:
            return Pour(pour.begin, end, self.left)
        if more <= EMPTY:
            last = self.cut[-1] - float(np.interp(pour.end - TICK, self.times, self.cut))
            taken = self.left - last - 2 * EMPTY
            return replace(pour, taken=taken) if taken > 0.0 else Pour(pour.begin, pour.begin, 0.0)
        return pour

    def take(self, pour: "Pour | CartVisit") -> None:
        """Subtract from the load what a visit takes."""
        share = np.clip((self.times - pour.begin) / max(pour.end - pour.begin, 1e-9), 0.0, 1.0)
        # The last moment stands for all that come after it.
        share[-1] = 1.0
        self.load = self.load - pour.taken * share

    @property
    def left(self) -> float:
        """In the tank at the end [kg]."""
        return float(self.load[-1])


def make_tanks(
    combines: Sequence[Combine], cut: CutTimes, density: float | YieldMap, ends: Sequence[float]
) -> list[Tank]:
    """Make a tank for each combine.

    Args:
        combines: The combines.
        cut: When and by whom the ground is cut.
        density: Of the crop [kg/m^2].
        ends: When each combine has done its work [s].
    """
    end = max(ends, default=0.0)
    times = np.arange(0.0, end + 2 * TICK, TICK)
    comes = np.zeros((len(ends), len(times)))
    there = grain_on_cells(density, cut.corner, CELL, cut.times.shape)
    _add_cells(cut.times, cut.cutter, there, comes)
    each = zip(combines, np.cumsum(comes, axis=1), strict=True)
    return [Tank(combine, times, cut_by_then) for combine, cut_by_then in each]


@kernel
def _add_cells(times, cutter, there, comes):
    """Add the grain of cells that each combine cuts between two moments to the later one."""
    rows, columns = times.shape
    for row in range(rows):
        for column in range(columns):
            if cutter[row, column] >= 0:
                k = math.ceil(times[row, column] / TICK)
                if k < comes.shape[1]:
                    comes[cutter[row, column], k] += there[row, column]
