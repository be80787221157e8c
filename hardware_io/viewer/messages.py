"""Messages between a controller and the operator's view.

A controller sends JSON messages with a kind, "scene", "state" or "end", the run's number, and the
content. The view sends JSON, too: the operator's word, the number of the run that it is for, the
run's key, and who says it. A stop is for every run, and needs no key. Between words the view
reports that it is present.
"""

import hashlib
import hmac
import json
import math
from dataclasses import asdict, dataclass, field
from typing import Any

# Sent by the view periodically, so that controllers know that it is there.
PRESENT = b"present"
# What the operator may say.
WORDS = ("start", "pause", "stop")


@dataclass(frozen=True, kw_only=True)
class Scene:
    """What does not change in a run.

    Attributes:
        title: Title of the run.
        mode: "simulate", "emulate", "hardware" or "replay".
        boundary: Outer ring, [x, y] each [m].
        obstacles: Rings [m].
        limits: Rings that robots' centres do not cross [m].
        pursuers: Names of the pursuers.
        evaders: Names of the evaders.
        radius: Radius of a robot, as drawn [m].
        lock: Hash of the run's key, from `lock_of`; "" if no page may control the run.
        stop_page: Address of the controller's own page with a stop button; "" if there is none.
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
    """The supervisor's verdict on a robot.

    Attributes:
        name: Name of the robot.
        state: "armed", "running", "held" or "lost".
        why: Why it is held or lost, in words; "" otherwise.
    """

    name: str
    state: str
    why: str = ""


@dataclass(frozen=True, kw_only=True)
class Event:
    """Something that happened in a run.

    Attributes:
        time: Time in the run [s].
        robot: Name of the robot; "" if it concerns all.
        text: What happened.
    """

    time: float
    robot: str = ""
    text: str


@dataclass(frozen=True, kw_only=True)
class StopReport:
    """An emergency stop, as the view shows it.

    Attributes:
        who: Who asked for it.
        when: Time of day.
        acknowledgement: Who acknowledged it, in words.
    """

    who: str
    when: str
    acknowledgement: str


@dataclass(frozen=True, kw_only=True)
class State:
    """The state of a run.

    Attributes:
        time: In the run [s].
        operator: Number of the mode: 1 running, 0 paused, -1 stopped.
        poses: x, y [m], heading [rad] of each robot, pursuers first.
        valid: Whether each pose is valid.
        age: Age of each pose [s]; None if never seen.
        sight: For each pursuer, whether it sees each evader.
        assignment: Number of the evader that each pursuer chases, or -1.
        quality: Quality of the link to each robot, from 0 to 1; None if not known.
        battery: Battery voltage of each robot [V]; None if not known.
        commands: Speed [m/s] and turn rate [rad/s] sent to each robot.
        robots: The supervisor's verdict on each robot; empty without a supervisor.
        events: The latest events, oldest first.
        stop: The emergency stop; None before one.
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
    """Encode a message; a string says how the run ended."""
    if isinstance(what, str):
        return json.dumps({"kind": "end", "run": run, "how": what}).encode()
    kind = "scene" if isinstance(what, Scene) else "state"
    return json.dumps({"kind": kind, "run": run, **asdict(what)}).encode()


def decode(data: bytes) -> tuple[str, str, Scene | State | str] | None:
    """Decode kind, run and content of a message; None if it is invalid.

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
        key: Key of that run.
        who: Who says it.
    """

    word: str
    run: str = ""
    key: str = ""
    who: str = "the operator's view"

    def is_for(self, run: str, lock: str) -> bool:
        """Whether a run must obey: a stop always, other words only with its number and key.

        Args:
            run: Number of the run.
            lock: Hash of its key.
        """
        opens = bool(lock) and hmac.compare_digest(lock_of(run, self.key), lock)
        return self.word == "stop" or (self.run == run and opens)


def lock_of(run: str, key: str) -> str:
    """Hash of a run's key: it can be public, and allows a key to be checked.

    Args:
        run: Number of the run.
        key: The key.
    """
    return hashlib.sha256(f"{run} {key}".encode(errors="replace")).hexdigest()


def encode_word(word: Word) -> bytes:
    """A word as the view sends it."""
    return json.dumps(asdict(word)).encode()


def decode_word(data: bytes) -> Word | None:
    """Decode a word of the operator; None if it is invalid.

    Args:
        data: The bytes.
    """
    try:
        word = Word(**json.loads(data))
    except (ValueError, TypeError, RecursionError):
        return None
    return word if all(isinstance(each, str) for each in vars(word).values()) else None


def or_none(value: float) -> float | None:
    """Convert a number for JSON, which has no infinity or NaN: they become None.

    Args:
        value: The number, of any unit [-].
    """
    return float(value) if math.isfinite(value) else None
