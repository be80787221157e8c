"""A combine's work over time: what it cuts when, where it is, and when a cart can be beside it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..field.combine_path import CombinePath
from ..field.pace.timeline import Timeline
from ..machines.alongside import ACROSS, ALONG, TURNED
from ..routes.lane import STEP, Lane

# Part of what an auger reaches that a plan counts on.
SURE = 0.8


@dataclass(frozen=True, eq=False)
class Work:
    """What one combine does if nothing holds it up but the other combines.

    After the last step it stands where it has finished.

    Attributes:
        step: Of time [s].
        grain: Cut up to the beginning of each step and the end of the last, shape (K + 1,) [kg].
        reachable: Whether a cart can be filled during each step, (K,).
        places: x, y at the same times as `grain`, shape (K + 1, 2) [m].
    """

    step: float
    grain: np.ndarray
    reachable: np.ndarray
    places: np.ndarray

    @property
    def done(self) -> int:
        """Number of the step before which the last grain is cut."""
        return int(np.searchsorted(self.grain, self.grain[-1] - 1e-9 * max(self.grain[-1], 1.0)))


def work_of(
    path: CombinePath,
    combine: int,
    timeline: Timeline,
    lanes: Sequence[Lane],
    reach: float,
    density: float,
    speed: float,
    step: float = 1.0,
) -> Work:
    """The work of a combine on a path.

    Args:
        path: Of the combine.
        combine: Its number.
        timeline: When it is where.
        lanes: Beside it.
        reach: From its middle to the lane [m].
        density: Of the crop [kg/m^2].
        speed: Of the combine [m/s].
        step: Of time [s].
    """
    end = timeline.clock[-1] / speed
    times = step * np.arange(int(np.ceil(end / step)) + 1)
    stations = timeline.station_at(combine, times * speed)
    middles = (stations[1:] + stations[:-1]) / 2
    stands = np.diff(stations) < 1e-9
    reachable = np.zeros(len(middles), dtype=bool)
    for lane in lanes:
        served = (middles >= lane.begin - 1e-6) & (middles <= lane.end + 1e-6)
        reachable[served] |= stands[served] | beside(path, lane, reach, middles[served])
    return Work(
        step=step,
        grain=density * path.area_cut(stations),
        reachable=reachable | (middles >= path.length - 1e-6),
        places=path.pose_at(stations)[:, :2],
    )


def beside(path: CombinePath, lane: Lane, reach: float, stations: np.ndarray) -> np.ndarray:
    """Whether a trailer at its place on a lane is where the auger pours, at stations (n,).

    Args:
        path: Of the combine.
        lane: Beside it.
        reach: Of the auger [m].
        stations: Of the combine, shape (n,) [m].
    """
    poses = path.pose_at(stations)
    slots = np.interp(stations, lane.stations, lane.slots)
    along = STEP * np.arange(len(lane.points))
    box = np.stack([np.interp(slots, along, column) for column in lane.points.T], axis=1)
    dx, dy = (box[:, :2] - poses[:, :2]).T
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    turned = np.abs(np.remainder(box[:, 2] - poses[:, 2] + np.pi, 2 * np.pi) - np.pi)
    return (
        (np.abs(c * dx + s * dy) <= SURE * ALONG)
        & (np.abs(c * dy - s * dx - reach) <= SURE * ACROSS)
        & (turned <= SURE * TURNED)
    )
