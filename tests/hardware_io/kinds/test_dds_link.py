"""Twists go out and odometry comes in, to a robot in another process too."""

import subprocess
import sys
import time

import numpy as np
import pytest

from sightfield.hardware_io.kinds.dds_link import DdsLink, _Driven
from sightfield.hardware_io.kinds.dds_node import (
    LOOPBACK,
    Header,
    Node,
    Odometry,
    Point,
    Pose,
    PoseWithCovariance,
    Quaternion,
    Time,
    Twist,
    TwistWithCovariance,
    Vector3,
    open_domain,
)
from sightfield.hardware_io.kinds.known_kinds import DDS
from sightfield.hardware_io.kinds.robot_kind import RobotFleet, Surroundings
from sightfield.hardware_io.links.link_record import OdometryCounts
from sightfield.hardware_io.links.reporting_link import Order, What
from sightfield.hardware_io.links.robot_link import LinkError, RobotState
from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.station.motion_checks import Chassis

CHASSIS = Chassis(track_width=0.2, counts_per_metre=1000.0)
DOMAIN = 219
# Six robots in a process of their own.
DDS_PEER = """
import time
import numpy as np
from sightfield.hardware_io.kinds.dds_driver import DdsWire, Driver
from sightfield.hardware_io.emulation.air import AirSettings
from sightfield.hardware_io.emulation.stand_in_laboratory import StandInLaboratory

wire = DdsWire([f"robot{{k}}" for k in range(1, 7)], {domain}, stamped=False)
robots = StandInLaboratory(
    range(1, 7), np.zeros((6, 3)), lambda k: Driver(0.5, stamped=False), wire, air=AirSettings()
)
with robots:
    print("up", flush=True)
    time.sleep(60)
"""


class Writer:
    """Keeps what is written."""

    def __init__(self):
        self.written = []

    def write(self, message):
        self.written.append(message)


@pytest.fixture
def link():
    """A link to robot 3 that was not connected, with a writer that keeps messages."""
    link = DdsLink([3], chassis=CHASSIS)
    link.kept = Writer()
    link._driven[3] = _Driven(link.kept, None, OdometryCounts(CHASSIS))
    return link


def odometry(second, x, y, heading, speed=0.0, rate=0.0):
    turn = Quaternion(z=np.sin(heading / 2), w=np.cos(heading / 2))
    return Odometry(
        Header(Time(second, 7), "odom"),
        "base_link",
        PoseWithCovariance(Pose(Point(x, y), turn)),
        TwistWithCovariance(Twist(Vector3(x=speed), Vector3(z=rate))),
    )


def take(link, *arguments, source=1, **options):
    link._take(3, link._driven[3], odometry(*arguments, **options), source)
    return link.telemetry()[3]


def test_counts_are_made_of_odometry(link):
    """A straight of 0.3 m, then a quarter of a circle to the left about a centre 0.5 m away."""
    assert take(link, 0, 2.0, 1.0, 0.5).counts == (0, 0)
    x, y = 2.0 + 0.3 * np.cos(0.5), 1.0 + 0.3 * np.sin(0.5)
    assert take(link, 1, x, y, 0.5).counts == (300, 300)
    centre = np.array([x - 0.5 * np.sin(0.5), y + 0.5 * np.cos(0.5)])
    for k in range(1, 31):
        heading = 0.5 + k * np.pi / 60
        place = centre + 0.5 * np.array([np.sin(heading), -np.cos(heading)])
        report = take(link, 1 + k, *place, heading)
    assert report.counts == pytest.approx((300 + 400 * np.pi / 2, 300 + 600 * np.pi / 2), abs=2)
    # One that was started anew begins elsewhere, and has not driven there.
    assert take(link, 40, 0.0, 90.0, heading).counts == report.counts


def test_what_is_repeated_overtaken_or_no_number_does_not_count(link):
    take(link, 5, 0.0, 0.0, 0.0)
    for second, x in ((5, 0.1), (4, 0.1), (6, np.nan)):
        assert take(link, second, x, 0.0, 0.0).counts == (0, 0)
    assert link.health().refused == 3


def test_states_are_of_the_last_order_and_of_what_is_seen(link):
    assert take(link, 1, 0, 0, 0.0, speed=0.3).state == RobotState.DISARMED
    link.transmit(3, Order(What.ARM, 1))
    assert take(link, 2, 0, 0, 0.0).state == RobotState.IDLE
    assert take(link, 3, 0, 0, 0.0, rate=-0.5).state == RobotState.DRIVING
    link.transmit(3, Order(What.STOP, 2))
    assert take(link, 4, 0, 0, 0.0, speed=0.3).state == RobotState.DRIVING
    assert take(link, 5, 0, 0, 0.0).state == RobotState.STOPPED


def test_before_an_arm_nothing_is_sent_and_after_a_stop_nothing_but_zeros(link):
    link.heartbeat()
    assert link.kept.written == []
    link.transmit(3, Order(What.ARM, 1))
    link.transmit(3, Order(What.COMMAND, 2, time.monotonic() + 9, 0.25, -1.5))
    link.transmit(3, Order(What.COMMAND, 3, time.monotonic() - 0.01, 0.5, 0.5))
    still = Twist()
    assert link.kept.written == [still, Twist(Vector3(x=0.25), Vector3(z=-1.5))]
    link.transmit(3, Order(What.STOP, 4))
    link.heartbeat()
    assert link.kept.written[2:] == [still, still]


ANEW = [
    # Another sends it, with a stamp from before and hardly another pose.
    {"second": 1, "x": 0.0, "source": 2},
    # It begins at its origin, from which it was not far.
    {"second": 6, "x": -1.4, "source": 1},
]


@pytest.mark.parametrize("said", ANEW)
def test_a_driver_that_begins_anew_gets_zeros_until_it_is_armed(link, said):
    drive_on = Order(What.COMMAND, 9, time.monotonic() + 9, 0.25, -1.5)
    link.transmit(3, Order(What.ARM, 1))
    assert take(link, 5, 0.0, 0.0, 0.0).state == RobotState.IDLE
    report = take(link, y=0.0, heading=0.0, **said)
    assert (report.state, report.counts) == (RobotState.DISARMED, (0, 0))
    link.transmit(3, drive_on)
    assert link.kept.written[-1] == Twist()
    again = {**said, "second": said["second"] + 1}
    assert take(link, y=0.0, heading=0.0, **again).state == RobotState.DISARMED
    link.transmit(3, Order(What.ARM, 10))
    link.transmit(3, drive_on)
    assert link.kept.written[-1] == Twist(Vector3(x=0.25), Vector3(z=-1.5))


def test_names_and_domains_that_are_none_are_refused():
    for names in (["a"], ["a", "a"], ["a", "/"]):
        with pytest.raises(InvalidInput, match="be a namespace for each robot"):
            DdsLink([1, 2], names, chassis=CHASSIS)
    with pytest.raises(InvalidInput, match=r"`radio\.options\.domain` must be 0 to 232"):
        DdsLink([1], chassis=CHASSIS, domain=233)
    with pytest.raises(LinkError, match="not open"):
        DdsLink([1], chassis=CHASSIS).stop()


def test_stamped_twists_drive_robots_that_want_them():
    fleet = RobotFleet(robots=(3,), options={"stamped": True})
    around = Surroundings(starts=np.zeros((1, 3)), silence=0.5)
    with (
        DDS.open_stand_in(fleet, around) as (laboratory, reached),
        DDS.open_link(reached) as link,
    ):
        assert reached.options["stamped"]
        assert link.arm(timeout=5) == (3,)
        drive(link, lambda: laboratory.wheel_speeds().min() > 0.2)


def drive(link, until):
    end = time.monotonic() + 10
    while not until():
        assert time.monotonic() < end
        link.send_commands(np.array([[0.3, 0.0]]))
        time.sleep(0.02)


OTHER_PROCESS = f"""
import sys, time
from sightfield.hardware_io.kinds.dds_driver import DdsWire, Driver
from sightfield.hardware_io.emulation.air import AirSettings
from sightfield.hardware_io.emulation.stand_in_laboratory import StandInLaboratory
wire = DdsWire(["rover"], {DOMAIN}, stamped=False)
board = lambda k: Driver(0.5, stamped=False)
with StandInLaboratory([3], [[0, 0, 0]], board, wire, air=AirSettings()) as laboratory:
    sys.stdin.read()
    print(laboratory.poses()[0, 0])
"""


def test_a_robot_in_another_process_drives_and_reports_its_way():
    other = subprocess.Popen(
        [sys.executable, "-c", OTHER_PROCESS], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    try:
        domain = open_domain(DOMAIN, LOOPBACK)
        with DdsLink([3], ["/rover"], chassis=CHASSIS, domain=DOMAIN) as link:
            assert link.arm(timeout=30) == (3,)
            drive(link, lambda: min(link.telemetry()[3].counts) > 100)
            assert link.stop(timeout=5) == (3,)
            counted = link.telemetry()[3].counts[0] / 1000
        gone = float(other.communicate(timeout=30)[0])
        assert gone == pytest.approx(counted, abs=0.03)
        del domain
    finally:
        other.kill()


def test_a_node_hears_its_own_domain_alone():
    domains = [open_domain(number, LOOPBACK) for number in (220, 221)]
    nodes = [Node(number) for number in (220, 221, 220)]
    readers = [node.reader("toy/odom", Odometry) for node in nodes[1:]]
    writer = nodes[0].writer("toy/odom", Odometry)
    end, heard = time.monotonic() + 10, []
    while not heard and time.monotonic() < end:
        writer.write(odometry(1, 0.25, 0.0, 0.0))
        nodes[2].wait(0.05)
        heard = nodes[2].take(readers[1])
    assert heard[0].pose.pose.position.x == 0.25
    assert nodes[1].take(readers[0]) == []
    for node in nodes:
        node.close()
    del domains


@pytest.mark.timeout(60)
def test_a_link_to_robots_that_died_stops_and_closes():
    code = DDS_PEER.format(domain=DOMAIN + 1)
    peer = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE)
    domain = open_domain(DOMAIN + 1, LOOPBACK)
    link = DdsLink(range(1, 7), chassis=CHASSIS, domain=DOMAIN + 1)
    try:
        assert peer.stdout is not None
        assert peer.stdout.readline() == b"up\n"
        link.connect()
        assert link.arm(timeout=10) == (1, 2, 3, 4, 5, 6)
        link.send_commands(np.full((6, 2), 0.1))
    finally:
        peer.kill()
        peer.communicate()
    for _ in range(5):
        link.send_commands(np.full((6, 2), 0.1))
        time.sleep(0.02)
    assert link.stop(timeout=0.3) == ()
    link.close()
    del domain
