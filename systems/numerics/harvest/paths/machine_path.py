"""Where a machine drives: poses in order, between which it moves by constant twists."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...errors import require

# The number of work of what is driven between two pieces of work.
TRANSIT = -1


@dataclass(frozen=True, eq=False)
class MachinePath:
    """Poses of a machine's reference point, in the order in which it drives through them.

    From one pose to the next the machine moves by a constant twist, along an arc or a straight. The
    reference point is the middle of a combine's header, which is taken to be on its driven axle,
    and the middle of a tractor's rear axle.

    Attributes:
        poses: x, y, theta, shape (n, 3) [m], [m], [rad]; theta is continuous, not wrapped.
        gears: Of each piece: 1 forwards, -1 backwards; shape (n - 1,).
        cutting: Whether the header is down on each piece, shape (n - 1,).
        work: Number of the piece of work that each piece belongs to, or TRANSIT; shape (n - 1,).

    Raises:
        InvalidInput: Shapes do not fit.
    """

    poses: np.ndarray
    gears: np.ndarray
    cutting: np.ndarray
    work: np.ndarray

    def __post_init__(self) -> None:
        shape = self.poses.shape
        require(
            len(shape) == 2 and shape[1] == 3 and len(self.poses) > 0, "poses", "be (n, 3)", shape
        )
        for name in ("gears", "cutting", "work"):
            each = getattr(self, name).shape
            require(each == (len(self.poses) - 1,), name, "be (n - 1,)", each)

    @cached_property
    def lengths(self) -> np.ndarray:
        """Way driven on each piece, shape (n - 1,) [m]."""
        chords = np.hypot(*np.diff(self.poses[:, :2], axis=0).T)
        half = np.diff(self.poses[:, 2]) / 2
        # np.sinc(x) is sin(pi x) / (pi x).
        return chords / np.sinc(half / np.pi)

    @cached_property
    def stations(self) -> np.ndarray:
        """Way driven up to each pose, forwards and backwards, shape (n,) [m]."""
        return np.concatenate([[0.0], np.cumsum(self.lengths)])

    @property
    def length(self) -> float:
        """Way driven in all [m]."""
        return float(self.stations[-1])

    @cached_property
    def curvatures(self) -> np.ndarray:
        """Change of heading per way driven on each piece, shape (n - 1,) [1/m]."""
        turned = np.diff(self.poses[:, 2])
        return np.divide(turned, self.lengths, out=np.zeros(len(turned)), where=self.lengths > 0)

    @cached_property
    def cusps(self) -> np.ndarray:
        """Stations at which the gear changes, shape (c,) [m]."""
        return self.stations[1:-1][np.diff(self.gears) != 0]

    def piece_at(self, stations: np.ndarray | float) -> np.ndarray:
        """Number of the piece that begins at or before each station, shape (...)."""
        piece = np.searchsorted(self.stations, stations, side="right") - 1
        return np.clip(piece, 0, max(len(self.lengths) - 1, 0))

    def pose_at(self, stations: np.ndarray | float) -> np.ndarray:
        """Poses at stations, which are clipped to the path.

        Args:
            stations: Shape (...) [m].

        Returns:
            x, y, theta, shape (..., 3) [m], [m], [rad]; theta is not wrapped.
        """
        at = np.clip(np.asarray(stations, dtype=float), 0.0, self.length)
        if len(self.poses) == 1:
            return np.broadcast_to(self.poses[0], (*at.shape, 3)).copy()
        piece = self.piece_at(at)
        length = self.lengths[piece]
        driven = at - self.stations[piece]
        share = np.divide(driven, length, out=np.zeros(at.shape), where=length > 0)
        begin, end = self.poses[piece], self.poses[piece + 1]
        turned = end[..., 2] - begin[..., 2]
        along = np.arctan2(end[..., 1] - begin[..., 1], end[..., 0] - begin[..., 0])
        # The chord of a part of an arc: its direction leans as far as the rest of the arc turns.
        direction = along - turned * (1 - share) / 2
        chord = driven * np.sinc(turned * share / (2 * np.pi))
        return np.stack(
            [
                begin[..., 0] + chord * np.cos(direction),
                begin[..., 1] + chord * np.sin(direction),
                begin[..., 2] + share * turned,
            ],
            axis=-1,
        )

    def stations_every(self, spacing: float) -> np.ndarray:
        """Evenly spaced stations from the first to the last, no farther apart than told.

        Args:
            spacing: [m].
        """
        count = max(1, int(np.ceil(self.length / spacing - 1e-9)))
        return np.linspace(0.0, self.length, count + 1)


def join_paths(paths: Sequence[MachinePath]) -> MachinePath:
    """Paths of which each begins where the one before it ends, as one.

    Args:
        paths: At least one; a heading may differ from the one before by whole turns.

    Raises:
        InvalidInput: There is none, or a path begins elsewhere.
    """
    require(len(paths) > 0, "paths", "be at least one", len(paths))
    poses = [paths[0].poses]
    last = paths[0].poses[-1]
    for path in paths[1:]:
        first = path.poses[0]
        turns = np.round((last[2] - first[2]) / (2 * np.pi))
        turned = path.poses + np.array([0.0, 0.0, 2 * np.pi * turns])
        apart = float(np.abs(turned[0] - last).max())
        require(apart < 1e-6, "paths", "begin where the one before ends", f"{apart:.3g} away")
        poses.append(turned[1:])
        last = turned[-1]
    columns = [
        np.concatenate([getattr(path, name) for path in paths])
        for name in ("gears", "cutting", "work")
    ]
    return MachinePath(np.concatenate(poses), *columns)
