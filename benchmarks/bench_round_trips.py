"""How long a command and the answer to it take, with six robots, beside a controller that is busy.

The robots are a process of their own, which answers each command at once with what it said: no
kind's period of reports is in the figures. A command goes out by the kind's own link, its speed
being its number, and counts as answered when the link's thread has the report in its hands. The
link is in a process of its own, as in the station, or in that of the controller, which is a thread
that never waits. Times are by time.monotonic, which is the same for both processes. Robots are
other computers: they, as the link's process, go before whatever else this one does, where the
system lets them. How late a controller wakes that only sleeps is what the machine itself is late.
"""

import os
import subprocess
import sys
import threading
import time
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from sightfield.hardware_io.device_process.process_link import ProcessLink
from sightfield.hardware_io.kinds.dds_link import DdsLink
from sightfield.hardware_io.kinds.known_kinds import find_kind
from sightfield.hardware_io.kinds.mavlink_link import MavlinkLink
from sightfield.hardware_io.kinds.robot_kind import RobotFleet, RobotKind
from sightfield.hardware_io.links.robot_link import brisk_threads
from sightfield.systems.numerics.station.motion_checks import Chassis

pytestmark = pytest.mark.benchmarks

ROBOTS, DOMAIN = (1, 2, 3, 4, 5, 6), 224
# How many commands, one after the other, to each of the robots.
COMMANDS = int(os.environ.get("COMMANDS", "400"))

DDS_ECHO = f"""
from sightfield.hardware_io.device_process.urgency import go_first
go_first()
from sightfield.hardware_io.kinds.dds_node import *
from sightfield.hardware_io.kinds.dds_node import LOOPBACK, Node, open_domain
domain = open_domain({DOMAIN}, LOOPBACK)
node, number = Node({DOMAIN}), 0
pairs = [(node.reader(f"robot{{k}}/cmd_vel", Twist), node.writer(f"robot{{k}}/odom", Odometry))
         for k in {ROBOTS}]
print("ready", flush=True)
while True:
    node.wait(1.0)
    for reader, writer in pairs:
        for twist in node.take(reader):
            number += 1
            pose = PoseWithCovariance(Pose(Point(x=twist.linear.x)))
            writer.write(Odometry(Header(Time(0, number)), "base", pose))
"""
MAVLINK_ECHO = f"""
import selectors, socket
from sightfield.hardware_io.device_process.urgency import go_first
go_first()
from pymavlink.dialects.v20 import ardupilotmega as dialect
from sightfield.hardware_io.kinds.mavlink_link import AUTOPILOT, GUIDED, Packer
ready = selectors.DefaultSelector()
for k in {ROBOTS}:
    each = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    each.bind(("127.0.0.1", 0))
    ready.register(each, selectors.EVENT_READ, Packer(k, AUTOPILOT, None))
    print(each.getsockname()[1], flush=True)
armed = dialect.MAV_MODE_FLAG_SAFETY_ARMED
while True:
    for key, _ in ready.select():
        payload, peer = key.fileobj.recvfrom(2048)
        for message in key.data.unpack(payload):
            if message.get_type() == "SET_POSITION_TARGET_LOCAL_NED":
                ways = [message.vx, message.vx, *[0.0] * 14]
                answer = dialect.MAVLink_wheel_distance_message(0, 2, ways)
                key.fileobj.sendto(key.data.pack(answer), peer)
            elif message.get_type() == "COMMAND_LONG":
                answer = dialect.MAVLink_heartbeat_message(10, 3, armed, GUIDED, 4, 3)
                key.fileobj.sendto(key.data.pack(answer), peer)
"""


class Notes:
    """Of a link: when each answer came, by robot and number, written to a file as it closes."""

    def __init__(self, file):
        self.file, self.came = Path(file), {}

    def note(self, robot, speed):
        self.came.setdefault((robot, round(1000 * speed)), time.monotonic())

    def write(self):
        lines = [f"{robot} {number} {at!r}" for (robot, number), at in self.came.items()]
        self.file.write_text("\n".join(lines))


class TimedDds(DdsLink):
    """Notes what the odometry says, which is the speed that was told."""

    def _take(self, robot, driven, odometry, source):
        self.notes.note(robot, odometry.pose.pose.position.x)
        super()._take(robot, driven, odometry, source)

    def close(self):
        super().close()
        self.notes.write()


class TimedMavlink(MavlinkLink):
    """Notes how far wheels went, which is the speed that was told."""

    def _take(self, vehicle, message, now):
        if message.get_type() == "WHEEL_DISTANCE":
            self.notes.note(message.get_srcSystem(), message.distance[0])
        super()._take(vehicle, message, now)

    def close(self):
        super().close()
        self.notes.write()


def timed_dds(fleet):
    # Speeds beyond a robot's are no jump to this one.
    link = TimedDds(fleet.robots, chassis=Chassis(top_speed=1e9), domain=DOMAIN, loopback=True)
    link.notes = Notes(fleet.port)
    return link


def timed_mavlink(fleet):
    link = TimedMavlink(fleet.robots, fleet.addresses, counts_per_metre=1000.0)
    link.notes = Notes(fleet.port)
    return link


DDS = RobotKind(name="dds", silence=0.5, link=timed_dds, stand_in=pytest.fail)
MAVLINK = RobotKind(name="mavlink", silence=3.0, link=timed_mavlink, stand_in=pytest.fail)


@contextmanager
def linked(kind, own_process, notes):
    """A link of a kind to robots in another process that answer; what it notes is in a file."""
    code = DDS_ECHO if kind == "dds" else MAVLINK_ECHO
    other = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    assert other.stdout is not None
    try:
        lines = 1 if kind == "dds" else len(ROBOTS)
        ports = [other.stdout.readline().strip() for _ in range(lines)]
        addresses = tuple(f"127.0.0.1:{port}" for port in ports)
        fleet = RobotFleet(robots=ROBOTS, addresses=addresses, port=str(notes))
        name = f"{Path(__file__).stem}:{kind.upper()}"
        link = ProcessLink(name, fleet) if own_process else find_kind(name).open_link(fleet)
        link.connect()
        assert link.arm(timeout=5.0) == ROBOTS
        yield link
        link.close()
    finally:
        other.kill()


def command(link, rate, first):
    """Commands from a number on, at a rate [1/s]: when each went, and how late that was [s]."""
    told, late, due = {}, [], time.monotonic()
    for number in range(first, first + COMMANDS):
        due += 1.0 / rate
        time.sleep(max(due - time.monotonic(), 0.0))
        told[number] = time.monotonic()
        late.append(told[number] - due)
        link.send_commands(np.tile([number / 1000, 0.0], (len(ROBOTS), 1)))
    time.sleep(0.1)
    return told, late


@contextmanager
def controller(busy):
    """Something in Python that never waits, in a thread."""
    ends = threading.Event()

    def work():
        total = 0
        while not ends.is_set():
            total += sum(k * k for k in range(100))

    thread = threading.Thread(target=work, daemon=True)
    if busy:
        thread.start()
    yield
    ends.set()
    if busy:
        thread.join()


@pytest.mark.parametrize("own_process", [True, False])
@pytest.mark.parametrize("kind", ["dds", "mavlink"])
def test_round_trips(kind, own_process, tmp_path, monkeypatch):
    # Where the other process finds the kinds of this file.
    monkeypatch.syspath_prepend(Path(__file__).parent)
    phases, first = {}, 1
    with linked(kind, own_process, tmp_path / "notes") as link, brisk_threads():
        for rate in (20, 100):
            for busy in (False, True):
                with controller(busy):
                    phases[rate, busy] = command(link, rate, first)
                first += COMMANDS
    came = {}
    for line in (tmp_path / "notes").read_text().splitlines():
        robot, number, at = line.split()
        came[int(robot), int(number)] = float(at)
    where = "a process of its own" if own_process else "the controller's process"
    print()
    for (rate, busy), (told, late) in phases.items():
        pairs = [(robot, number) for number in told for robot in ROBOTS]
        took = np.array([1000 * (came[each] - told[each[1]]) for each in pairs if each in came])
        print(
            f"{kind} {rate} Hz, link in {where}, controller {'busy' if busy else 'idle'}: "
            f"median {np.median(took):.2f} ms, p99 {np.quantile(took, 0.99):.2f} ms, most "
            f"{took.max():.1f} ms, not answered {len(pairs) - len(took)}; the controller itself "
            f"woke late by {1000 * np.quantile(late, 0.99):.2f} ms (p99); "
            f"load {os.getloadavg()[0]:.1f}"
        )
