"""What a work station works out of what its robots report.

That is, how their link does, how late their clocks make their reports, and what their encoders
would count where they tell only where they are.
"""

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median

from ...systems.numerics.station.motion_checks import Chassis
from .robot_link import LinkHealth

# Counts of robots go round.
_MODULUS = 1 << 16

# Robots' reports over which the quality of a link is taken, and round trips averaged.
_WINDOW = 25
# Frames whose times of sending are kept: half a minute at 30 a second.
_KEPT = 1024
# A link that has been silent for longer has no quality [s].
_SILENCE = 1.0
# What round trips differ by without a reason [s].
_JITTER = 0.01


@dataclass(frozen=True)
class Progress:
    """What a robot says of the messages to it.

    Attributes:
        robot: Its number.
        session: Of the last message that it took.
        last_sequence: Its sequence number.
        hold: Since it was taken [ms].
        taken: How many it has taken, modulo 65536.
    """

    robot: int
    session: int
    last_sequence: int
    hold: int
    taken: int


class LinkRecord:
    """Counts, for one link; its owner sees to it that calls do not overlap.

    Attributes:
        sent, acknowledged, retried, lost, received, refused, rssi: As in LinkHealth.

    Args:
        robots: Their numbers.
    """

    def __init__(self, robots: Sequence[int]) -> None:
        self.sent = self.acknowledged = self.retried = self.lost = 0
        self.received = self.refused = 0
        self.rssi: int | None = None
        self._addressed = dict.fromkeys(robots, 0)
        self._sendings: dict[tuple[int, int], tuple[float, dict[int, int]]] = {}
        self._round_trips: deque[float] = deque(maxlen=_WINDOW)
        # Of each robot's reports: when, frames sent up to the one it took last, frames taken.
        self._progress: dict[int, deque[tuple[float, int, int]]] = {
            robot: deque(maxlen=_WINDOW) for robot in robots
        }

    def note_sent(self, session: int, sequence: int, robot: int | None, time: float) -> None:
        """A frame went to a robot, or to all.

        Args:
            session, sequence: Of the frame.
            robot: Its number; None: all.
            time: Now [s].
        """
        self.sent += 1
        for each in self._addressed if robot is None else (robot,):
            self._addressed[each] = self._addressed.get(each, 0) + 1
        self._sendings[session, sequence] = (time, dict(self._addressed))
        if len(self._sendings) > _KEPT:
            del self._sendings[next(iter(self._sendings))]

    def note_progress(self, progress: Progress, time: float) -> float:
        """A robot tells which frame it took last, and how many.

        Args:
            progress: What it tells.
            time: Now [s].

        Returns:
            How much longer this round trip took than they usually do [s]: a report that waited for
            a busy machine is older than it seems.
        """
        sending = self._sendings.get((progress.session, progress.last_sequence))
        if sending is None or progress.robot not in self._progress:
            return 0.0
        trip = max(time - sending[0] - 1e-3 * progress.hold, 0.0)
        self._round_trips.append(trip)
        sent = sending[1][progress.robot]
        self._progress[progress.robot].append((time, sent, progress.taken))
        return max(trip - median(self._round_trips) - _JITTER, 0.0)

    def health(self, now: float) -> LinkHealth:
        """What is known at a time [s].

        Args:
            now: The time [s].
        """
        trips = self._round_trips
        return LinkHealth(
            sent=self.sent,
            acknowledged=self.acknowledged,
            retried=self.retried,
            lost=self.lost,
            received=self.received,
            refused=self.refused,
            rssi=self.rssi,
            round_trip=sum(trips) / len(trips) if trips else None,
            quality=tuple(self._quality(robot, now) for robot in self._progress),
        )

    def _quality(self, robot: int, now: float) -> float:
        """Frames taken over frames sent, from the oldest report that is kept to the newest."""
        progress = self._progress[robot]
        if len(progress) < 2 or now - progress[-1][0] > _SILENCE:
            return 0.0
        (_, first_sent, first_taken), (_, last_sent, last_taken) = progress[0], progress[-1]
        sent, taken = last_sent - first_sent, (last_taken - first_taken) % _MODULUS
        return min(taken / sent, 1.0) if sent > 0 else 0.0


# Over which the fastest report is sought, so that crystals may differ [s].
_CLOCK_WINDOW = 10.0
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
        # When reports came, and their time on the way plus what the clock is behind [s]; without
        # those that a later one was faster than, so that the first is the fastest.
        self._behind: deque[tuple[float, float]] = deque()

    @property
    def behind(self) -> float:
        """What the clock is behind ours, and the way of the fastest report [s]."""
        return self._behind[0][1]

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
        while self._behind and self._behind[-1][1] >= came - stamp:
            self._behind.pop()
        self._behind.append((came, came - stamp))
        while self._behind[0][0] < came - _CLOCK_WINDOW:
            self._behind.popleft()
        return came - stamp - self.behind


# Wheels do not go further between two reports; a pose that jumps was started anew [m].
_FURTHEST = 0.5


class OdometryCounts:
    """Counts of two wheels, made of poses one after the other.

    Args:
        chassis: The wheels.
    """

    def __init__(self, chassis: Chassis) -> None:
        self._chassis, self._ways = chassis, [0.0, 0.0]
        self._pose: tuple[float, float, float] | None = None

    def begin_anew(self) -> None:
        """Count nothing between the last pose and the next."""
        self._pose = None

    def after(self, x: float, y: float, heading: float) -> tuple[int, int]:
        """Counts of the left and the right wheel when the robot has come to a pose.

        Args:
            x, y: Of it [m].
            heading: Of it [rad].
        """
        if self._pose is not None:
            last_x, last_y, last_heading = self._pose
            # On the arc from one pose to the next, as `wheel_ways` has it for many.
            turn = math.remainder(heading - last_heading, math.tau)
            middle = last_heading + 0.5 * turn
            ahead = (x - last_x) * math.cos(middle) + (y - last_y) * math.sin(middle)
            across = 0.5 * self._chassis.track_width * turn
            for wheel, step in enumerate((ahead - across, ahead + across)):
                if abs(step) < _FURTHEST:
                    self._ways[wheel] += step
        self._pose = (x, y, heading)
        left, right = (round(self._chassis.counts_per_metre * way) for way in self._ways)
        return left, right
