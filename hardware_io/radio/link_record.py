"""What a work station knows of its radio link: what was sent, what came back, how long it took."""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median

from .messages import MODULUS, Telemetry

# Robots' reports over which the quality of a link is taken, and round trips averaged.
_WINDOW = 25
# Frames whose times of sending are kept: half a minute at 30 a second.
_KEPT = 1024
# A link that has been silent for longer has no quality [s].
_SILENCE = 1.0
# What round trips differ by without a reason [s].
_JITTER = 0.01


@dataclass(frozen=True)
class LinkStatistics:
    """Of a radio link since it was opened.

    Attributes:
        sent: Frames handed to the module.
        acknowledged: Stops and arms that a robot has acknowledged, counted for every robot, and
            frames to a single robot that its module has acknowledged.
        retried: Stops and arms sent again.
        lost: Stops and arms that a robot never acknowledged in time, and frames to a single robot
            that its module did not acknowledge.
        received: Frames from robots.
        refused: Payloads that were none.
        rssi: Of the last payload [dBm], None before the first.
        round_trip: Mean of the last ones, without the time a robot held the answer [s]; None before
            the first.
        quality: Part of the frames sent to each robot lately that it has taken, 0 to 1, in the
            order of the link's robots; 0 where none has been heard for a second.
    """

    sent: int
    acknowledged: int
    retried: int
    lost: int
    received: int
    refused: int
    rssi: int | None
    round_trip: float | None
    quality: tuple[float, ...]


class LinkRecord:
    """Counts, for one link; its owner sees to it that calls do not overlap.

    Attributes:
        sent, acknowledged, retried, lost, received, refused, rssi: As in LinkStatistics.

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

    def note_telemetry(self, telemetry: Telemetry, time: float) -> float:
        """A robot tells which frame it took last, and how many.

        Args:
            telemetry: What it tells.
            time: Now [s].

        Returns:
            How much longer this round trip took than they usually do [s]: a report that waited for
            a busy machine is older than it seems.
        """
        sending = self._sendings.get((telemetry.session, telemetry.last_sequence))
        if sending is None or telemetry.robot not in self._progress:
            return 0.0
        trip = max(time - sending[0] - 1e-3 * telemetry.hold, 0.0)
        self._round_trips.append(trip)
        sent = sending[1][telemetry.robot]
        self._progress[telemetry.robot].append((time, sent, telemetry.taken))
        return max(trip - median(self._round_trips) - _JITTER, 0.0)

    def statistics(self, now: float) -> LinkStatistics:
        """What is known at a time [s].

        Args:
            now: The time [s].
        """
        trips = self._round_trips
        return LinkStatistics(
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
        sent, taken = last_sent - first_sent, (last_taken - first_taken) % MODULUS
        return min(taken / sent, 1.0) if sent > 0 else 0.0
