"""A combine that stops on its way and goes on later."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from ..paths.timed_path import TimedPath

# Duration of a stop that nothing comes after [s].
FOR_EVER = 1e6


class Stop(NamedTuple):
    """A wait of a combine for a cart.

    Attributes:
        combine: Its number.
        station: Where it stands [m].
        duration: How long [s].
    """

    combine: int
    station: float
    duration: float


def with_stop(plan: TimedPath, stop: Stop, acceleration: float) -> TimedPath:
    """A plan that stands for a while at a station, and is later from then on.

    It brakes and speeds up evenly; other machines are not looked at.

    Args:
        plan: Of the combine.
        stop: Which stop.
        acceleration: Of the combine [m/s^2].
    """
    fine = np.unique(np.concatenate([plan.times, np.arange(plan.times[0], plan.end, 0.05)]))
    at, speeds = plan.station_at(fine), plan.speed_at(fine)
    # Braking begins where the speed is the most that can still be lost, and likewise after it.
    allowed = np.sqrt(2 * acceleration * np.abs(at - stop.station))
    slow = np.flatnonzero(speeds > allowed)
    if len(slow) == 0:
        first, last = int(np.searchsorted(at, stop.station)), int(np.searchsorted(at, stop.station))
    else:
        first, last = int(slow[0]) - 1, int(slow[-1]) + 1
    first, last = max(first, 0), min(last, len(fine) - 1)
    way_in, way_out = stop.station - at[first], at[last] - stop.station
    time_in = 2 * way_in / speeds[first] if speeds[first] > 0 else 0.0
    time_out = 2 * way_out / speeds[last] if speeds[last] > 0 else 0.0
    stands = fine[first] + time_in
    goes = stands + stop.duration
    later = goes + time_out - fine[last]
    before, after = plan.times < fine[first], plan.times > fine[last]
    return TimedPath(
        plan.path,
        np.concatenate(
            [
                plan.times[before],
                [fine[first], stands, goes, fine[last] + later],
                plan.times[after] + later,
            ]
        ),
        np.concatenate(
            [
                plan.stations[before],
                [at[first], stop.station, stop.station, at[last]],
                plan.stations[after],
            ]
        ),
        np.concatenate(
            [plan.speeds[before], [speeds[first], 0.0, 0.0, speeds[last]], plan.speeds[after]]
        ),
    )


def retime_alone(
    plans: Sequence[TimedPath], accelerations: Sequence[float]
) -> Callable[[Sequence[Stop]], list[TimedPath]]:
    """Stops that delay the combine that stops, and no other.

    Args:
        plans: Of all combines, without stops.
        accelerations: Of the combines, shape (N,) [m/s^2].
    """

    def retime(stops: Sequence[Stop]) -> list[TimedPath]:
        after = list(plans)
        for stop in sorted(stops, key=lambda each: each.station):
            n = stop.combine
            after[n] = with_stop(after[n], stop, accelerations[n])
        return [ended(plan) for plan in after]

    return retime


def ended(plan: TimedPath, until: float = FOR_EVER) -> TimedPath:
    """A plan without what comes after some time, or after a stop that lasts for ever.

    Args:
        plan: Of the combine.
        until: The time [s].
    """
    kept = plan.times < until
    times, stations, speeds = plan.times[kept], plan.stations[kept], plan.speeds[kept]
    if not kept.all() and until < FOR_EVER:
        times = np.append(times, until)
        stations = np.append(stations, plan.station_at(until))
        speeds = np.append(speeds, plan.speed_at(until))
    return TimedPath(plan.path, times, stations, speeds)
