"""How long a command and the answer to it take, with six robots, beside a controller that is busy.

The robots are a process of their own, which answers each command at once with what it said: no
kind's period of reports is in the figures. A command goes out by the kind's own link, its speed
being its number, and counts as answered when the link's thread has the report in its hands. The
controller is a thread of the link's process, as in the station, that never waits.
"""

import subprocess
import sys
import threading
import time
from contextlib import contextmanager

import numpy as np
import pytest

from sightfield.hardware_io.dds.dds_link import DdsLink
from sightfield.hardware_io.dds.node import LOOPBACK, open_domain
from sightfield.hardware_io.links.robot_link import brisk_threads
from sightfield.hardware_io.mavlink.mavlink_link import MavlinkLink
from sightfield.systems.numerics.station.motion_checks import Chassis

pytestmark = pytest.mark.benchmarks

ROBOTS, DOMAIN = (1, 2, 3, 4, 5, 6), 224
# How many commands, one after the other, to each of the robots.
COMMANDS = 400

DDS_ECHO = f"""
from sightfield.hardware_io.dds.messages import *
from sightfield.hardware_io.dds.node import LOOPBACK, Node, open_domain
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
from pymavlink.dialects.v20 import ardupilotmega as dialect
from sightfield.hardware_io.mavlink.packets import AUTOPILOT, Packer
ready = selectors.DefaultSelector()
for k in {ROBOTS}:
    each = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    each.bind(("127.0.0.1", 0))
    ready.register(each, selectors.EVENT_READ, Packer(k, AUTOPILOT, None))
    print(each.getsockname()[1], flush=True)
while True:
    for key, _ in ready.select():
        payload, peer = key.fileobj.recvfrom(2048)
        for message in key.data.unpack(payload):
            if message.get_type() == "SET_POSITION_TARGET_LOCAL_NED":
                ways = [message.vx, message.vx, *[0.0] * 14]
                answer = dialect.MAVLink_wheel_distance_message(0, 2, ways)
                key.fileobj.sendto(key.data.pack(answer), peer)
"""


class Answers:
    """When each command was answered, by robot and number."""

    def __init__(self):
        self.came = {}

    def note(self, robot, speed):
        self.came.setdefault((robot, round(1000 * speed)), time.perf_counter())


class TimedDds(DdsLink):
    """Notes what the odometry says, which is the speed that was told."""

    def _take(self, robot, driven, odometry):
        self.answers.note(robot, odometry.pose.pose.position.x)
        super()._take(robot, driven, odometry)


class TimedMavlink(MavlinkLink):
    """Notes how far wheels went, which is the speed that was told."""

    def _take(self, vehicle, message, now):
        if message.get_type() == "WHEEL_DISTANCE":
            self.answers.note(message.get_srcSystem(), message.distance[0])
        super()._take(vehicle, message, now)


@contextmanager
def linked(kind):
    """A link of a kind to robots in another process that answer."""
    code = DDS_ECHO if kind == "dds" else MAVLINK_ECHO
    other = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    assert other.stdout is not None
    domain = None
    try:
        if kind == "dds":
            other.stdout.readline()
            domain = open_domain(DOMAIN, LOOPBACK)
            link = TimedDds(ROBOTS, chassis=Chassis(), domain=DOMAIN)
        else:
            ports = [other.stdout.readline().strip() for _ in ROBOTS]
            addresses = [f"127.0.0.1:{port}" for port in ports]
            link = TimedMavlink(ROBOTS, addresses, counts_per_metre=1000.0)
        link.answers = Answers()
        link.connect()
        # Commands go out only once robots were armed, whether these say so or not.
        link.arm(timeout=0.5)
        time.sleep(0.5)
        yield link
        link.close()
    finally:
        other.kill()
        del domain


def round_trips(link, rate):
    """Of each command to each robot that was answered [ms], and how many were not."""
    link.answers.came.clear()
    told, due = {}, time.perf_counter()
    for number in range(1, COMMANDS + 1):
        due += 1.0 / rate
        time.sleep(max(due - time.perf_counter(), 0.0))
        told[number] = time.perf_counter()
        link.send_commands(np.tile([number / 1000, 0.0], (len(ROBOTS), 1)))
    time.sleep(0.3)
    took = [
        1000 * (came - told[number])
        for (_, number), came in link.answers.came.items()
        if number in told
    ]
    return np.array(took), COMMANDS * len(ROBOTS) - len(took)


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


@pytest.mark.parametrize("kind", ["dds", "mavlink"])
def test_round_trips(kind):
    print()
    with linked(kind) as link:
        for rate in (20, 100):
            for busy, brisk in ((False, True), (True, True), (True, False)):
                with brisk_threads() if brisk else controller(False), controller(busy):
                    took, lost = round_trips(link, rate)
                print(
                    f"{kind} {rate} Hz, controller {'busy' if busy else 'idle'}"
                    f"{'' if brisk else ', threads as Python has them'}: "
                    f"median {np.median(took):.2f} ms, p99 {np.quantile(took, 0.99):.2f} ms, "
                    f"most {took.max():.1f} ms, not answered {lost}"
                )
