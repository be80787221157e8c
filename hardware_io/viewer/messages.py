"""What a controller tells the operator's view: its scene, its state, its end.

JSON, one message each: its kind, "scene", "state" or "end", the number of the run, and the rest.
What the view says to controllers is JSON too: the word, the number of the run that it is for, the
run's key, and who says it. A stop is for every run, and needs no key. Between words it says that
it is present.
"""

import hashlib
import hmac
import json
import math
from dataclasses import asdict, dataclass, field
from typing import Any

# What the view says now and then, so that controllers know that it is there.
PRESENT = b"present"
# What the operator may say.
WORDS = ("start", "pause", "stop")


@dataclass(frozen=True, kw_only=True)
class Scene:
    """What does not change in a run.

    Attributes:
        title: Of the run.
        mode: "simulate", "emulate", "hardware" or "replay".
        boundary: Outer ring, [x, y] each [m].
        obstacles: Rings [m].
        limits: Rings that robots' centres do not cross [m].
        pursuers: Names of the pursuers.
        evaders: Names of the evaders.
        radius: Of a robot, as drawn [m].
        lock: Of the run's key, from `lock_of`; "" where nobody steers by a page.
        stop_page: Address of the controller's own page with a stop, "" without.
    """

    title: str
    mode: str
    boundary: list[list[float]]
    obstacles: list[list[list[float]]]
    limits: list[list[list[float]]]
    pursuers: list[str]
    evaders: list[str]
    radius: float
    lock: str = ""
    stop_page: str = ""


@dataclass(frozen=True, kw_only=True)
class RobotState:
    """What the supervisor makes of a robot.

    Attributes:
        name: Of the robot.
        state: "armed", "running", "held" or "lost".
        why: It is held or lost, in words; "" otherwise.
    """

    name: str
    state: str
    why: str = ""


@dataclass(frozen=True, kw_only=True)
class Event:
    """Something that happened in a run.

    Attributes:
        time: In the run [s].
        robot: Name of the robot, "" where it is of all.
        text: What happened.
    """

    time: float
    robot: str = ""
    text: str


@dataclass(frozen=True, kw_only=True)
class StopReport:
    """An emergency stop, as the view shows it.

    Attributes:
        who: Asked for it.
        when: By the clock on the wall.
        acknowledgement: Who acknowledged it, in words.
    """

    who: str
    when: str
    acknowledgement: str


@dataclass(frozen=True, kw_only=True)
class State:
    """How things stand.

    Attributes:
        time: In the run [s].
        operator: Number of the mode: 1 running, 0 paused, -1 stopped.
        poses: x, y [m], heading [rad] of each robot, pursuers first.
        valid: Whether each pose is.
        age: Of each pose [s]; None if never seen.
        sight: For each pursuer, whether it sees each evader.
        assignment: Number of the evader that each pursuer chases, or -1.
        quality: Of the link to each robot, from 0 to 1; None if not known.
        battery: Of each robot [V]; None if not known.
        commands: Speed [m/s] and turn rate [rad/s] sent to each robot.
        robots: What the supervisor makes of each robot; empty where there is none.
        events: The latest, oldest first.
        stop: The emergency stop, None before.
    """

    time: float
    operator: float
    poses: list[list[float]]
    valid: list[bool]
    age: list[float | None]
    sight: list[list[bool]]
    assignment: list[int]
    quality: list[float | None]
    battery: list[float | None]
    commands: list[list[float]]
    robots: list[RobotState] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)
    stop: StopReport | None = None


def encode(run: str, what: Scene | State | str) -> bytes:
    """A message; a string is how a run ended."""
    if isinstance(what, str):
        return json.dumps({"kind": "end", "run": run, "how": what}).encode()
    kind = "scene" if isinstance(what, Scene) else "state"
    return json.dumps({"kind": kind, "run": run, **asdict(what)}).encode()


def decode(data: bytes) -> tuple[str, str, Scene | State | str] | None:
    """Kind, run and content of a message; None for what is none.

    Args:
        data: The bytes.
    """
    try:
        message: dict[str, Any] = json.loads(data)
        kind, run = str(message.pop("kind")), str(message.pop("run"))
        if kind == "end":
            return kind, run, str(message["how"])
        if kind == "state":
            message["robots"] = [RobotState(**each) for each in message.get("robots", ())]
            message["events"] = [Event(**each) for each in message.get("events", ())]
            stop = message.get("stop")
            message["stop"] = None if stop is None else StopReport(**stop)
        return kind, run, {"scene": Scene, "state": State}[kind](**message)
    except (ValueError, KeyError, TypeError, AttributeError):
        return None


@dataclass(frozen=True, kw_only=True)
class Word:
    """What the operator says.

    Attributes:
        word: start, pause or stop.
        run: Number of the run that it is for.
        key: Of that run.
        who: Says it.
    """

    word: str
    run: str = ""
    key: str = ""
    who: str = "the operator's view"

    def is_for(self, run: str, lock: str) -> bool:
        """Whether a run is to obey: a stop always, others with its number and its key.

        Args:
            run: Its number.
            lock: Of its key.
        """
        opens = bool(lock) and hmac.compare_digest(lock_of(run, self.key), lock)
        return self.word == "stop" or (self.run == run and opens)


def lock_of(run: str, key: str) -> str:
    """What anybody may know of a run's key: it tells whether a key is the one, and not which.

    Args:
        run: Number of the run.
        key: The key.
    """
    return hashlib.sha256(f"{run} {key}".encode(errors="replace")).hexdigest()


def encode_word(word: Word) -> bytes:
    """A word as the view sends it."""
    return json.dumps(asdict(word)).encode()


def decode_word(data: bytes) -> Word | None:
    """A word as a controller gets it, None for what is none.

    Args:
        data: The bytes.
    """
    try:
        word = Word(**json.loads(data))
    except (ValueError, TypeError, RecursionError):
        return None
    return word if all(isinstance(each, str) for each in vars(word).values()) else None


def or_none(value: float) -> float | None:
    """A number for JSON, which knows no infinity.

    Args:
        value: The number, of any unit [-].
    """
    return float(value) if math.isfinite(value) else None
