"""Poses from topics of ROS 2: each message, and those that count for nothing."""

import sys
import time

import numpy as np
import pytest

from sightfield.diagrams.station import hardware
from sightfield.diagrams.station.scenario import Mocap
from sightfield.hardware_io.kinds.dds_node import (
    LOOPBACK,
    Header,
    Node,
    Odometry,
    Point,
    Pose,
    PoseStamped,
    PoseWithCovariance,
    Quaternion,
    TFMessage,
    Time,
    Transform,
    TransformStamped,
    Vector3,
    open_domain,
)
from sightfield.hardware_io.mocap.ros_poses import RosPoses
from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.station.ros_topics import USUAL_TOPICS

DOMAIN = 223


@pytest.fixture(scope="module")
def node():
    domain = open_domain(DOMAIN, LOOPBACK)
    node = Node(DOMAIN)
    yield node
    node.close()
    del domain


def message_of(message, pose, number, frame="world", body="evader0"):
    """A message about a body, with the number as its stamp."""
    x, y, heading = pose
    header = Header(Time(7, number), frame)
    turn = Quaternion(z=np.sin(heading / 2), w=np.cos(heading / 2))
    if message == "tf":
        lies = Transform(Vector3(x, y, 0.5), turn)
        others = TransformStamped(header, "lamp", Transform(Vector3(9.0, 9.0)))
        return TFMessage([others, TransformStamped(header, f"/{body}", lies)])
    pose = Pose(Point(x, y, 0.5), turn)
    if message == "Odometry":
        return Odometry(header, "base", PoseWithCovariance(pose))
    return PoseStamped(header, pose)


@pytest.mark.parametrize("message", USUAL_TOPICS)
def test_poses_come_with_each_message(node, message):
    """By the scenario; the second body is seen, the first never."""
    topic = {"PoseStamped": "/lab/{body}/pose", "Odometry": "", "tf": ""}[message]
    mocap = Mocap(source="ros2", message=message, topic=topic, domain=DOMAIN)
    source = hardware.open_poses(mocap, ["pursuer0", "evader0"])
    kind = {"PoseStamped": PoseStamped, "Odometry": Odometry, "tf": TFMessage}[message]
    name = {"PoseStamped": "lab/evader0/pose", "Odometry": "evader0/odom", "tf": "tf"}[message]
    writer = node.writer(name, kind)
    end, number = time.monotonic() + 10, 1
    while np.isinf(source.read().stamps[1]) and time.monotonic() < end:
        writer.write(message_of(message, (1.25, -2.5, 2.5), number))
        number += 1
        time.sleep(0.01)
    reading = source.read()
    source.close()
    np.testing.assert_allclose(reading.poses, [[0, 0, 0], [1.25, -2.5, 2.5]])
    assert np.isinf(reading.stamps[0])
    assert 0 <= time.monotonic() - reading.stamps[1] < 5


def test_what_is_old_in_another_frame_or_no_number_does_not_count():
    source = RosPoses(["evader0"], domain=DOMAIN)

    def told(number, x, frame="world"):
        at = message_of("PoseStamped", (x, 0.0, 0.0), number, frame)
        source._take("evader0", at.header, (x, 0.0, 0.0), float(number))
        return float(source.read().poses[0, 0])

    assert told(5, 1.0) == 1.0
    assert told(5, 2.0) == told(4, 2.0) == told(6, 2.0, "odom") == told(7, np.nan) == 1.0
    assert told(8, 2.0, "/world") == 2.0
    source.close()


def test_what_is_not_there_is_refused():
    with pytest.raises(InvalidInput, match=r"`message` must be one of"):
        RosPoses(["a"], message="Pose")
    with pytest.raises(InvalidInput, match=r"`topic` must have \{body\} in it; got poses"):
        RosPoses(["a"], topic="poses")
    with pytest.raises(InvalidInput, match=r"`topic` must have no \{body\}"):
        RosPoses(["a"], message="tf", topic="{body}/tf")
    with pytest.raises(InvalidInput, match=r"`domain` must be 0 to 232; got 233"):
        RosPoses(["a"], domain=233)


def test_without_the_extra_one_line_names_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "cyclonedds", None)
    with pytest.raises(InvalidInput, match=r"`mocap.source` ros2 must come with the extra \[dds\]"):
        hardware.open_poses(Mocap(source="ros2"), ["a"])
