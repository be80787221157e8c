"""Frames and their bytes are each other's inverse, and damage is noticed.

A million damaged frames are refused by the work station's decoder.
"""

import random
import zlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

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
from sightfield.systems.numerics.errors import InvalidInput, SightfieldError

u8, u16 = st.integers(0, 255), st.integers(0, 65535)
i16, i32 = st.integers(-(1 << 15), (1 << 15) - 1), st.integers(-(1 << 31), (1 << 31) - 1)
robots = st.integers(0, 254)
header = {"session": u16, "sequence": u16}
entries = st.lists(
    st.builds(Entry, robots, i16, i16), min_size=1, max_size=16, unique_by=lambda e: e.robot
).map(tuple)
states = st.sampled_from(RobotState)

frames = st.one_of(
    st.builds(Command, **header, form=st.sampled_from(Form), age=u16, entries=entries),
    st.builds(Heartbeat, **header),
    st.builds(Stop, **header, robot=u8),
    st.builds(Arm, **header, robot=u8),
    st.builds(
        Telemetry,
        **header,
        robot=robots,
        state=states,
        flags=u8.map(RobotFlag),
        last_sequence=u16,
        hold=u16,
        counts=st.tuples(i32, i32),
        speeds=st.tuples(i16, i16),
        ranges=st.tuples(u16, u16, u16, u16),
        battery=u16,
        taken=u16,
        refused=u16,
    ),
    st.builds(
        Acknowledgement,
        **header,
        robot=robots,
        kind=st.sampled_from([Kind.STOP, Kind.ARM]),
        acknowledged=u16,
        state=states,
    ),
)

COMMAND = Command(
    session=0x1234,
    sequence=0xFFFF,
    form=Form.TWIST,
    age=20,
    entries=(Entry(3, 300, -500), Entry(7, 0, 0)),
)


@given(frames)
def test_a_frame_survives_its_bytes(frame):
    assert decode(encode(frame)) == frame


@given(frames)
def test_a_frame_fits_a_payload_of_the_radio(frame):
    assert len(encode(frame)) <= 100


def sealed(body: bytes) -> bytes:
    return body + zlib.crc32(body).to_bytes(4, "little")


@given(st.builds(lambda kind, rest: bytes([0x51, kind]) + rest, st.integers(0, 7), st.binary()))
def test_bytes_with_a_right_checksum_are_refused_or_survive_their_frame(body):
    try:
        frame = decode(sealed(body))
    except FrameError:
        return
    assert encode(frame) == sealed(body)


@given(st.binary(max_size=120))
def test_noise_is_refused(noise):
    with pytest.raises(FrameError):
        decode(noise)


def test_the_bytes_of_a_command_are_as_documented():
    body = bytes.fromhex("51 01 3412 ffff 01 02 1400 03 2c01 0cfe 07 0000 0000")
    assert encode(COMMAND) == sealed(body)


@given(frames, st.data())
def test_up_to_three_flipped_bits_are_noticed(frame, data):
    payload = bytearray(encode(frame))
    places = st.lists(st.integers(0, 8 * len(payload) - 1), min_size=1, max_size=3, unique=True)
    for bit in data.draw(places):
        payload[bit // 8] ^= 1 << bit % 8
    with pytest.raises(FrameError):
        decode(bytes(payload))


@pytest.mark.parametrize(
    ("payload", "message"),
    [
        (b"", "at least 10 bytes; got 0"),
        (sealed(b"\x52\x02\0\0\0\0"), "begins with 0x51; got 0x52"),
        (sealed(b"\x51\x02\0\0\0\0")[:-1] + b"x", "checksum"),
        (sealed(b"\x51\x09\0\0\0\0"), "kind 9 has a wrong body: unknown kind"),
        (sealed(b"\x51\x02\0\0\0\0x"), "kind 2 has a wrong body"),
        (sealed(b"\x51\x03\0\0\0\0"), "kind 3 has a wrong body"),
        (sealed(b"\x51\x01\0\0\0\0\0\0\0\0"), "`entries` must be 1 to 16; got 0"),
        (sealed(b"\x51\x01\0\0\0\0\0\x01\0\0"), "`count` must be the number of entries"),
        (sealed(b"\x51\x01\0\0\0\0\0\x02\0\0" + 2 * b"\x05\0\0\0\0"), "name each robot once"),
        (sealed(b"\x51\x06\0\0\0\0\x01\x02\0\0\x01"), "`kind` must be 3 or 4"),
    ],
)
def test_what_is_wrong_with_a_payload_is_said_in_one_line(payload, message):
    with pytest.raises(FrameError, match=message) as refusal:
        decode(payload)
    assert isinstance(refusal.value, SightfieldError)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize(
    ("wrong", "name"),
    [
        (lambda: Heartbeat(session=-1, sequence=0), "session"),
        (lambda: Heartbeat(session=0, sequence=65536), "sequence"),
        (lambda: Entry(255, 0, 0), "robot"),
        (lambda: Entry(1, 32768, 0), "first"),
        (lambda: Entry(1, 0, 1.5), "second"),
        (lambda: Command(session=0, sequence=0, form=Form.TWIST, age=0, entries=()), "entries"),
        (lambda: Stop(session=0, sequence=0, robot=256), "robot"),
    ],
)
def test_a_frame_that_has_no_bytes_cannot_be_made(wrong, name):
    with pytest.raises(InvalidInput, match=f"`{name}`"):
        wrong()


REPORT = Telemetry(
    session=7,
    sequence=9,
    robot=3,
    state=RobotState.DRIVING,
    flags=RobotFlag(0),
    last_sequence=1000,
    hold=5,
    counts=(-20, 40),
    speeds=(100, -100),
    ranges=(400, 123, 7, 0),
    battery=7600,
    taken=12,
    refused=0,
)


def test_a_million_damaged_reports_are_refused():
    whole, rng = encode(REPORT), random.Random(0)
    refused = 0
    for _ in range(10**6):
        damaged = bytearray(whole)
        # A byte changes, or several; or the frame ends early; or it is noise altogether.
        way = rng.getrandbits(3)
        if way == 0:
            damaged = rng.randbytes(rng.getrandbits(6))
        elif way == 1:
            del damaged[rng.getrandbits(5) :]
        else:
            at = int(rng.random() * len(damaged))
            damaged[at : at + way] = rng.randbytes(way - 1)
        if damaged == whole:
            continue
        try:
            decode(damaged)
        except FrameError:
            refused += 1
        else:
            raise AssertionError(f"{damaged.hex()} was taken")
    assert refused > 990_000
