"""What combines of a plan cut by when, and where carts may be beside them, without any cart."""

from dataclasses import dataclass

import numpy as np

from ..carts.cut_times import cut_times
from ..carts.tanks import TICK, make_tanks
from ..field.yield_map import YieldMap
from ..plan.combine_plan import CombinePlan

# Straight work that is shorter leaves no time beside a combine [m].
SHORTEST = 50.0


@dataclass(frozen=True, eq=False)
class WorkAhead:
    """A combine's work by its own clock, which stands while it waits for carts.

    Attributes:
        cut: All that it has cut at moments TICK apart, shape (T,) [kg].
        places: Where it is then, shape (T, 2) [m].
        opens: The first such moment from each on in which a cart may come beside it, or T; shape
            (T,).
        end: When it parks [s].
    """

    cut: np.ndarray
    places: np.ndarray
    opens: np.ndarray
    end: float


def work_ahead(team: CombinePlan, density: float | YieldMap) -> list[WorkAhead]:
    """The work of all combines of a plan.

    Args:
        team: Who drives where and when.
        density: Of the crop [kg/m^2].
    """
    cut = cut_times(team.field, team.size, team.paths)
    tanks = make_tanks(team.machines, cut, density, [timed.end for timed in team.paths])
    found = []
    for timed, tank in zip(team.paths, tanks, strict=True):
        stations = timed.station_at(tank.times)
        path = timed.path
        straight = path.cutting & (np.abs(path.curvatures) < 1e-6) & (path.lengths >= SHORTEST)
        if len(straight):
            beside = straight[path.piece_at(stations)] & (tank.times < timed.end)
        else:
            beside = np.zeros(len(stations), dtype=bool)
        following = np.where(beside, np.arange(len(beside)), len(beside))
        opens = np.minimum.accumulate(following[::-1])[::-1]
        found.append(WorkAhead(tank.cut, path.pose_at(stations)[:, :2], opens, timed.end))
    return found


def moment(time: float, work: WorkAhead) -> int:
    """Number of the moment at or before a time of a combine's own clock.

    Args:
        time: [s].
        work: Of the combine.
    """
    return int(min(max(time / TICK, 0.0), len(work.cut) - 1))
