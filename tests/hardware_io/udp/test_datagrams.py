"""Datagrams have one reading, whatever comes; their layout is that of the table."""

import struct
import zlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sightfield.hardware_io.links.robot_link import RobotFlag, RobotState
from sightfield.hardware_io.udp.datagrams import (
    DatagramError,
    OrderDatagram,
    OrderKind,
    ReportDatagram,
    decode_order,
    decode_report,
    encode_order,
    encode_report,
)
from sightfield.systems.numerics.errors import InvalidInput

u16, u32 = st.integers(0, 0xFFFF), st.integers(0, 0xFFFFFFFF)
i16, i32 = st.integers(-(1 << 15), (1 << 15) - 1), st.integers(-(1 << 31), (1 << 31) - 1)
commands = st.builds(
    OrderDatagram,
    kind=st.just(OrderKind.COMMAND),
    session=u32,
    sequence=u32,
    deadline=u32,
    speed=i16,
    turn_rate=i16,
    robot=u16,
)
stops = st.builds(OrderDatagram, kind=st.just(OrderKind.STOP), session=u32, sequence=u32, robot=u16)
reports = st.builds(
    ReportDatagram,
    **dict.fromkeys(("session", "sequence", "clock", "boot", "last_sequence"), u32),
    **dict.fromkeys(("battery", "hold", "taken", "refused", "silence", "robot"), u16),
    counts=st.tuples(i32, i32),
    ranges=st.tuples(u16, u16, u16, u16),
    state=st.sampled_from(RobotState),
    flags=st.integers(0, 31).map(RobotFlag),
)


@given(commands | stops)
def test_orders_come_back_as_they_went(order):
    assert decode_order(encode_order(order)) == order


@given(reports)
def test_reports_come_back_as_they_went(report):
    assert decode_report(encode_report(report)) == report


def test_the_layout_is_that_of_the_table():
    """Built field by field at the offsets that a board's programmer reads."""
    data = bytearray(28)
    data[:4] = b"SF\x01\x02"
    for offset, code, value in [
        (4, "<I", 0xA1B2C3D4),
        (8, "<I", 77),
        (12, "<I", 4_000_000_000),
        (16, "<h", -250),
        (18, "<h", 1500),
        (20, "<H", 6),
    ]:
        struct.pack_into(code, data, offset, value)
    struct.pack_into("<I", data, 24, zlib.crc32(data[:24]))
    order = OrderDatagram(
        kind=OrderKind.COMMAND,
        session=0xA1B2C3D4,
        sequence=77,
        deadline=4_000_000_000,
        speed=-250,
        turn_rate=1500,
        robot=6,
    )
    assert encode_order(order) == bytes(data)

    data = bytearray(60)
    data[:4] = b"SF\x01\x05"
    values = {4: 9, 8: 3, 12: 123_456, 16: 0xDEADBEEF, 20: 8}
    for offset, value in values.items():
        struct.pack_into("<I", data, offset, value)
    struct.pack_into("<ii", data, 24, -5, 70_000)
    shorts = (100, 200, 65535, 400, 7400, 12, 34, 1, 200, 6)
    struct.pack_into("<10H", data, 32, *shorts)
    data[52], data[53] = 2, 9
    struct.pack_into("<I", data, 56, zlib.crc32(data[:56]))
    report = decode_report(bytes(data))
    assert (report.session, report.sequence, report.clock) == (9, 3, 123_456)
    assert (report.boot, report.last_sequence, report.counts) == (0xDEADBEEF, 8, (-5, 70_000))
    assert (report.ranges, report.battery, report.hold) == ((100, 200, 65535, 400), 7400, 12)
    assert (report.taken, report.refused, report.silence, report.robot) == (34, 1, 200, 6)
    assert (report.state, report.flags) == (
        RobotState.DRIVING,
        RobotFlag.LOW_BATTERY | RobotFlag.LEFT_STALLED,
    )


@given(commands, st.data())
def test_no_bit_may_flip(order, data):
    payload = bytearray(encode_order(order))
    bit = data.draw(st.integers(0, 8 * len(payload) - 1))
    payload[bit // 8] ^= 1 << bit % 8
    with pytest.raises(DatagramError):
        decode_order(bytes(payload))


@given(st.binary(max_size=70))
def test_noise_is_no_datagram(noise):
    for decode in (decode_order, decode_report):
        with pytest.raises(DatagramError) as error:
            decode(noise)
        assert "\n" not in str(error.value)


@given(reports)
def test_a_report_with_a_right_checksum_and_a_wrong_field_is_none(report):
    for offset, value in ((52, 5), (53, 0), (54, 1), (3, 2)):
        payload = bytearray(encode_report(report))
        if payload[offset] == value:
            continue
        payload[offset] = value
        payload[56:] = zlib.crc32(payload[:56]).to_bytes(4, "little")
        if offset == 53:
            assert decode_report(bytes(payload)).flags == 0
        else:
            with pytest.raises(DatagramError):
                decode_report(bytes(payload))


@pytest.mark.parametrize(
    "changes",
    [
        {"session": -1},
        {"sequence": 1 << 32},
        {"speed": 1 << 15},
        {"robot": 1.0},
        {"kind": OrderKind.STOP, "speed": 3, "deadline": 0},
        {"kind": OrderKind.HAIL, "speed": 0, "deadline": 9},
    ],
)
def test_what_does_not_fit_its_field_is_refused(changes):
    good = {"kind": OrderKind.COMMAND, "session": 1, "sequence": 2, "speed": 1, "robot": 1}
    with pytest.raises(InvalidInput):
        OrderDatagram(**(good | changes))
