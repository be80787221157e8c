"""What work station and robots say to each other; `frames.py` has the bytes."""

from dataclasses import dataclass
from enum import IntEnum

from ...systems.numerics.errors import require
from ..links.robot_link import EVERYONE, RobotFlag, RobotState

MOST_ENTRIES = 16
MODULUS = 1 << 16


class Kind(IntEnum):
    """What a frame is."""

    COMMAND = 1
    HEARTBEAT = 2
    STOP = 3
    ARM = 4
    TELEMETRY = 5
    ACKNOWLEDGEMENT = 6


class Form(IntEnum):
    """What the two numbers of a command mean."""

    WHEELS = 0
    TWIST = 1


@dataclass(frozen=True)
class Entry:
    """Command to one robot: wheel speeds [mm/s], or forward speed [mm/s] and turn rate [mrad/s].

    Attributes:
        robot: Its number.
        first: Left wheel, or forward speed [mm/s].
        second: Right wheel [mm/s], or turn rate [mrad/s].
    """

    robot: int
    first: int
    second: int

    def __post_init__(self) -> None:
        _require_robot("robot", self.robot, everyone=False)
        _require_within("first", self.first, -(1 << 15), (1 << 15) - 1)
        _require_within("second", self.second, -(1 << 15), (1 << 15) - 1)


@dataclass(frozen=True, kw_only=True)
class Frame:
    """What all frames have: the session and the sender's sequence number."""

    session: int
    sequence: int

    def __post_init__(self) -> None:
        _require_within("session", self.session, 0, MODULUS - 1)
        _require_within("sequence", self.sequence, 0, MODULUS - 1)


@dataclass(frozen=True, kw_only=True)
class Command(Frame):
    """Speeds of several robots; `age` is that of the poses they were computed from [ms].

    Raises:
        InvalidInput: There are no entries, or too many.
    """

    form: Form
    age: int
    entries: tuple[Entry, ...]

    def __post_init__(self) -> None:
        super().__post_init__()
        require(self.form in tuple(Form), "form", "be 0 or 1", self.form)
        _require_within("age", self.age, 0, MODULUS - 1)
        count = len(self.entries)
        require(1 <= count <= MOST_ENTRIES, "entries", f"be 1 to {MOST_ENTRIES}", count)
        robots = [entry.robot for entry in self.entries]
        require(len(set(robots)) == count, "entries", "name each robot once", robots)


@dataclass(frozen=True, kw_only=True)
class Heartbeat(Frame):
    """The work station is there."""


@dataclass(frozen=True, kw_only=True)
class Stop(Frame):
    """Emergency stop of one robot, or of EVERYONE, until it is armed."""

    robot: int = EVERYONE

    def __post_init__(self) -> None:
        super().__post_init__()
        _require_robot("robot", self.robot)


@dataclass(frozen=True, kw_only=True)
class Arm(Frame):
    """One robot, or EVERYONE, may drive, and takes commands of this session from now on."""

    robot: int = EVERYONE

    def __post_init__(self) -> None:
        super().__post_init__()
        _require_robot("robot", self.robot)


@dataclass(frozen=True, kw_only=True)
class Telemetry(Frame):
    """What a robot reports about itself; fields as in the module's table.

    Attributes:
        robot: Its number.
        state: It is in.
        flags: Of what is wrong.
        last_sequence: Number of the last frame that it took.
        hold: Since then [ms].
        counts: Of the left and the right encoder.
        speeds: Of the left and the right wheel [mm/s].
        ranges: Of the four infrared sensors [mm].
        battery: [mV].
        taken, refused: Numbers of frames, modulo 65536.

    Raises:
        InvalidInput: A number does not fit its field.
    """

    robot: int
    state: RobotState
    flags: RobotFlag
    last_sequence: int
    hold: int
    counts: tuple[int, int]
    speeds: tuple[int, int]
    ranges: tuple[int, int, int, int]
    battery: int
    taken: int
    refused: int

    def __post_init__(self) -> None:
        super().__post_init__()
        _require_robot("robot", self.robot, everyone=False)
        require(self.state in tuple(RobotState), "state", "be 0 to 4", self.state)
        _require_within("flags", self.flags, 0, 255)
        for name in ("last_sequence", "hold", "battery", "taken", "refused"):
            _require_within(name, getattr(self, name), 0, MODULUS - 1)
        for name, size, bits in (("counts", 2, 31), ("speeds", 2, 15)):
            values = getattr(self, name)
            require(len(values) == size, name, f"hold {size} numbers", values)
            for value in values:
                _require_within(name, value, -(1 << bits), (1 << bits) - 1)
        require(len(self.ranges) == 4, "ranges", "hold 4 numbers", self.ranges)
        for value in self.ranges:
            _require_within("ranges", value, 0, MODULUS - 1)


@dataclass(frozen=True, kw_only=True)
class Acknowledgement(Frame):
    """A robot has taken a Stop or an Arm, and is now in `state`.

    Attributes:
        robot: Its number.
        kind: Of what it has taken.
        acknowledged: Its sequence number.
        state: The robot's, now.

    Raises:
        InvalidInput: A number does not fit its field.
    """

    robot: int
    kind: Kind
    acknowledged: int
    state: RobotState

    def __post_init__(self) -> None:
        super().__post_init__()
        _require_robot("robot", self.robot, everyone=False)
        require(self.kind in (Kind.STOP, Kind.ARM), "kind", "be 3 or 4", self.kind)
        _require_within("acknowledged", self.acknowledged, 0, MODULUS - 1)
        require(self.state in tuple(RobotState), "state", "be 0 to 4", self.state)


AnyFrame = Command | Heartbeat | Stop | Arm | Telemetry | Acknowledgement


def _require_within(name: str, value: int, low: int, high: int) -> None:
    whole = isinstance(value, int) and not isinstance(value, bool)
    require(whole and low <= value <= high, name, f"be a whole number {low} to {high}", value)


def _require_robot(name: str, robot: int, *, everyone: bool = True) -> None:
    _require_within(name, robot, 0, EVERYONE if everyone else EVERYONE - 1)
