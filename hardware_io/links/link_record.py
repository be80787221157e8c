"""Quantities that a work station derives from its robots' reports.

These are the quality of the link, the delay of each report by the robot's clock, and encoder counts
of robots that report only their poses.
"""

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median

from ...systems.numerics.station.motion_checks import Chassis
from .robot_link import LinkHealth

# Robots' counts of messages wrap around.
_MODULUS = 1 << 16

# Number of reports over which the quality of a link and its round-trip time are averaged.
_WINDOW = 25
# Frames whose times of sending are kept: half a minute at 30 a second.
_KEPT = 1024
# A link that has been silent for longer has no quality [s].
_SILENCE = 1.0
# Normal variation of round trips, which does not count as delay [s].
_JITTER = 0.01


@dataclass(frozen=True)
class Progress:
    """What a robot reports about the messages sent to it.

    Attributes:
        robot: Number of the robot.
        session: Session of the last message that it took.
        last_sequence: Sequence number of that message.
        hold: Time since it took that message [ms].
        taken: How many messages it has taken, modulo 65536.
    """

    robot: int
    session: int
    last_sequence: int
    hold: int
    taken: int


class LinkRecord:
    """Statistics of one link; not thread-safe, its owner must lock.

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
        # Of each robot's reports: time, frames sent up to the last one it took, frames taken.
        self._progress: dict[int, deque[tuple[float, int, int]]] = {
            robot: deque(maxlen=_WINDOW) for robot in robots
        }

    def note_sent(self, session: int, sequence: int, robot: int | None, time: float) -> None:
        """Take note of a frame that was sent to a robot, or to all.

        Args:
            session, sequence: Session and sequence number of the frame.
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
        """Take note of which frame a robot took last, and how many it has taken.

        Args:
            progress: What it reports.
            time: Now [s].

        Returns:
            How much longer than usual this round trip took [s]: a report that waited for a busy
            machine is older than it seems.
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
        """Health of the link at a time [s].

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
        """Ratio of frames taken to frames sent, between the oldest and newest kept report."""
        progress = self._progress[robot]
        if len(progress) < 2 or now - progress[-1][0] > _SILENCE:
            return 0.0
        (_, first_sent, first_taken), (_, last_sent, last_taken) = progress[0], progress[-1]
        sent, taken = last_sent - first_sent, (last_taken - first_taken) % _MODULUS
        return min(taken / sent, 1.0) if sent > 0 else 0.0


# The fastest report of this window is the reference, so that clocks may drift [s].
_CLOCK_WINDOW = 10.0
# A report that seems later than this means that a settable clock was set [s].
_SET = 1.0


class RobotClock:
    """Estimates how late each report of a robot is.

    The fastest report of the last seconds gives the offset of the robot's clock from ours. Relative
    to it the other reports were late: on the air, or waiting for a busy machine.

    Args:
        settable: Whether the clock may be set, like a computer's; if so, a report that seems more
            than a second late restarts the estimate.
    """

    def __init__(self, *, settable: bool = False) -> None:
        self._settable = settable
        # Arrival time of reports, and their delay plus clock offset [s]. A report is dropped when a
        # later one is faster, so that the first is the fastest of the window.
        self._behind: deque[tuple[float, float]] = deque()

    @property
    def behind(self) -> float:
        """How far the clock is behind ours, plus the delay of the fastest report [s]."""
        return self._behind[0][1]

    def late(self, came: float, stamp: float) -> float:
        """Take note of a report; returns its delay relative to the fastest one [s].

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


# A wheel cannot go further between two reports; a larger step is a reset, and not counted [m].
_FURTHEST = 0.5


class OdometryCounts:
    """Encoder counts of two wheels, computed from successive poses.

    Args:
        chassis: Track width and counts per metre.
    """

    def __init__(self, chassis: Chassis) -> None:
        self._chassis, self._ways = chassis, [0.0, 0.0]
        self._pose: tuple[float, float, float] | None = None

    def begin_anew(self) -> None:
        """Count nothing between the last pose and the next."""
        self._pose = None

    def after(self, x: float, y: float, heading: float) -> tuple[int, int]:
        """Return the counts of the left and the right wheel after the robot moved to a pose.

        Args:
            x, y: Position [m].
            heading: Heading [rad].
        """
        if self._pose is not None:
            last_x, last_y, last_heading = self._pose
            # Along the arc from the last pose to this one, as in `wheel_ways`.
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
