"""What a controller and the process that drives its robots say to one another."""

from dataclasses import dataclass

from ..kinds.robot_kind import RobotFleet
from ..links.robot_link import LinkHealth, RobotReport


@dataclass(frozen=True)
class Open:
    """Open the link.

    Attributes:
        kind: Of the robots, by name.
        fleet: They, and how they are reached.
        path: Where Python finds modules.
    """

    kind: str
    fleet: RobotFleet
    path: tuple[str, ...]


@dataclass(frozen=True)
class Drive:
    """Drive, until something else is said.

    Attributes:
        speeds: Of each robot [m/s].
        turn_rates: Of each [rad/s].
        deadline: When robots may begin to at the latest, by time.monotonic [s].
    """

    speeds: tuple[float, ...]
    turn_rates: tuple[float, ...]
    deadline: float


@dataclass(frozen=True)
class Ask:
    """Do something that is answered.

    Attributes:
        number: Of the question.
        what: "arm" or "stop".
        timeout: How long robots may take [s].
    """

    number: int
    what: str
    timeout: float


@dataclass(frozen=True)
class Hail:
    """Let robots report."""


@dataclass(frozen=True)
class ArmAgain:
    """Let robots drive again.

    Attributes:
        robots: Their numbers.
    """

    robots: tuple[int, ...]


@dataclass(frozen=True)
class Close:
    """Close the link, and end."""


@dataclass(frozen=True)
class Answer:
    """To a question; number 0 to the first word.

    Attributes:
        number: Of the question.
        robots: That have done it.
        failure: Why it cannot be done, or empty.
        misused: Whether that is the fault of who asks.
    """

    number: int
    robots: tuple[int, ...] = ()
    failure: str = ""
    misused: bool = False


@dataclass(frozen=True)
class Notice:
    """How things stand.

    Attributes:
        time: By time.monotonic [s]; no two notices are alike.
        reports: The latest of every robot that was heard.
        health: Of the link.
        failure: Why it has gone, or empty.
    """

    time: float
    reports: dict[int, RobotReport]
    health: LinkHealth
    failure: str = ""
