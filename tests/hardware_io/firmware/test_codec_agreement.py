"""The firmware's codec in C and the work station's in Python agree byte for byte."""

import ctypes
import zlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sightfield.hardware_io.emulation.emulated_radio import ApiParser, api_frame
from sightfield.hardware_io.kinds.xbee_frames import (
    Acknowledgement,
    Arm,
    Command,
    Entry,
    Form,
    FrameError,
    Heartbeat,
    Kind,
    RobotFlag,
    RobotState,
    Stop,
    Telemetry,
    decode,
    encode,
)

u8, u16 = st.integers(0, 255), st.integers(0, 65535)
i16, i32 = st.integers(-(1 << 15), (1 << 15) - 1), st.integers(-(1 << 31), (1 << 31) - 1)
robots = st.integers(0, 254)
header = {"session": u16, "sequence": u16}
entries = st.lists(
    st.builds(Entry, robots, i16, i16), min_size=1, max_size=16, unique_by=lambda e: e.robot
).map(tuple)
to_robots = st.one_of(
    st.builds(Command, **header, form=st.sampled_from(Form), age=u16, entries=entries),
    st.builds(Heartbeat, **header),
    st.builds(Stop, **header, robot=u8),
    st.builds(Arm, **header, robot=u8),
)


def message_of(frame):
    """The message that a struct frame of the firmware holds."""
    both = {"session": frame.session, "sequence": frame.sequence}
    if frame.kind == Kind.COMMAND:
        rows = [Entry(e.robot, e.first, e.second) for e in frame.entries[: frame.count]]
        return Command(**both, form=Form(frame.form), age=frame.age, entries=tuple(rows))
    if frame.kind == Kind.HEARTBEAT:
        return Heartbeat(**both)
    return (Stop if frame.kind == Kind.STOP else Arm)(**both, robot=frame.robot)


class CTelemetry(ctypes.Structure):
    """struct telemetry of portable/frames.h."""

    _fields_ = (
        ("session", ctypes.c_uint16),
        ("sequence", ctypes.c_uint16),
        ("robot", ctypes.c_uint8),
        ("state", ctypes.c_uint8),
        ("flags", ctypes.c_uint8),
        ("last_sequence", ctypes.c_uint16),
        ("hold", ctypes.c_uint16),
        ("counts", ctypes.c_int32 * 2),
        ("speeds", ctypes.c_int16 * 2),
        ("ranges", ctypes.c_uint16 * 4),
        ("battery", ctypes.c_uint16),
        ("taken", ctypes.c_uint16),
        ("refused", ctypes.c_uint16),
    )


class CAcknowledgement(ctypes.Structure):
    """struct acknowledgement of portable/frames.h."""

    _fields_ = (
        ("session", ctypes.c_uint16),
        ("sequence", ctypes.c_uint16),
        ("robot", ctypes.c_uint8),
        ("kind", ctypes.c_uint8),
        ("acknowledged", ctypes.c_uint16),
        ("state", ctypes.c_uint8),
    )


@pytest.fixture(scope="module")
def c_decode(firmware_library, c_frame):
    """The message that the firmware makes of a payload, or None."""
    firmware_library.frame_decode.restype = ctypes.c_bool

    def decode_in_c(payload: bytes):
        frame = c_frame()
        good = firmware_library.frame_decode(payload, len(payload), ctypes.byref(frame))
        return message_of(frame) if good else None

    return decode_in_c


def python_decode(payload: bytes):
    """The message to robots that the work station makes of a payload, or None."""
    try:
        frame = decode(payload)
    except FrameError:
        return None
    return None if isinstance(frame, Telemetry | Acknowledgement) else frame


@given(frame=to_robots)
def test_the_firmware_reads_what_the_station_writes(frame, c_decode):
    assert c_decode(encode(frame)) == frame


sealed = st.builds(
    lambda kind, rest: bytes([0x51, kind]) + rest,
    st.integers(0, 7),
    st.one_of(
        st.binary(max_size=94),
        # Commands whose count mostly fits.
        st.builds(
            lambda head, form, count, age, rest: (
                head + bytes([form, count]) + age + rest[: 5 * count]
            ),
            *(st.binary(min_size=4, max_size=4), st.integers(0, 2), st.integers(0, 17)),
            *(st.binary(min_size=2, max_size=2), st.binary(min_size=60, max_size=85)),
        ),
    ),
).map(lambda body: body[:96] + zlib.crc32(body[:96]).to_bytes(4, "little"))


@given(payload=sealed)
def test_both_take_and_refuse_the_same_bytes(payload, c_decode):
    assert c_decode(payload) == python_decode(payload)


telemetry = st.fixed_dictionaries(
    {
        **header,
        "robot": robots,
        "state": st.integers(0, 4),
        "flags": u8,
        "last_sequence": u16,
        "hold": u16,
        "counts": st.tuples(i32, i32),
        "speeds": st.tuples(i16, i16),
        "ranges": st.tuples(u16, u16, u16, u16),
        "battery": u16,
        "taken": u16,
        "refused": u16,
    }
)


@given(fields=telemetry)
def test_the_station_reads_the_telemetry_that_the_firmware_writes(fields, firmware_library):
    written = ctypes.create_string_buffer(100)
    report = CTelemetry(**fields)
    length = firmware_library.frame_encode_telemetry(ctypes.byref(report), written)
    states = {"state": RobotState(fields["state"]), "flags": RobotFlag(fields["flags"])}
    expected = Telemetry(**{**fields, **states})
    assert written.raw[:length] == encode(expected)


@given(
    fields=st.fixed_dictionaries(
        {
            **header,
            "robot": robots,
            "kind": st.sampled_from([3, 4]),
            "acknowledged": u16,
            "state": st.integers(0, 4),
        }
    )
)
def test_the_station_reads_the_acknowledgements_that_the_firmware_writes(fields, firmware_library):
    written = ctypes.create_string_buffer(100)
    answer = CAcknowledgement(**fields)
    length = firmware_library.frame_encode_acknowledgement(ctypes.byref(answer), written)
    kinds = {"kind": Kind(fields["kind"]), "state": RobotState(fields["state"])}
    assert written.raw[:length] == encode(Acknowledgement(**{**fields, **kinds}))


class CParser(ctypes.Structure):
    """struct xbee_parser of portable/xbee.h."""

    _fields_ = (
        ("state", ctypes.c_uint8),
        ("escaped", ctypes.c_bool),
        ("length", ctypes.c_uint8),
        ("taken", ctypes.c_uint8),
        ("sum", ctypes.c_uint8),
        ("data", ctypes.c_uint8 * 111),
    )


special = st.sampled_from([0x7E, 0x7D, 0x11, 0x13, 0x00, 0x01, 0x5D, 0x5E])
stream = st.lists(st.one_of(special, u8), max_size=40).map(bytes)


@given(parts=st.lists(st.one_of(stream, stream.filter(len).map(api_frame)), max_size=5))
def test_both_find_the_same_frames_in_a_serial_stream(parts, firmware_library):
    firmware_library.xbee_take.restype = ctypes.c_bool
    parser, found = CParser(), []
    for byte in b"".join(parts):
        if firmware_library.xbee_take(ctypes.byref(parser), byte):
            found.append(bytes(parser.data[: parser.length]))
    # The firmware has room for what it may be sent; the module for more.
    assert found == [data for data in ApiParser().take(b"".join(parts)) if len(data) <= 111]


@given(address=st.binary(min_size=8, max_size=8), payload=st.binary(min_size=1, max_size=100))
def test_the_module_reads_the_requests_to_send_that_the_firmware_writes(
    address, payload, firmware_library
):
    serial = ctypes.create_string_buffer(231)
    length = firmware_library.xbee_send_request(address, payload, len(payload), serial)
    expected = api_frame(bytes([0, 0]) + address + bytes([0]) + payload)
    assert serial.raw[: length & 0xFF] == expected
