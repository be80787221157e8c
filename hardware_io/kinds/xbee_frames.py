"""The frames between work station and robots on XBee radios: their fields and byte layout.

Every frame is one payload of an XBee module (at most 100 bytes), little-endian:

=======  ======  ==========================================================================
offset   type    header of every frame
=======  ======  ==========================================================================
0        u8      0x51, the mark of this layout
1        u8      kind
2        u16     session: drawn by the work station at its start, told to robots by `Arm`
4        u16     sequence number of the sender, counted modulo 65536
6        ...     body
last 4   u32     CRC-32 (IEEE 802.3, as in zlib) of all bytes before it
=======  ======  ==========================================================================

====  ===============  ==================================================================
kind  frame            body
====  ===============  ==================================================================
1     Command          u8 form (0 wheels, 1 twist), u8 count n (1 to 16), u16 age [ms],
                       n times: u8 robot, i16, i16. Wheels: left and right [mm/s];
                       twist: forward speed [mm/s], turn rate [mrad/s], left positive
2     Heartbeat        none
3     Stop             u8 robot, 255 for all: emergency stop, until armed
4     Arm              u8 robot, 255 for all
5     Telemetry        u8 robot, u8 state, u8 flags, u16 last sequence number taken,
                       u16 hold [ms] since it was taken, i32 and i32 counts of the left
                       and right encoder, i16 and i16 wheel speeds [mm/s], 4 times u16
                       infrared range [mm], u16 battery [mV], u16 frames taken, u16
                       frames refused (both modulo 65536)
6     Acknowledgement  u8 robot, u8 kind (3 or 4) and u16 sequence number of what is
                       acknowledged, u8 state
====  ===============  ==================================================================

A CRC-16 would let about 15 of a million damaged frames pass; hence 32 bits. Frames and valid
payloads correspond one to one: `decode(encode(f)) == f` and `encode(decode(b)) == b`.
"""

import struct
import zlib
from dataclasses import dataclass
from enum import IntEnum

from ...systems.numerics.errors import SightfieldError, require
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
    """Base of all frames: the session and the sender's sequence number."""

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
    """Tells the robots that the work station is there."""


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
        state: State of the robot.
        flags: Flags of what is wrong.
        last_sequence: Sequence number of the last frame that it took.
        hold: Time since it took that frame [ms].
        counts: Counts of the left and the right encoder.
        speeds: Speeds of the left and the right wheel [mm/s].
        ranges: Ranges of the four infrared sensors [mm].
        battery: Battery voltage [mV].
        taken, refused: Numbers of frames taken and refused, modulo 65536.

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
        kind: Kind of the frame that it has taken.
        acknowledged: Sequence number of that frame.
        state: State of the robot now.

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


MARK = 0x51

_HEADER = struct.Struct("<BBHH")
_COMMAND = struct.Struct("<BBH")
_ENTRY = struct.Struct("<Bhh")
_TELEMETRY = struct.Struct("<BBBHHiihhHHHHHHH")
_ACKNOWLEDGEMENT = struct.Struct("<BBHB")


class FrameError(SightfieldError):
    """The bytes are not a valid frame; the message says why."""


def encode(frame: AnyFrame) -> bytes:
    """Payload of a frame, at most 100 bytes; its layout is in the module's docstring."""
    match frame:
        case Command():
            kind = Kind.COMMAND
            body = _COMMAND.pack(frame.form, len(frame.entries), frame.age)
            body += b"".join(_ENTRY.pack(e.robot, e.first, e.second) for e in frame.entries)
        case Heartbeat():
            kind, body = Kind.HEARTBEAT, b""
        case Stop():
            kind, body = Kind.STOP, bytes([frame.robot])
        case Arm():
            kind, body = Kind.ARM, bytes([frame.robot])
        case Telemetry():
            kind = Kind.TELEMETRY
            body = _TELEMETRY.pack(
                *(frame.robot, frame.state, frame.flags, frame.last_sequence, frame.hold),
                *(*frame.counts, *frame.speeds, *frame.ranges),
                *(frame.battery, frame.taken, frame.refused),
            )
        case Acknowledgement():
            kind = Kind.ACKNOWLEDGEMENT
            body = _ACKNOWLEDGEMENT.pack(frame.robot, frame.kind, frame.acknowledged, frame.state)
    checked = _HEADER.pack(MARK, kind, frame.session, frame.sequence) + body
    return checked + zlib.crc32(checked).to_bytes(4, "little")


def decode(payload: bytes) -> AnyFrame:
    """Frame of a payload.

    Raises:
        FrameError: It is too short, carries another mark, an unknown kind, a wrong length or
            checksum, or a field that is out of its range.
    """
    payload = bytes(payload)
    if len(payload) < _HEADER.size + 4:
        raise FrameError(f"a frame has at least {_HEADER.size + 4} bytes; got {len(payload)}")
    checked, checksum = payload[:-4], int.from_bytes(payload[-4:], "little")
    mark, kind, session, sequence = _HEADER.unpack_from(checked)
    if mark != MARK:
        raise FrameError(f"a frame begins with {MARK:#04x}; got {mark:#04x}")
    if checksum != zlib.crc32(checked):
        raise FrameError("the checksum of a frame does not fit its bytes")
    body = checked[_HEADER.size :]
    try:
        return _read_body(kind, body, {"session": session, "sequence": sequence})
    except (struct.error, ValueError) as error:
        raise FrameError(f"a frame of kind {kind} has a wrong body: {error}") from None


def _read_body(kind: int, body: bytes, header: dict[str, int]) -> AnyFrame:
    """Frame of a body; ValueError or struct.error if there is none."""
    match kind:
        case Kind.COMMAND:
            form, count, age = _COMMAND.unpack(body[: _COMMAND.size])
            entries = tuple(Entry(*each) for each in _ENTRY.iter_unpack(body[_COMMAND.size :]))
            require(len(entries) == count, "count", "be the number of entries", count)
            return Command(**header, form=Form(form), age=age, entries=entries)
        case Kind.HEARTBEAT:
            require(not body, "body", "be empty", len(body))
            return Heartbeat(**header)
        case Kind.STOP | Kind.ARM:
            require(len(body) == 1, "body", "have 1 byte", len(body))
            return (Stop if kind == Kind.STOP else Arm)(**header, robot=body[0])
        case Kind.TELEMETRY:
            robot, state, flags, last, hold, *rest = _TELEMETRY.unpack(body)
            return Telemetry(
                **header,
                robot=robot,
                last_sequence=last,
                hold=hold,
                state=RobotState(state),
                flags=RobotFlag(flags),
                counts=(rest[0], rest[1]),
                speeds=(rest[2], rest[3]),
                ranges=(rest[4], rest[5], rest[6], rest[7]),
                battery=rest[8],
                taken=rest[9],
                refused=rest[10],
            )
        case Kind.ACKNOWLEDGEMENT:
            robot, what, acknowledged, state = _ACKNOWLEDGEMENT.unpack(body)
            return Acknowledgement(
                **{**header, "robot": robot, "acknowledged": acknowledged},
                kind=Kind(what),
                state=RobotState(state),
            )
    raise ValueError("unknown kind")
