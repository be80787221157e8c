"""What a supervisor makes of a robot, and why it does not let it drive."""

from enum import IntEnum


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
