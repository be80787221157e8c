"""Robots on ROS 2 whose bodies are ir-sim's; runs in an environment of its own.

Usage: irsim_plant.py WORLD DOMAIN, with a world file of ir-sim. Each robot follows Twist on
`robotK/cmd_vel`, stops after half a second of silence, and says Odometry; its true pose is
PoseStamped on `bodyK/pose`, as of a motion capture. Of where all are, each line of standard output
has `time` [s], `poses` [m], [m], [rad] and `collided`.
"""

import json
import math
import sys
import time

import irsim
import numpy as np
from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

from sightfield.hardware_io.kinds.dds_node import (
    Header,
    Odometry,
    Point,
    Pose,
    PoseStamped,
    PoseWithCovariance,
    Quaternion,
    Time,
    Twist,
    TwistWithCovariance,
    Vector3,
)

# As of ros2_control's differential drive [s].
SILENCE = 0.5
# Steps between two messages of odometry, and two lines.
ODOMETRY, LINES = 5, 2
QUALITY = Qos(
    Policy.Reliability.Reliable(0), Policy.Durability.Volatile, Policy.History.KeepLast(5)
)


def header(frame: str) -> Header:
    seconds, rest = divmod(time.time_ns(), 1_000_000_000)
    return Header(Time(seconds, rest), frame)


def pose(place: np.ndarray) -> Pose:
    x, y, heading = place.tolist()
    return Pose(Point(x, y), Quaternion(z=math.sin(heading / 2), w=math.cos(heading / 2)))


def seen_from(start: np.ndarray, place: np.ndarray) -> np.ndarray:
    """A pose in the frame of another."""
    (east, north, turn), (cosine, sine) = place - start, (math.cos(start[2]), math.sin(start[2]))
    return np.array([cosine * east + sine * north, cosine * north - sine * east, turn])


class Robot:
    """Topics of one robot, and what it was told last."""

    def __init__(self, node: DomainParticipant, number: int, start: np.ndarray) -> None:
        def topic(name: str, kind: type) -> Topic:
            return Topic(node, f"rt/{name}", kind)

        self.told = DataReader(node, topic(f"robot{number}/cmd_vel", Twist), QUALITY)
        self.says = DataWriter(node, topic(f"robot{number}/odom", Odometry), QUALITY)
        self.seen = DataWriter(node, topic(f"body{number}/pose", PoseStamped), QUALITY)
        self.start = self.before = start
        self.targets, self.heard = np.zeros(2), -math.inf

    def hear(self, now: float) -> np.ndarray:
        """What it does now: forward speed [m/s] and turn rate [rad/s]."""
        for twist in self.told.take(50):
            if isinstance(twist, Twist):
                self.targets, self.heard = np.array([twist.linear.x, twist.angular.z]), now
        return self.targets if now - self.heard < SILENCE else np.zeros(2)

    def tell(self, place: np.ndarray, elapsed: float) -> None:
        """Say Odometry, by the way since the message before."""
        step = place - self.before
        along = step[0] * math.cos(place[2]) + step[1] * math.sin(place[2])
        turn = math.remainder(step[2], 2 * math.pi)
        twist = Twist(Vector3(x=along / elapsed), Vector3(z=turn / elapsed))
        at = PoseWithCovariance(pose(seen_from(self.start, place)))
        self.says.write(Odometry(header("odom"), "base_link", at, TwistWithCovariance(twist)))
        self.before = place


def main() -> None:
    world, domain = sys.argv[1], int(sys.argv[2])
    simulated = irsim.make(world, headless=True, log_level="ERROR", seed=1)
    step, bodies = simulated.step_time, simulated.robot_list
    node = DomainParticipant(domain)

    def places() -> np.ndarray:
        return np.array([body.state[:3, 0] for body in bodies])

    robots = [Robot(node, k + 1, place) for k, place in enumerate(places())]
    due, ticks = time.monotonic(), 0
    while True:
        time.sleep(max(due - time.monotonic(), 0.0))
        now, ticks = time.monotonic(), ticks + 1
        # A step that comes late is not made up for: robots would be faster than they are.
        due = max(due, now - step) + step
        actions = [robot.hear(now)[:, np.newaxis] for robot in robots]
        simulated.step(actions, list(range(len(robots))))
        found = places()
        for robot, place in zip(robots, found, strict=True):
            robot.seen.write(PoseStamped(header("world"), pose(place)))
            if ticks % ODOMETRY == 0:
                robot.tell(place, ODOMETRY * step)
        if ticks % LINES == 0:
            collided = any(bool(body.collision_flag) for body in bodies)
            line = {"time": now, "poses": found.tolist(), "collided": collided}
            print(json.dumps(line), flush=True)


main()
