"""What links send when, and what they make of what comes, without radios and by a set clock."""

from types import SimpleNamespace

import numpy as np
import pytest
from digi.xbee.exception import XBeeException
from digi.xbee.models.address import XBee64BitAddress
from digi.xbee.models.status import TransmitStatus
from digi.xbee.packets.raw import RX64Packet, TXStatusPacket
from serial import SerialException, SerialTimeoutException

from sightfield.hardware_io.kinds import crtp_link, xbee_link
from sightfield.hardware_io.kinds.crtp_link import CrtpLink, _Vehicle
from sightfield.hardware_io.kinds.known_kinds import KINDS, find_kind
from sightfield.hardware_io.kinds.robot_kind import RobotFleet
from sightfield.hardware_io.kinds.xbee_frames import (
    Acknowledgement,
    Arm,
    Command,
    Form,
    Heartbeat,
    Kind,
    Stop,
    Telemetry,
    decode,
    encode,
)
from sightfield.hardware_io.kinds.xbee_link import RadioError, RadioLink, XBeePort
from sightfield.hardware_io.links import robot_link
from sightfield.hardware_io.links.link_record import OdometryCounts
from sightfield.hardware_io.links.robot_link import RobotFlag, RobotState
from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.station.motion_checks import Chassis


@pytest.fixture
def clock(monkeypatch):
    made = SimpleNamespace(now=50.0)
    for module in (xbee_link, crtp_link, robot_link):
        monkeypatch.setattr(module, "time", SimpleNamespace(monotonic=lambda: made.now))
    return made


class Module:
    """Takes the place of the radio's module, and keeps what it is given to send."""

    def __init__(self):
        self.sent, self.full = [], False

    def send(self, payload, address=None, *, urgent=False):
        if self.full:
            return None
        self.sent.append((decode(payload), address, urgent))
        return len(self.sent)


@pytest.fixture
def radio(clock):
    """A function of robots and options: a link over such a module, and what was sent."""

    def make(robots=(3, 8), **options):
        link = RadioLink("/dev/null", robots, **options)
        link._module, link._session = Module(), 0x0107
        return link, link._module.sent

    return make


def telemetry(robot=3, session=0x0107, last=2, **options):
    return Telemetry(
        **{
            "session": session,
            "sequence": 9,
            "robot": robot,
            "state": RobotState.DRIVING,
            "flags": RobotFlag.SATURATED,
            "last_sequence": last,
            "hold": 20,
            "counts": (5, -6),
            "speeds": (1, 2),
            "ranges": (100, 200, 300, 400),
            "battery": 7400,
            "taken": 4,
            "refused": 0,
            **options,
        }
    )


def test_commands_are_sent_in_thousandths_with_the_age_of_their_poses(radio, clock):
    link, sent = radio()
    link.send_commands(np.array([[0.3, -1.5], [40.0, -40.0]]), age=0.12)
    link.heartbeat()
    link.send_wheel_speeds(np.array([[0.1, 0.2], [0.3, 0.4]]), np.array([True, False]), age=99.0)
    link.send(np.zeros(2), np.zeros(2), 5, clock.now + 9.0)
    (first, *_), (second, *_), (third, *_), (fourth, *_) = sent
    assert isinstance(first, Command)
    assert (first.form, first.age, first.session, first.sequence) == (Form.TWIST, 120, 0x0107, 1)
    told = [(each.robot, each.first, each.second) for each in first.entries]
    assert told == [(3, 300, -1500), (8, 32767, -32768)]
    assert second == Heartbeat(session=0x0107, sequence=2)
    assert (third.form, third.age) == (Form.WHEELS, 65535)
    assert [(each.first, each.second) for each in third.entries] == [(100, 200), (0, 0)]
    assert fourth.age == 0
    assert [each[1:] for each in sent] == [(None, False)] * 4


def test_a_large_team_is_told_by_sixteens_or_one_by_one(radio):
    link, sent = radio(tuple(range(20)))
    link.send_commands(np.zeros((20, 2)))
    assert [len(frame.entries) for frame, *_ in sent] == [16, 4]
    link, sent = radio((3, 8), unicast=True)
    link._take_payload(encode(telemetry(8)), b"address8", -40)
    link.send_commands(np.zeros((2, 2)))
    assert [(frame.entries[0].robot, address) for frame, address, _ in sent] == [
        (3, None),
        (8, b"address8"),
    ]
    # What is sent to one is acknowledged by the module, or not.
    link._take_status(2, True)
    link._take_status(2, False)
    link._take_status(1, True)
    assert (link.health().acknowledged, link.health().lost) == (1, 0)
    link.send_commands(np.zeros((2, 2)))
    link._take_status(4, False)
    assert (link.health().acknowledged, link.health().lost) == (1, 1)


def test_what_comes_is_reported_once_it_is_whole(radio, clock):
    link, _ = radio()
    said = []
    link.on_report = lambda: said.append(link.telemetry()[3])
    link.heartbeat()
    link.heartbeat()
    clock.now += 0.08
    link._take_payload(encode(telemetry()), b"a", -61)
    link._take_payload(b"noise", b"a", -62)
    (report,) = said
    assert (report.state, report.flags, report.counts) == (2, 4, (5, -6))
    assert (report.ranges, report.battery) == ((0.1, 0.2, 0.3, 0.4), 7.4)
    assert report.time == clock.now
    health = link.health()
    assert (health.received, health.refused, health.rssi, health.sent) == (1, 1, -62, 2)
    assert health.round_trip == pytest.approx(0.06)
    # One that took 40 ms longer is late by what passes 10 ms.
    for _ in range(2):
        link.heartbeat()
        clock.now += 0.08
        link._take_payload(encode(telemetry(last=link._frames)), b"a", -61)
    link.heartbeat()
    clock.now += 0.12
    link._take_payload(encode(telemetry(last=link._frames)), b"a", -61)
    assert said[-1].time == pytest.approx(clock.now - 0.03)


def acknowledged(link, frame, robots):
    for robot in robots:
        link._take_payload(
            encode(
                Acknowledgement(
                    session=frame.session,
                    sequence=1,
                    robot=robot,
                    kind=Kind.ARM if isinstance(frame, Arm) else Kind.STOP,
                    acknowledged=frame.sequence,
                    state=RobotState.IDLE,
                )
            ),
            b"a",
            -50,
        )


def test_an_arm_opens_a_session_and_a_stop_ends_what_was_armed(radio):
    link, sent = radio()
    send = link._module.send

    def answer(payload, address=None, *, urgent=False):
        number = send(payload, address, urgent=urgent)
        acknowledged(link, sent[-1][0], (8,))
        return number

    link._module.send = answer
    assert link.arm(timeout=0.0) == (8,)
    assert sent[-1][0] == Arm(session=0x0108, sequence=1)
    link.arm_again([3, 8])
    assert [frame for frame, *_ in sent[1:]] == [
        Arm(session=0x0108, sequence=2, robot=3),
        Arm(session=0x0108, sequence=3, robot=8),
    ]
    assert link.stop(timeout=0.0) == (8,)
    assert (sent[-1][0], sent[-1][2]) == (Stop(session=0x0108, sequence=4), True)
    link.arm_again([3])
    assert len(sent) == 4
    health = link.health()
    assert (health.acknowledged, health.lost, health.retried) == (2, 2, 0)
    link._session = 0xFFFF
    link.arm(timeout=0.0)
    assert sent[-1][0].session == 0


def test_a_stop_is_said_every_20_and_an_arm_every_80_milliseconds_until_the_time_is_over(
    radio, clock, pauses_of
):
    link, sent = radio()
    link._changed = pauses_of(clock)
    assert link.arm(timeout=0.19) == ()
    assert link._changed.pauses == [0.08, 0.08, 0.03]
    assert link.stop(timeout=0.05) == ()
    assert link._changed.pauses[3:] == [0.02, 0.02, 0.01]
    assert (len(sent), link.health().retried, link.health().lost) == (6, 4, 4)
    with pytest.raises(InvalidInput, match="`timeout`"):
        link.arm(timeout=-0.01)


def test_frames_that_find_no_room_are_not_counted_as_sent(radio):
    link, sent = radio()
    link._module.full = True
    link.heartbeat()
    assert (link.health().sent, sent) == (0, [])
    link._module.full, link._frames = False, 0xFFFF
    link.heartbeat()
    assert sent[-1][0].sequence == 0


class Device:
    """Takes the place of digi's device."""

    def __init__(self):
        self.packets, self.failure, self.number = [], None, 0

    def get_next_frame_id(self):
        self.number += 1
        return self.number

    def send_packet(self, packet):
        if self.failure is not None:
            raise self.failure
        self.packets.append(packet)


@pytest.fixture
def port(clock):
    made, said = XBeePort("/dev/x", 9600, lambda *each: said.append(each), None), []
    made._on_status = lambda *each: said.append(each)
    made._device, made.said = Device(), said
    return made


def confirm(port, frame_id, status=TransmitStatus.SUCCESS):
    port._receive(TXStatusPacket(frame_id, status))


def test_four_frames_at_most_wait_for_the_module_unless_they_are_urgent(port, clock):
    assert [port.send(b"x") for _ in range(5)] == [1, 2, 3, 4, None]
    assert port.send(b"x", urgent=True) == 5
    confirm(port, 1)
    confirm(port, 2, TransmitStatus.NO_ACK)
    assert port.said == [(1, True), (2, False)]
    assert port.send(b"x") == 6
    assert port.send(b"x") is None
    packet = port._device.packets[0]
    assert packet.frame_id == 1
    assert packet.x64bit_dest_addr == XBee64BitAddress.BROADCAST_ADDRESS
    port._device.failure = SerialTimeoutException("full")
    confirm(port, 3)
    assert port.send(b"x") is None
    port._device.failure = SerialException("unplugged\nreally")
    with pytest.raises(RadioError, match=r"the radio at /dev/x has gone: unplugged$"):
        port.send(b"x", urgent=True)


def test_a_module_that_confirms_nothing_for_half_a_second_has_gone(port, clock):
    for _ in range(4):
        port.send(b"x")
    clock.now += 0.5
    assert port.send(b"x") is None
    clock.now += 0.001
    with pytest.raises(RadioError, match=r"has confirmed no frame for 0\.5 s"):
        port.send(b"x")
    # One that has confirmed others lately has lost some, and they are forgotten.
    confirm(port, 99)
    assert port.send(b"x") is None
    clock.now += 0.501
    assert port.send(b"x") == 5
    assert len(port._unconfirmed) == 1


class Opened(Device):
    """A device that is opened, or not, and closed."""

    def __init__(self, done, failure=None):
        super().__init__()
        self.done, self.failure = done, failure
        self.serial_port = SimpleNamespace(
            write_timeout=None, reset_output_buffer=lambda: done.append("reset")
        )

    def open(self):
        if self.failure is not None:
            raise self.failure

    def close(self):
        self.done.append("close")

    def add_packet_received_callback(self, hear):
        self.done.append("hear")

    def del_packet_received_callback(self, hear):
        self.done.append("hear no more")


def test_a_module_is_opened_with_a_patience_and_closed_whatever_answers(port, monkeypatch):
    asked, done = [], []

    def device(failure):
        def make(*words, **options):
            asked.append((*words, options))
            made.append(Opened(done, failure))
            return made[-1]

        made = []
        monkeypatch.setattr(xbee_link, "Raw802Device", make)
        return made

    made = device(None)
    with port:
        assert made[0].serial_port.write_timeout == 0.1
    assert asked == [("/dev/x", 9600, {"_sync_ops_timeout": 3})]
    assert done == ["hear", "hear no more", "reset", "close"]
    with pytest.raises(RadioError, match="is not open"):
        port.send(b"x")
    port.__exit__()
    assert len(done) == 4
    device(XBeeException("no answer\nat all"))
    with pytest.raises(RadioError, match=r"answers at /dev/x with 9600 baud: no answer$"):
        port.__enter__()
    assert done[4:] == ["close"]
    device(SerialException("none"))
    with pytest.raises(RadioError, match="no radio at /dev/x: none"):
        port.__enter__()
    assert len(done) == 5


def test_what_the_module_receives_is_passed_on(port):
    address = XBee64BitAddress(bytes(range(8)))
    port._receive(RX64Packet(address, 61, 0, rf_data=bytearray(b"data")))
    assert port.said == [(b"data", bytes(range(8)), -61)]


def test_a_vehicle_is_asked_again_a_tenth_of_a_second_later_until_it_reports(clock):
    link = CrtpLink([3], ["udp://127.0.0.1:19850"], chassis=Chassis())
    asked = []

    def receive_packet(patience):
        assert patience == 0.05
        clock.now += 0.03
        # A report comes at last, and is followed by silence.
        if len(rows) > 20:
            link._closing.set()
        rows.append(clock.now)
        if len(rows) == 8:
            vehicle.came = clock.now

    rows = []
    driver = SimpleNamespace(receive_packet=receive_packet, send_packet=None)
    vehicle = link._vehicles[3] = _Vehicle(driver, OdometryCounts(Chassis()))

    def ask(vehicle, now):
        vehicle.asked = now
        asked.append(round((now - 50.0) / 0.03))

    link._ask = ask
    link._listen(3, vehicle)
    assert asked == [1, 5, 22]


def test_kinds_are_found_by_name_and_have_their_silences():
    silences = {name: find_kind(name).stops_after for name in KINDS}
    assert silences == {"xbee": 0.18, "udp": 0.2, "mavlink": 3.0, "dds": 0.5, "crtp": 2.0}
    told = {name: sorted(find_kind(name).recognises) for name in KINDS}
    everything = ["late", "reordered", "repeated"]
    assert told == {
        "xbee": ["reordered", "repeated"],
        "udp": everything,
        "mavlink": [],
        "dds": [],
        "crtp": [],
    }
    for name in ("json:dumps", "json:nothing", "no_such_module:KIND", "pigeon"):
        with pytest.raises(InvalidInput, match=r"`radio\.kind` must"):
            find_kind(name)


def test_options_of_links_have_their_types():
    fleet = RobotFleet(robots=(1,), options={"height": 2, "stamped": True, "domain": True})
    assert fleet.option("height", 0.4) == 2.0
    assert isinstance(fleet.option("height", 0.4), float)
    assert fleet.option("other", 0.4) == 0.4
    assert fleet.option("stamped", False) is True
    for name, default in (("domain", 0), ("stamped", 0.5), ("height", "x")):
        with pytest.raises(InvalidInput, match=rf"`radio\.options\.{name}` must be of type"):
            fleet.option(name, default)


def test_a_link_is_opened_with_the_options_that_its_kind_has():
    addresses = ("udp://127.0.0.1:1",)
    fleet = RobotFleet(robots=(3,), addresses=addresses, options={"height": 0.9})
    assert KINDS["crtp"].open_link(fleet)._height == 0.9
    assert KINDS["crtp"].open_link(RobotFleet(robots=(3,), addresses=addresses))._height == 0.4
    wrong = RobotFleet(robots=(3,), addresses=addresses, options={"depth": 0.9})
    with pytest.raises(InvalidInput, match=r"be one that kind crtp has \(height\)"):
        KINDS["crtp"].open_link(wrong)
    options = {"domain": 7, "stamped": True, "command": "c", "odometry": "o", "loopback": True}
    link = KINDS["dds"].open_link(RobotFleet(robots=(3,), options=options))
    assert (link._domain, link._stamped, link._command, link._odometry) == (7, True, "c", "o")
    assert link._loopback is True
    link = KINDS["dds"].open_link(RobotFleet(robots=(3,)))
    assert (link._domain, link._stamped, link._loopback) == (0, False, False)
    for domain, good in ((0, True), (232, True), (233, False), (-1, False)):
        fleet = RobotFleet(robots=(3,), options={"domain": domain})
        if good:
            assert KINDS["dds"].open_link(fleet)._domain == domain
        else:
            with pytest.raises(InvalidInput, match="be 0 to 232"):
                KINDS["dds"].open_link(fleet)
