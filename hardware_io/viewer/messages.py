"""What a controller tells the operator's view: its scene, its state, its end.

JSON, one message each: its kind, "scene", "state" or "end", the number of the run, and the rest.
"""

import json
import math
from dataclasses import asdict, dataclass
from typing import Any


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
    """

    title: str
    mode: str
    boundary: list[list[float]]
    obstacles: list[list[list[float]]]
    limits: list[list[list[float]]]
    pursuers: list[str]
    evaders: list[str]
    radius: float


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
        return kind, run, {"scene": Scene, "state": State}[kind](**message)
    except (ValueError, KeyError, TypeError, AttributeError):
        return None


def or_none(value: float) -> float | None:
    """A number for JSON, which knows no infinity.

    Args:
        value: The number, of any unit [-].
    """
    return float(value) if math.isfinite(value) else None
