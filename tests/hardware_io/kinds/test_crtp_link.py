"""CRTP: cflib's own client talks to what stands in, and the link says what cflib says."""

import struct
import threading
import time

import numpy as np
import pytest
from cflib import crtp
from cflib.crazyflie import Crazyflie as Client
from cflib.crazyflie.log import LogConfig

from sightfield.hardware_io.emulation.air import AirSettings
from sightfield.hardware_io.emulation.stand_in_laboratory import (
    DatagramWire,
    Sensed,
    StandInLaboratory,
)
from sightfield.hardware_io.kinds.crazyflie import Crazyflie
from sightfield.hardware_io.kinds.crtp_link import CrtpLink, _Vehicle
from sightfield.hardware_io.links.link_record import OdometryCounts
from sightfield.hardware_io.links.reporting_link import Order, What
from sightfield.hardware_io.links.robot_link import LinkError, RobotState
from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.station.motion_checks import Chassis

CHASSIS = Chassis(track_width=0.2, counts_per_metre=1000.0)
# In a packet's first byte: port, two bits that are set, channel.
HOVER, ARM, ARM_LEGACY = 0x7C, 0x9D, 0xDC


class Driver:
    """Keeps what is sent."""

    def __init__(self):
        self.sent = []

    def send_packet(self, packet):
        self.sent.append(bytes([packet.header, *packet.data]))


@pytest.fixture
def link():
    """A link to robot 3 that was not connected, whose packets are kept."""
    link = CrtpLink([3], ["udp://127.0.0.1:19850"], chassis=CHASSIS, height=0.75)
    vehicle = _Vehicle(Driver(), OdometryCounts(CHASSIS), version=12)
    link._vehicles[3], link.kept, link.vehicle = vehicle, vehicle.driver.sent, vehicle
    return link


def command(speed, rate, late=False):
    deadline = time.monotonic() + (-0.01 if late else 9)
    return Order(What.COMMAND, 2, deadline, speed, rate)


@pytest.mark.parametrize(
    ("version", "kind", "sign"), [(12, 10, 1), (9, 10, 1), (8, 5, -1), (0, 5, -1)]
)
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_a_command_is_a_speed_over_the_ground_in_degrees(link, version, kind, sign):
    link.vehicle.version = version
    link.transmit(3, command(0.25, -1.5))
    link.transmit(3, command(0.5, 0.5, late=True))
    (sent,) = link.kept
    assert sent[:2] == bytes([HOVER, kind])
    wanted = (0.25, 0.0, sign * np.degrees(-1.5), 0.75)
    assert struct.unpack("<4f", sent[2:]) == pytest.approx(wanted)
    board = Crazyflie(0.5, version=version)
    board.take(bytes([ARM if version >= 12 else ARM_LEGACY, 1, 1]), 0.0)
    board.take(sent, 1.0)
    assert board.targets(1.4) == pytest.approx((0.25, -1.5))
    assert board.targets(1.6) is None


def test_a_stop_cuts_motors_and_disarms(link):
    for what in (What.ARM, What.STOP, What.HAIL):
        link.transmit(3, Order(what, 1))
    arm, cut, disarm = link.kept
    assert (arm, cut, disarm) == (bytes([ARM, 1, 1]), bytes([HOVER, 0]), bytes([ARM, 1, 0]))
    board, hover = Crazyflie(0.5), bytes([HOVER, 10]) + struct.pack("<4f", 0.3, 0, 0, 0.4)
    steps = [(hover, False), (arm, False), (hover, True), (cut, False), (hover, True)]
    for packet, drives in [*steps, (disarm, False), (hover, False)]:
        board.take(packet, 1.0)
        assert (board.targets(1.0) is not None) == drives


def test_before_the_version_is_known_nothing_is_said(link):
    link.vehicle.version = -1
    link.transmit(3, command(0.25, 1.0))
    link.transmit(3, Order(What.ARM, 3))
    assert link.kept == []


def logged(stamp, x, yaw, info=2, battery=3.7):
    return bytes([1]) + stamp.to_bytes(3, "little") + struct.pack("<4fH", x, 0, yaw, battery, info)


def test_reports_are_newer_than_the_last_and_give_states_and_counts(link):
    def take(stamp, x, yaw=0.0, **options):
        good = link._take(3, link.vehicle, (5, 2), logged(stamp, x, yaw, **options), now=1.0)
        return good, link.telemetry()[3]

    last = (1 << 24) - 10
    assert take(last, 0.25, info=0)[1].state == RobotState.DISARMED
    # The stamp goes round.
    good, report = take(40, 0.35)
    assert (good, report.state, report.counts) == (True, RobotState.DRIVING, (100, 100))
    assert report.battery == pytest.approx(3.7)
    for stamp, x in ((40, 0.5), (last, 0.5), (90, np.nan)):
        assert take(stamp, x) == (False, report)
    # A turn to the left on the spot; degrees jump from 180 to -180.
    assert take(90, 0.35, 175.0)[1].state == RobotState.IDLE
    before = link.telemetry()[3].counts
    after = take(140, 0.35, -175.0)[1].counts
    turned = np.radians(10) * 0.1 * 1000
    assert np.subtract(after, before) == pytest.approx((-turned, turned), abs=1)


def test_cflibs_own_client_connects_to_what_stands_in_and_logs(tmp_path):
    if not crtp.CLASSES:
        crtp.init_drivers()
    wire, starts = DatagramWire(1), np.array([[1.0, 2.0, 0.0]])
    with StandInLaboratory([3], starts, lambda k: Crazyflie(1.0), wire, air=AirSettings()) as lab:
        client, up, rows = Client(rw_cache=str(tmp_path)), threading.Event(), []
        client.connected.add_callback(lambda uri: up.set())
        client.open_link(f"udp://{wire.addresses[0]}")
        assert up.wait(10)
        block = LogConfig("where", 20)
        for name in ("stateEstimate.yaw", "supervisor.info", "pm.vbat"):
            block.add_variable(name)
        client.log.add_config(block)
        block.data_received_cb.add_callback(lambda stamp, values, _: rows.append(values))
        block.start()
        client.supervisor.send_arming_request(True)
        end = time.monotonic() + 10
        while not (rows and rows[-1]["stateEstimate.yaw"] > 20.0) and time.monotonic() < end:
            client.commander.send_hover_setpoint(0.0, 0.0, 90.0, 0.4)
            time.sleep(0.02)
        turned, last = np.degrees(lab.poses()[0, 2]), rows[-1]
        client.close_link()
    assert last["supervisor.info"] == 2
    assert last["pm.vbat"] == pytest.approx(lab.body.battery)
    assert 15 < turned < 60


def test_nonsense_harms_nobody(link):
    rng, board = np.random.default_rng(5), Crazyflie(0.5)
    sensed = Sensed((0, 0), (0.0, 0.0), (0.0, 0.0, 7.0), (1.0,) * 4, 7.4)
    for _ in range(3000):
        packet = rng.bytes(int(rng.integers(0, 40)))
        # Ports that mean something, more often than by chance.
        if packet and rng.random() < 0.8:
            first = int(rng.choice([0x5C, 0x5D, 0x5E, HOVER, ARM, 0xDD]))
            packet = bytes([first]) + packet[1:]
        board.take(packet, 1.0)
        assert all(len(each) > 1 for each in board.reports(2.0, sensed))
        if packet:
            link.take(3, packet)
    assert np.isfinite(board.targets(1.0) or 0.0).all()


def test_what_is_no_address_is_refused():
    for addresses in ([], ["127.0.0.1:5"], ["udp://a:1"] * 2, ["udp://a:1", "tcp://b:2"]):
        with pytest.raises(InvalidInput, match=r"`radio\.addresses` must name 2 robots, as radio"):
            CrtpLink([1, 2], addresses, chassis=CHASSIS)
    with pytest.raises(InvalidInput, match="height"):
        CrtpLink([1], ["udp://a:1"], chassis=CHASSIS, height=0.0)
    with pytest.raises(LinkError, match="not open"):
        CrtpLink([1], ["udp://a:1"], chassis=CHASSIS).stop()


def test_without_a_radio_one_line_says_so():
    link = CrtpLink([1], ["radio://0/80/2M/E7E7E7E701"], chassis=CHASSIS)
    with pytest.raises(LinkError, match="no way to radio://0/80/2M/E7E7E7E701: "):
        link.connect()
