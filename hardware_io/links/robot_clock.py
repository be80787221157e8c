"""A robot's clock, as far as a work station knows it: by the fastest of its late reports."""

import math
from collections import deque

# Over which the fastest report is sought, so that crystals may differ [s].
_WINDOW = 10.0
# A clock that goes on by another time than ours by more than this was set [s].
_SET = 1.0


class RobotClock:
    """How late each report of a robot is.

    The fastest report of the last seconds says by how much its clock is behind ours, and of the
    others by how much they were late: on the air, or before a busy machine took them.

    Args:
        settable: Whether the clock may be set, as that of a computer; a report that seems to be
            more than a second late begins anew then.
    """

    def __init__(self, *, settable: bool = False) -> None:
        self._settable = settable
        # When reports came, and their time on the way plus what the clock is behind [s].
        self._behind: deque[tuple[float, float]] = deque()

    @property
    def behind(self) -> float:
        """What the clock is behind ours, and the way of the fastest report [s]."""
        return min(each for _, each in self._behind)

    def late(self, came: float, stamp: float) -> float:
        """By how much a report is later than the fastest [s].

        Args:
            came: When it came, by time.monotonic [s].
            stamp: When it was made, by the robot's clock [s].
        """
        if not math.isfinite(stamp):
            return 0.0
        if self._behind and self._settable and came - stamp - self.behind > _SET:
            self._behind.clear()
        self._behind.append((came, came - stamp))
        while self._behind[0][0] < came - _WINDOW:
            self._behind.popleft()
        return came - stamp - self.behind
