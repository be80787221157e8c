"""When a machine is where on its path: stations by time, with constant accelerations between."""

from dataclasses import dataclass

import numpy as np

from ...errors import require
from .machine_path import MachinePath


@dataclass(frozen=True, eq=False)
class TimedPath:
    """A path and the times at which it is driven.

    Between two of its times the acceleration along the path is constant; before the first the
    machine stands at the first station, after the last at the last.

    Attributes:
        path: Where.
        times: Never decreasing, shape (k,) [s].
        stations: At the times, never decreasing, shape (k,) [m].
        speeds: At the times, along the path whatever the gear, zero or positive, shape (k,) [m/s].

    Raises:
        InvalidInput: Shapes do not fit, or times or stations decrease.
    """

    path: MachinePath
    times: np.ndarray
    stations: np.ndarray
    speeds: np.ndarray

    def __post_init__(self) -> None:
        shape = self.times.shape
        require(len(shape) == 1 and len(self.times) > 0, "times", "be (k,)", shape)
        for name in ("stations", "speeds"):
            each = getattr(self, name).shape
            require(each == shape, name, f"have shape {shape}", each)
        for name in ("times", "stations"):
            require(bool((np.diff(getattr(self, name)) >= 0).all()), name, "never decrease", name)

    @property
    def end(self) -> float:
        """When it arrives [s]."""
        return float(self.times[-1])

    def station_at(self, times: np.ndarray | float) -> np.ndarray:
        """Stations at times, shape (...) [s] -> (...) [m]."""
        at = np.clip(np.asarray(times, dtype=float), self.times[0], self.times[-1])
        number, since = self._since(at)
        speed, acceleration = self.speeds[number], self._accelerations()[number]
        way = self.stations[number] + since * (speed + acceleration * since / 2)
        following = np.minimum(number + 1, len(self.stations) - 1)
        return np.clip(way, self.stations[number], self.stations[following])

    def speed_at(self, times: np.ndarray | float) -> np.ndarray:
        """Speeds along the path at times, shape (...) [s] -> (...) [m/s]."""
        asked = np.asarray(times, dtype=float)
        at = np.clip(asked, self.times[0], self.times[-1])
        number, since = self._since(at)
        speed = np.maximum(self.speeds[number] + self._accelerations()[number] * since, 0.0)
        return np.where((asked < self.times[0]) | (asked > self.times[-1]), 0.0, speed)

    def pose_at(self, times: np.ndarray | float) -> np.ndarray:
        """Poses at times, shape (...) [s] -> (..., 3) [m], [m], [rad]."""
        return self.path.pose_at(self.station_at(times))

    def _since(self, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        number = np.clip(np.searchsorted(self.times, at, side="right") - 1, 0, None)
        return number, at - self.times[number]

    def _accelerations(self) -> np.ndarray:
        lasting = np.diff(self.times)
        change = np.diff(self.speeds)
        rates = np.divide(change, lasting, out=np.zeros(len(change)), where=lasting > 0)
        return np.append(rates, 0.0)
