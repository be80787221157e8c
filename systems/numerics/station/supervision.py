"""Which robots may run: reasons against it, those that only the operator clears, and re-arming.

What is decided is said in words too, when it changes.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Annotated, NamedTuple

import numpy as np

from ..checked import Checked, Positive, one_of
from ..errors import require_one_of


class Standing(IntEnum):
    """What a robot may do."""

    ARMED = 0
    RUNNING = 1
    HELD = 2
    LOST = 3


class Reason(IntEnum):
    """Why a robot is held or lost. Of several reasons the one with the lowest number is told.

    OBSTACLE alone holds no more than the forward motion of a robot, which runs otherwise.
    """

    NONE = 0
    OPERATOR_STOP = 1
    SILENT = 2
    FOREIGN_STOP = 3
    RESET = 4
    MOTOR = 5
    NOT_SEEN = 6
    OUTSIDE = 7
    JUMP = 8
    FLIP = 9
    TOO_FAST = 10
    ODOMETRY = 11
    NOT_FOLLOWING = 12
    FENCE = 13
    SPACING = 14
    DEAF = 15
    LOW_BATTERY = 16
    VIEW = 17
    OBSTACLE = 18


WORDS = {
    Reason.NONE: "",
    Reason.OPERATOR_STOP: "the operator stopped the run",
    Reason.SILENT: "nothing is heard of it",
    Reason.FOREIGN_STOP: "somebody else stopped it",
    Reason.RESET: "it was reset",
    Reason.MOTOR: "it cut its motors, since a wheel does not turn as told",
    Reason.NOT_SEEN: "the motion capture does not see it",
    Reason.OUTSIDE: "its pose lies outside the world",
    Reason.JUMP: "its pose jumped",
    Reason.FLIP: "its heading flipped",
    Reason.TOO_FAST: "its pose moves faster than a robot can",
    Reason.ODOMETRY: "its encoders and the motion capture disagree",
    Reason.NOT_FOLLOWING: "its pose does not follow its commands",
    Reason.FENCE: "it left the floor",
    Reason.SPACING: "it is too near to another",
    Reason.DEAF: "it does not hear the station",
    Reason.LOW_BATTERY: "its battery is low",
    Reason.VIEW: "the operator's view is gone",
    Reason.OBSTACLE: "an obstacle is near ahead",
}

# Nothing that a robot does while it stands shows that these are over.
ONLY_OPERATOR = frozenset({Reason.FOREIGN_STOP, Reason.MOTOR, Reason.ODOMETRY})

# Names of reasons that a scenario may leave to the operator.
NAMES = {
    reason.name.lower(): reason
    for reason in Reason
    if reason not in {Reason.NONE, Reason.OPERATOR_STOP, Reason.OBSTACLE}
}


STAND, GO_ON = "stand", "go_on"
# The operator's view is gone when it has been silent for longer [s].
VIEW_AFTER = 1.0

# States that a robot's firmware reports, as of hardware_io/kinds/xbee_frames.py; -1 is none.
_DISARMED, _LOST, _STOPPED = 0, 3, 4
# Flags that it reports: a low battery; a left or right motor that was cut off.
_LOW_BATTERY, _MOTOR_CUT = 1, 8 | 16
# Of the operator's mode.
_RUNNING, _STOPPED_BY_OPERATOR = 1.0, -1.0
# For how long a robot is asked to arm again after the operator's word [s].
_ASKED_FOR = 1.0
# Reports that come within so long of the run's start may tell how a robot was before [s].
_OF_BEFORE = 0.25
# Until then a robot that was never seen is not held for it [s].
_FIRST_SIGHT = 0.5


@dataclass(frozen=True, kw_only=True)
class SupervisionRules(Checked):
    """What a supervisor does about what it notices.

    Attributes:
        cleared_by_operator: Reasons, by name, that stay until the operator says start.
        silent_after: Age of its last report beyond which a robot is lost [s].
        view: "stand" or "go_on" when the operator's view is gone.

    Raises:
        InvalidInput: A name is none, or a time is not positive.
    """

    cleared_by_operator: tuple[str, ...] = ()
    silent_after: Positive = 1.0
    view: Annotated[str, one_of((STAND, GO_ON))] = STAND

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in self.cleared_by_operator:
            require_one_of("cleared_by_operator", name, sorted(NAMES))

    @property
    def staying(self) -> np.ndarray:
        """Whether each reason stays until the operator clears it, shape (number of reasons,)."""
        stay = ONLY_OPERATOR | {NAMES[name] for name in self.cleared_by_operator}
        return np.array([reason in stay for reason in Reason])


class Signs(NamedTuple):
    """What is known at a tick.

    Attributes:
        time: Now [s].
        valid: Which poses are, shape (N,).
        pose_faults, motion_faults, floor_faults: Numbers of Reason, shape (N,).
        robot_states: As reported, -1 before the first report, shape (N,).
        robot_flags: As reported, shape (N,).
        ages: Of the last reports, shape (N,) [s].
        mode: Number of the operator's: 1 to run, 0 for a pause, -1 for a stop.
        cleared: Whether the operator has said start since the last tick.
        view_age: Since the operator's view was last heard [s]; 0 where there is none.
    """

    time: float
    valid: np.ndarray
    pose_faults: np.ndarray
    motion_faults: np.ndarray
    floor_faults: np.ndarray
    robot_states: np.ndarray
    robot_flags: np.ndarray
    ages: np.ndarray
    mode: float
    cleared: bool
    view_age: float


class SupervisorMemory(NamedTuple):
    """What stays from tick to tick.

    Attributes:
        staying: Whether each reason holds each robot until it is cleared, shape (N, reasons).
        asked_until: Until when a robot is asked to arm again, shape (N,) [s].
        seen: Whether each robot ever was, shape (N,).
    """

    staying: np.ndarray
    asked_until: np.ndarray
    seen: np.ndarray


class Decision(NamedTuple):
    """What is decided about N robots.

    Attributes:
        standings: Numbers of Standing, shape (N,).
        reasons: Numbers of Reason, shape (N,).
        arm_again: Which are to be armed again, shape (N,).
    """

    standings: np.ndarray
    reasons: np.ndarray
    arm_again: np.ndarray


def no_supervision(count: int) -> SupervisorMemory:
    """The memory before the first tick.

    Args:
        count: Number of robots.
    """
    return SupervisorMemory(
        np.zeros((count, len(Reason))), np.full(count, -np.inf), np.zeros(count)
    )


def supervise(
    rules: SupervisionRules, memory: SupervisorMemory, signs: Signs
) -> tuple[SupervisorMemory, Decision]:
    """Decide for every robot whether it may run.

    Args:
        rules: What to do about what is noticed.
        memory: Of the tick before.
        signs: What is known now.
    """
    valid = signs.valid > 0.5
    seen = (memory.seen > 0.5) | valid
    asked_until = np.where(signs.cleared, signs.time + _ASKED_FOR, memory.asked_until)
    present = _present(rules, signs, seen)
    stays = rules.staying
    answered = np.zeros(len(Reason), dtype=bool)
    answered[[Reason.FOREIGN_STOP, Reason.RESET, Reason.MOTOR]] = True
    # What a robot still reports while it is asked to arm again is being answered, and not kept.
    # Once it has reported without any of that since, a reset is a new one.
    since = signs.time - signs.ages > asked_until - _ASKED_FOR + _OF_BEFORE
    well = since & (signs.robot_states >= 0) & ~(present & answered).any(axis=1)
    asked_until = np.where(well, -np.inf, asked_until)
    asked = signs.time < asked_until
    kept = (memory.staying > 0.5) & (not signs.cleared)
    kept |= present & stays & ~(asked[:, np.newaxis] & answered)
    active = present | kept
    reasons = np.where(active.any(axis=1), active.argmax(axis=1), Reason.NONE)
    may_run = (reasons == Reason.NONE) & valid & (signs.mode == _RUNNING)
    standings = np.select(
        [reasons == Reason.SILENT, reasons != Reason.NONE, may_run],
        [Standing.LOST, Standing.HELD, Standing.RUNNING],
        Standing.ARMED,
    )
    to_arm = (present & answered & (asked[:, np.newaxis] | ~stays)).any(axis=1)
    return (
        SupervisorMemory(kept.astype(float), asked_until, seen.astype(float)),
        Decision(standings, reasons, np.logical_and(to_arm, signs.mode == _RUNNING)),
    )


def view_is_gone(view_age: np.ndarray | float) -> np.ndarray:
    """Whether the operator's view has been silent for too long.

    Args:
        view_age: Since it was heard, any shape [s].
    """
    return ~(np.asarray(view_age) <= VIEW_AFTER)


def _present(rules: SupervisionRules, signs: Signs, seen: np.ndarray) -> np.ndarray:
    """Which reasons there are at this moment, shape (N, number of reasons)."""
    present = np.zeros((len(signs.valid), len(Reason)), dtype=bool)
    # Before its first report a robot is as old as the run.
    ages = np.minimum(signs.ages, signs.time)
    state = np.where(signs.time - signs.ages > _OF_BEFORE, signs.robot_states, -1)
    flags = np.where(state >= 0, signs.robot_flags, 0).astype(int)
    present[:, Reason.OPERATOR_STOP] = signs.mode == _STOPPED_BY_OPERATOR
    present[:, Reason.SILENT] = ages > rules.silent_after
    present[:, Reason.FOREIGN_STOP] = state == _STOPPED
    present[:, Reason.RESET] = state == _DISARMED
    present[:, Reason.MOTOR] = (flags & _MOTOR_CUT) != 0
    present[:, Reason.NOT_SEEN] = (signs.valid <= 0.5) & (seen | (signs.time > _FIRST_SIGHT))
    for faults in (signs.pose_faults, signs.motion_faults, signs.floor_faults):
        known = np.clip(np.rint(faults), 0, len(Reason) - 1).astype(int)
        present[np.arange(len(known)), known] = True
    present[:, Reason.NONE] = False
    present[:, Reason.DEAF] = state == _LOST
    present[:, Reason.LOW_BATTERY] = (flags & _LOW_BATTERY) != 0
    present[:, Reason.VIEW] = (rules.view == STAND) & view_is_gone(signs.view_age)
    return present


class Transition(NamedTuple):
    """A change of the standing or reason of one robot, or of all of them.

    Attributes:
        robot: Its name, "" for all.
        text: What it is now, and why.
        fault: Whether something is wrong.
    """

    robot: str
    text: str
    fault: bool


def standing_name(standing: float) -> str:
    """Name of a standing; "unknown" for a number that is none, as a log may hold.

    Args:
        standing: Number of Standing [-].
    """
    known = standing in tuple(Standing)
    return Standing(int(standing)).name.lower() if known else "unknown"


def reason_words(reason: float) -> str:
    """A reason in words, "" for none or an unknown number.

    Args:
        reason: Number of Reason [-].
    """
    return WORDS[Reason(int(reason))] if reason in tuple(Reason) else ""


def transitions(
    names: Sequence[str],
    before: tuple[np.ndarray, np.ndarray] | None,
    now: tuple[np.ndarray, np.ndarray],
) -> list[Transition]:
    """What has changed from one tick to the next; a change to the same of all robots is told once.

    Args:
        names: Of the robots.
        before: Numbers of Standing and Reason a tick ago, shape (N,) each; None at the first tick.
        now: The same now, shape (N,) each.
    """
    numbers = np.stack(now, axis=1)
    changed = np.ones(len(names), bool)
    if before is not None:
        changed = (numbers != np.stack(before, axis=1)).any(axis=1)
    if changed.all() and (numbers == numbers[0]).all():
        return [_transition("", *numbers[0])]
    told = zip(names, numbers, changed, strict=True)
    return [_transition(name, *each) for name, each, new in told if new]


def _transition(robot: str, standing: float, reason: float) -> Transition:
    why = reason_words(reason)
    name = standing_name(standing)
    fault = name in ("held", "lost") and int(reason) != Reason.OPERATOR_STOP
    return Transition(robot, f"{name}: {why}" if why else name, fault)
