"""Datagrams have one reading, whatever comes; their layout is that of the table.

The link takes each report once and in order, and knows late ones by the robot's own clock.
"""

import socket
import struct
import time
import zlib
from contextlib import contextmanager

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sightfield.hardware_io.kinds import udp_link
from sightfield.hardware_io.kinds.udp_link import (
    MODULUS,
    DatagramError,
    OrderDatagram,
    OrderKind,
    ReportDatagram,
    UdpLink,
    decode_order,
    decode_report,
    encode_order,
    encode_report,
)
from sightfield.hardware_io.links.reporting_link import Order, What
from sightfield.hardware_io.links.robot_link import LinkError, RobotFlag, RobotState
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


def report(sequence, clock, *, boot=5, robot=3, silence=200, **changes):
    values = {
        "session": 0,
        "last_sequence": 0,
        "counts": (17, -4),
        "ranges": (400, 250, 65535, 0),
        "battery": 7400,
        "hold": 0,
        "taken": 0,
        "refused": 0,
        "state": RobotState.IDLE,
        "flags": RobotFlag.LOW_BATTERY,
    }
    return encode_report(
        ReportDatagram(
            sequence=sequence,
            clock=clock % MODULUS,
            boot=boot,
            robot=robot,
            silence=silence,
            **values | changes,
        )
    )


@pytest.fixture
def link(monkeypatch):
    """A link to robot 3, not connected, by a clock that a test sets."""
    link = UdpLink([3], ["127.0.0.1:5005"])
    link.now = 100.0
    monkeypatch.setattr(udp_link.time, "monotonic", lambda: link.now)
    return link


def refused(link, data):
    with pytest.raises(udp_link.NoMessage):
        link.decode(3, data)


def test_reports_that_are_repeated_or_overtaken_are_refused(link):
    link.decode(3, report(2, 1000, counts=(1, 2)))
    refused(link, report(2, 1000, counts=(3, 4)))
    refused(link, report(1, 900, counts=(3, 4)))
    assert link.telemetry()[3].counts == (1, 2)
    link.decode(3, report(3, 1100, counts=(5, 6)))
    assert link.telemetry()[3].counts == (5, 6)


def test_after_a_reset_only_reports_from_after_it_count(link):
    link.decode(3, report(1000, 90_000, boot=5))
    link.decode(3, report(1, 10, boot=6, counts=(0, 0)))
    refused(link, report(1001, 90_100, boot=5))
    assert link.telemetry()[3].counts == (0, 0)


def test_noise_and_the_reports_of_other_numbers_are_refused(link):
    refused(link, b"")
    refused(link, report(1, 0)[:-1])
    refused(link, report(1, 0, robot=4))
    assert link.telemetry() == {}


def test_a_late_report_is_as_old_as_it_is(link):
    """The clock begins shortly before it goes round; the fastest report took the least time."""
    start = MODULUS - 250
    for k in range(10):
        link.now = 100 + 0.1 * k
        link.decode(3, report(1 + k, start + 100 * k))
        assert link.telemetry()[3].time == pytest.approx(link.now, abs=1e-6)
    link.now = 102.5
    link.decode(3, report(11, start + 2000))
    assert link.telemetry()[3].time == pytest.approx(102.0, abs=1e-6)


def test_a_deadline_is_told_by_the_robot_s_clock(link):
    ahead = Order(What.COMMAND, 7, deadline=100.4, speed=0.2504, turn_rate=-1.5)
    # Nothing is known of its clock yet: it is asked.
    assert decode_order(link.encode(3, ahead)).kind == OrderKind.HAIL
    link.decode(3, report(1, MODULUS - 100))
    link.now = 100.1
    # This one took 30 ms longer.
    link.decode(3, report(2, MODULUS - 30))
    order = decode_order(link.encode(3, ahead))
    assert (order.kind, order.sequence, order.deadline) == (OrderKind.COMMAND, 7, 300)
    assert (order.speed, order.turn_rate, order.robot) == (250, -1500, 3)
    # What is too fast for its field is as fast as can be told.
    fast = decode_order(link.encode(3, Order(What.COMMAND, 8, deadline=100.4, speed=1e9)))
    assert fast.speed == 32767


def test_reports_are_in_si_units(link):
    link.decode(3, report(1, 0))
    found = link.telemetry()[3]
    assert found.ranges == (0.4, 0.25, np.inf, 0.0)
    assert (found.battery, found.flags) == (7.4, RobotFlag.LOW_BATTERY)


@contextmanager
def board(answer):
    """A socket, and a link to it; what comes is answered once by a test's datagrams."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as own:
        own.bind(("127.0.0.1", 0))
        own.settimeout(5)
        with UdpLink([3], [f"127.0.0.1:{own.getsockname()[1]}"]) as link:
            _, peer = own.recvfrom(100)
            for data in answer:
                own.sendto(data, peer)
            until = time.monotonic() + 5
            while len(answer) > link.health().received + link.health().refused:
                assert time.monotonic() < until
                time.sleep(0.002)
            yield link, own


@pytest.mark.parametrize("silence", [201, 0])
def test_a_board_that_would_go_on_for_too_long_in_silence_is_not_armed(silence):
    with (
        board([report(1, 0, silence=silence)]) as (link, _),
        pytest.raises(LinkError, match=r"robot 3 must stop by itself after 0\.2 s"),
    ):
        link.arm(timeout=0.01)


def test_what_strangers_send_does_not_count():
    with (
        board([report(1, 0)]) as (link, own),
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger,
    ):
        link.heartbeat()
        _, peer = own.recvfrom(100)
        stranger.sendto(report(2, 100, counts=(9, 9)), peer)
        while link.health().refused == 0:
            time.sleep(0.002)
        assert link.telemetry()[3].counts == (17, -4)


@pytest.mark.parametrize(
    "addresses", [[], ["a:1"], ["a:1", "a:1"], ["a:1", "b"], ["a:1", ":2"], ["a:1", "b:65536"]]
)
def test_addresses_that_are_none_are_refused(addresses):
    with pytest.raises(InvalidInput, match=r"`radio\.addresses` must"):
        UdpLink([1, 2], addresses)


def test_a_name_that_nobody_has_is_one_line():
    link = UdpLink([1], ["no.such.robot.invalid:5005"])
    with pytest.raises(LinkError, match=r"no robot 1 at no\.such\.robot\.invalid:5005"):
        link.connect()
    with pytest.raises(LinkError, match="not open"):
        link.heartbeat()
