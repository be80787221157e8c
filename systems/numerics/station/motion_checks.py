"""Whether robots move as they are told, and their encoders see what the motion capture sees.

Both are compared as ways of the wheels. The motion that a command leads to is predicted by a delay
of two ticks and a first-order lag; a robot whose pose stands still while it should have gone some
centimetres does not follow. After a late tick the prediction starts from rest, as robots stop by
themselves when they are told nothing. Encoders and motion capture are compared by their ways
between two reports, at the moments of measurement, however late ticks are. What one has gone beyond
the other and beyond slip is added up, in either sense (a two-sided CUSUM test, Page, Biometrika 41,
1954). Slip grows with the way, but errors by delay do not: a moment that is off adds to one
difference what it takes from the next, so that only the first and the last moment count, each with
what the wheel turns in the time by which it is off. So a dead encoder is noticed after some
centimetres of way, however slow the robot is.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..checked import Checked, NonNegative, Positive
from .pose_checks import angle_between
from .supervision import Reason

# Lag of the predicted motion [s].
_LAG = 0.1
# A wheel that is told to go more slowly may be held by friction [m/s].
_SLOWEST = 0.03
# Change of a pose above which the robot has moved [m].
_MOVED = 0.005
# Way that a robot may be told to go without moving: a length [m], and time at that speed [s].
_BLIND_WAY, _BLIND_TIME = 0.012, 0.12
# Where ticks are further apart robots have stopped by themselves meanwhile [s].
_LAPSE = 0.14
# How long a robot that does not follow stands before it is tried again [s], and after how many
# failures in a row it is not.
_PAUSE, _TRIES = 0.5, 3
# Part of a way that slip and wrong dimensions explain [-].
_SLIP = 0.25
# Sum of the rest above which encoders and motion capture disagree: a length [m], and what the wheel
# turns in the time by which the first and the last moment may be off [s].
_DISAGREEMENT, _MOMENTS_OFF = 0.012, 0.04
# Between two poses a wheel's speed is not known: time by which a moment there may be off, as a
# share of the time between them [-].
_BETWEEN_POSES = 0.25
# Number of poses remembered, as a report tells how things stood some ticks ago; and by how much a
# report may be newer than the newest pose [s].
_KEPT, _AHEAD = 4, 0.06
# Two reports are not nearer in time [s].
_BETWEEN_REPORTS = 0.03


@dataclass(frozen=True, kw_only=True)
class Chassis(Checked):
    """Wheels of a robot.

    Attributes:
        track_width: Between the wheels [m].
        counts_per_metre: Of an encoder [1/m].
        top_speed: Of a wheel: a reset explains counts beyond it [m/s].
        report_delay: From measuring the counts to the stamp of the report [s].

    Raises:
        InvalidInput: A number is out of its range.
    """

    track_width: Positive = 0.16
    counts_per_metre: Positive = 3998.0
    top_speed: Positive = 0.6
    report_delay: NonNegative = 0.03


class MotionMemory(NamedTuple):
    """What is known of N robots.

    Attributes:
        poses: Last good ones, shape (N, 3) [m], [m], [rad].
        since: Stamp from which on poses were good without a break, shape (N,) [s]; infinite if the
            last was not.
        ways: Of the wheels by motion capture, at the last poses, newest first, shape (4, N, 2) [m].
        stamps: Of these poses, shape (4, N) [s]; minus infinity if there was none.
        looked: When it was last looked, by the clock of the motion capture, shape (N,) [s]; minus
            infinity before.
        sent: Wheel speeds sent at the last tick, shape (N, 2) [m/s].
        predicted: Wheel speeds that earlier commands lead to, shape (N, 2) [m/s].
        anchors: Poses from which motion is counted, shape (N, 3) [m], [m], [rad].
        blind: Way that should have been driven from there, shape (N,) [m].
        tries: How often in a row a robot did not follow, shape (N,).
        until: When it may be tried again, shape (N,) [s].
        reports: Stamps of the last reports, shape (N,) [s]; minus infinity before the first.
        counts: Of their encoders, shape (N, 2).
        report_ways: Of the wheels by motion capture then, shape (N, 2) [m].
        differences: Sums by which encoders are ahead, and behind, shape (2, N, 2) [m].
        turning: Top speed of each wheel since the report before the last, by encoder or motion
            capture, shape (N, 2) [m/s].
        since_report: The same by motion capture since the last report, shape (N, 2) [m/s].
        at_first: As `turning`, when the differences began to add up, shape (2, N, 2) [m/s].
    """

    poses: np.ndarray
    since: np.ndarray
    ways: np.ndarray
    stamps: np.ndarray
    looked: np.ndarray
    sent: np.ndarray
    predicted: np.ndarray
    anchors: np.ndarray
    blind: np.ndarray
    tries: np.ndarray
    until: np.ndarray
    reports: np.ndarray
    counts: np.ndarray
    report_ways: np.ndarray
    differences: np.ndarray
    turning: np.ndarray
    since_report: np.ndarray
    at_first: np.ndarray


def no_motion(count: int) -> MotionMemory:
    """Nothing known yet.

    Args:
        count: Number of robots.
    """
    pairs, none = np.zeros((count, 2)), np.zeros(count)
    never, poses = np.full(count, -np.inf), np.zeros((count, 3))
    return MotionMemory(
        poses=poses,
        since=-never,
        ways=np.zeros((_KEPT, count, 2)),
        stamps=np.full((_KEPT, count), -np.inf),
        looked=never,
        sent=pairs,
        predicted=pairs,
        anchors=poses,
        blind=none,
        tries=none,
        until=never,
        reports=never,
        counts=pairs,
        report_ways=pairs,
        differences=np.zeros((2, count, 2)),
        turning=pairs,
        since_report=pairs,
        at_first=np.zeros((2, count, 2)),
    )


def wheel_speeds(chassis: Chassis, commands: np.ndarray) -> np.ndarray:
    """Left and right wheel of forward speeds and turn rates, shape (N, 2) [m/s].

    Args:
        chassis: Wheels.
        commands: Shape (N, 2) [m/s], [rad/s].
    """
    across = 0.5 * chassis.track_width * commands[:, 1]
    return np.stack([commands[:, 0] - across, commands[:, 0] + across], axis=1)


def wheel_ways(chassis: Chassis, before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Ways of left and right wheel on the arc from one pose to the next, shape (N, 2) [m].

    Args:
        chassis: Wheels.
        before, after: Poses, shape (N, 3) [m], [m], [rad].
    """
    turn = angle_between(after[:, 2], before[:, 2])
    middle = before[:, 2] + 0.5 * turn
    step = after[:, :2] - before[:, :2]
    ahead = step[:, 0] * np.cos(middle) + step[:, 1] * np.sin(middle)
    return wheel_speeds(chassis, np.stack([ahead, turn], axis=1))


def check_motion(
    chassis: Chassis,
    memory: MotionMemory,
    *,
    time: float,
    period: float,
    poses: np.ndarray,
    good: np.ndarray,
    stamps: np.ndarray,
    pose_ages: np.ndarray,
    counts: np.ndarray,
    ages: np.ndarray,
) -> tuple[MotionMemory, np.ndarray]:
    """Compare what was sent, what is seen and what encoders count.

    Args:
        chassis: Wheels.
        memory: What was known.
        time: Now [s].
        period: Between two calls [s].
        poses: That are believed, shape (N, 3) [m], [m], [rad].
        good: Which of them are seen now and plausible, shape (N,).
        stamps: When they were seen, by the clock of the motion capture, shape (N,) [s].
        pose_ages: How long ago that is, shape (N,) [s].
        counts: Of the encoders, in the last report, shape (N, 2).
        ages: Of the last report, shape (N,) [s].

    Returns:
        memory: Without what is sent at this tick: that is for `with_sent`.
        faults: ODOMETRY, NOT_FOLLOWING or NONE, as numbers of Reason, shape (N,).
    """
    known = good & np.isfinite(memory.since)
    step = np.where(known[:, np.newaxis], wheel_ways(chassis, memory.poses, poses), 0.0)
    newer = good & (stamps > memory.stamps[0])
    latest = np.concatenate([memory.ways[:1] + step, memory.ways[:-1]])
    moments = np.concatenate([stamps[np.newaxis], memory.stamps[:-1]])
    memory = memory._replace(
        poses=np.where(good[:, np.newaxis], poses, memory.poses),
        since=np.where(good, np.where(known, memory.since, stamps), np.inf),
        ways=np.where(newer[:, np.newaxis], latest, memory.ways),
        stamps=np.where(newer, moments, memory.stamps),
    )
    memory = _note_speeds(chassis, memory, newer)
    with np.errstate(invalid="ignore"):
        now = stamps + pose_ages
        late = now - memory.looked > _LAPSE
    # Before a late tick a robot has stopped by itself: its prediction starts from rest.
    rested = np.where(late[:, np.newaxis], 0.0, memory.predicted)
    memory = memory._replace(
        predicted=rested, looked=np.where(np.isfinite(now), now, memory.looked)
    )
    memory = _follow(chassis, memory, time, period, good)
    memory = _compare(chassis, memory, now, counts, ages)
    off = np.maximum(_MOMENTS_OFF, _BETWEEN_POSES * _spacing(memory.stamps))
    at_last = np.maximum(memory.turning, memory.since_report)
    explained = _DISAGREEMENT + off[:, np.newaxis] * (memory.at_first + at_last)
    disagree = (memory.differences > explained).any(axis=(0, 2))
    faults = np.where(
        disagree, Reason.ODOMETRY, np.where(time < memory.until, Reason.NOT_FOLLOWING, Reason.NONE)
    )
    return memory, faults.astype(float)


def with_sent(chassis: Chassis, memory: MotionMemory, commands: np.ndarray) -> MotionMemory:
    """Remember what is sent at this tick.

    Args:
        chassis: Wheels.
        memory: From `check_motion`.
        commands: Shape (N, 2) [m/s], [rad/s].
    """
    return memory._replace(sent=wheel_speeds(chassis, commands))


def forgiven(memory: MotionMemory) -> MotionMemory:
    """Forget every fault: the operator has looked."""
    return memory._replace(
        blind=np.zeros_like(memory.blind),
        tries=np.zeros_like(memory.tries),
        until=np.full_like(memory.until, -np.inf),
        differences=np.zeros_like(memory.differences),
        reports=np.full_like(memory.reports, -np.inf),
    )


def _follow(
    chassis: Chassis, memory: MotionMemory, time: float, period: float, good: np.ndarray
) -> MotionMemory:
    """Whether poses move where commands should move them."""
    motion = np.abs(wheel_ways(chassis, memory.anchors, memory.poses)).max(axis=1)
    aside = np.hypot(*(memory.poses - memory.anchors)[:, :2].T)
    free = ~good | (np.maximum(motion, aside) > _MOVED)
    share = period / (period + _LAG)
    predicted = memory.predicted + share * (memory.sent - memory.predicted)
    speed = np.minimum(np.abs(memory.predicted).max(axis=1), np.abs(memory.sent).max(axis=1))
    speed = np.where(speed >= _SLOWEST, speed, 0.0)
    blind = np.where(free, 0.0, memory.blind + period * speed)
    tries = np.where(free & good, 0.0, memory.tries)
    astray = (blind > _BLIND_WAY + _BLIND_TIME * speed) & (speed > 0)
    tries = tries + astray
    pause = np.where(tries >= _TRIES, np.inf, time + _PAUSE - 0.5 * period)
    return memory._replace(
        predicted=np.where(astray[:, np.newaxis], 0.0, predicted),
        anchors=np.where(free[:, np.newaxis], memory.poses, memory.anchors),
        blind=np.where(astray, 0.0, blind),
        tries=tries,
        until=np.where(astray, pause, memory.until),
    )


def _compare(
    chassis: Chassis,
    memory: MotionMemory,
    now: np.ndarray,
    counts: np.ndarray,
    ages: np.ndarray,
) -> MotionMemory:
    """Compare ways by encoders and motion capture since the last report, where a new one came.

    Args:
        chassis: Wheels.
        memory: With the newest poses.
        now: By the clock of the motion capture, shape (N,) [s].
        counts: Of the encoders, in the last report, shape (N, 2).
        ages: Of the last report, shape (N,) [s].
    """
    # Where nothing was seen or heard yet, times are no numbers, and nothing is compared.
    with np.errstate(invalid="ignore"):
        stamps = now - ages
        new = np.isfinite(stamps) & (stamps > memory.reports + _BETWEEN_REPORTS)
        between = np.where(new, stamps - memory.reports, np.inf)
        counted = (counts - memory.counts) / chassis.counts_per_metre
    # A report from after the last pose waits for the next.
    new &= stamps - chassis.report_delay <= memory.stamps[0] + _AHEAD
    measured = np.where(new, stamps - chassis.report_delay, -np.inf)
    seen, surely = _ways_at(memory.ways, memory.stamps, measured)
    driven = seen - memory.report_ways
    # Poses were good all the time, and nobody set the counts back.
    whole = new & surely & (measured - between >= memory.since)
    whole &= np.abs(counted).max(axis=1) <= 2 * chassis.top_speed * np.minimum(between, 10.0)
    gone = np.maximum(np.abs(counted), np.abs(driven))
    explained = _SLIP * gone
    speed = np.minimum(gone / between[:, np.newaxis], chassis.top_speed)
    turning = np.maximum(speed, memory.since_report)
    begins = whole[:, np.newaxis] & (memory.differences == 0.0)
    ahead = np.stack([counted - driven, driven - counted])
    sums = np.maximum(memory.differences + ahead - explained, 0.0)
    # A report that is older than all remembered poses is not counted from.
    return memory._replace(
        reports=np.where(new, np.where(surely, stamps, -np.inf), memory.reports),
        counts=np.where(new[:, np.newaxis], counts, memory.counts),
        report_ways=np.where(new[:, np.newaxis], seen, memory.report_ways),
        differences=np.where(whole[:, np.newaxis], sums, memory.differences),
        turning=np.where(whole[:, np.newaxis], turning, memory.turning),
        since_report=np.where(new[:, np.newaxis], 0.0, memory.since_report),
        at_first=np.where(begins, np.maximum(turning, memory.turning), memory.at_first),
    )


def _note_speeds(chassis: Chassis, memory: MotionMemory, newer: np.ndarray) -> MotionMemory:
    """Note how fast wheels turned before the newest poses.

    The ways at reports do not tell: a wheel that reverses between two may have gone nowhere.

    Args:
        chassis: Wheels.
        memory: With the newest poses.
        newer: Whether there is one, shape (N,).
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        between = np.where(newer, memory.stamps[0] - memory.stamps[1], np.inf)[:, np.newaxis]
        speeds = np.minimum(np.abs(memory.ways[0] - memory.ways[1]) / between, chassis.top_speed)
    return memory._replace(since_report=np.maximum(memory.since_report, speeds))


def _spacing(stamps: np.ndarray) -> np.ndarray:
    """The longest time between two of the remembered poses, shape (N,) [s].

    Args:
        stamps: Newest first, shape (k, N) [s].
    """
    with np.errstate(invalid="ignore"):
        between = stamps[:-1] - stamps[1:]
    return np.where(np.isfinite(between), between, 0.0).max(axis=0)


def _ways_at(
    ways: np.ndarray, stamps: np.ndarray, moments: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Ways at moments, between two poses or just after the last, and whether they are remembered.

    Args:
        ways: At the last poses, newest first, shape (k, N, 2) [m].
        stamps: Of these, shape (k, N) [s].
        moments: Shape (N,) [s].
    """
    robots = np.arange(len(moments))
    later = np.clip((stamps > moments).sum(axis=0) - 1, 0, len(stamps) - 2)
    first, second = stamps[later + 1, robots], stamps[later, robots]
    known = (moments >= first) & np.isfinite(first)
    with np.errstate(invalid="ignore", divide="ignore"):
        part = np.where(known, (moments - first) / (second - first), 0.0)[:, np.newaxis]
    return (1 - part) * ways[later + 1, robots] + part * ways[later, robots], known
