"""The way of one combine through a field."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np


@dataclass(frozen=True, eq=False)
class CombinePath:
    """Where a combine is after how much driving, and what it has cut by then.

    The reference point is the middle of the header, which is taken to be on the driven axle.

    Attributes:
        stations: Way driven, forwards and backwards, from 0 on, shape (n,) [m].
        points: Shape (n, 2) [m].
        headings: In (-pi, pi], shape (n,) [rad].
        gears: Of each piece: 1 forwards, with the header cutting; -1 backwards, with the header
            up; shape (n - 1,).
        cut_area: Crop newly cut on each piece, if all combines keep the plan's order, shape
            (n - 1,) [m^2].
        loops: Of each piece: number of the loop, in the order in which they are begun, that it
            works on; -1 on the way between two; shape (n - 1,).
        start_delay: Way that the first combine has driven when this one starts [m].
    """

    stations: np.ndarray
    points: np.ndarray
    headings: np.ndarray
    gears: np.ndarray
    cut_area: np.ndarray
    loops: np.ndarray
    start_delay: float

    @property
    def length(self) -> float:
        """Its last station [m]."""
        return float(self.stations[-1])

    @cached_property
    def _columns(self) -> np.ndarray:
        return np.column_stack([self.points, np.unwrap(self.headings)])

    @cached_property
    def _cut_before(self) -> np.ndarray:
        return np.concatenate([[0.0], np.cumsum(self.cut_area)])

    def with_stations(self, stations: np.ndarray) -> "CombinePath":
        """The same path with more points; nothing may have been cut on it yet."""
        extra = stations[np.abs(stations[:, None] - self.stations).min(axis=1) > 1e-6]
        at = np.unique(np.concatenate([self.stations, extra]))
        piece = self._piece_at(at[:-1])
        poses = self.pose_at(at)
        return CombinePath(
            at,
            poses[:, :2],
            poses[:, 2],
            self.gears[piece],
            np.zeros(len(piece)),
            self.loops[piece],
            self.start_delay,
        )

    def pose_at(self, stations: np.ndarray | float) -> np.ndarray:
        """Poses at stations, which are clipped to the path.

        Args:
            stations: Any shape (...) [m].

        Returns:
            x, y, theta, shape (..., 3) [m], [m], [rad]; theta is in (-pi, pi].
        """
        at = np.asarray(stations, dtype=float)
        poses = np.stack([np.interp(at, self.stations, c) for c in self._columns.T], axis=-1)
        poses[..., 2] = np.pi - np.remainder(np.pi - poses[..., 2], 2 * np.pi)
        return poses

    def area_cut(self, stations: np.ndarray | float) -> np.ndarray:
        """Area newly cut from the start on up to stations, shape (...) [m] -> (...) [m^2]."""
        return np.asarray(np.interp(stations, self.stations, self._cut_before))

    def gear_at(self, stations: np.ndarray | float) -> np.ndarray:
        """Gear on the piece that begins at or before each station, shape (...)."""
        return self.gears[self._piece_at(stations)]

    def loop_at(self, stations: np.ndarray | float) -> np.ndarray:
        """Number of the loop on the piece that begins at or before each station, shape (...)."""
        return self.loops[self._piece_at(stations)]

    def turn_at(self, stations: np.ndarray | float) -> np.ndarray:
        """Number of the loop worked on, or driven to, at each station, shape (...)."""
        return self._turns[self._piece_at(stations)]

    def end_of_turn(self, stations: np.ndarray | float) -> np.ndarray:
        """Station at which the loop is done that is worked on, or driven to, shape (...) [m]."""
        last = np.searchsorted(self._turns, self.turn_at(stations), side="right")
        return self.stations[last]

    @cached_property
    def _turns(self) -> np.ndarray:
        # On the way to a loop, the loop's number; after the last, one that is later than all.
        filled = np.where(self.loops < 0, np.iinfo(int).max, self.loops)
        return np.minimum.accumulate(filled[::-1])[::-1]

    def _piece_at(self, stations: np.ndarray | float) -> np.ndarray:
        piece = np.searchsorted(self.stations, stations, side="right") - 1
        return np.clip(piece, 0, len(self.gears) - 1)

    def alongside(
        self, reach: float | np.ndarray, stations: np.ndarray | float | None = None
    ) -> np.ndarray:
        """The lane on the left, where a cart drives while it is filled.

        Args:
            reach: From the combine's middle to the lane's, to the left; one or as many [m].
            stations: Of the combine, shape (...) [m]; None: the path's own.

        Returns:
            x, y, theta, shape (..., 3) [m], [m], [rad].
        """
        poses = self.pose_at(self.stations if stations is None else stations)
        poses[..., 0] -= reach * np.sin(poses[..., 2])
        poses[..., 1] += reach * np.cos(poses[..., 2])
        return poses
