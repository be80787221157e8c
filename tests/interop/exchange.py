"""Exchange messages with robots on other implementations of DDS: `make interop`.

Twists go out through the station's own node, and come back as Odometry, each number of which is
made of the twist's. Exit code 1 if one is not what it should be, or does not come.
"""

import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

from sightfield.hardware_io.kinds.dds_node import (
    LOOPBACK,
    Node,
    Odometry,
    Twist,
    Vector3,
    open_domain,
)

BUILT = Path(__file__).resolve().parents[2] / "build" / "interop"
PEERS = {"cyclone": "Cyclone DDS", "fast": "Fast DDS"}
DOMAIN, TWISTS, PATIENCE = 225, 300, 30.0


def right(told: Twist, said: Odometry) -> bool:
    """Whether an answer is made of a twist."""
    a, b = told.linear, told.angular
    at, turn = said.pose.pose.position, said.pose.pose.orientation
    steps = np.arange(36)
    return (
        (said.header.frame_id, said.child_frame_id, said.header.stamp.sec)
        == ("odom", "base_link", 7)
        and (at.x, at.y, at.z, turn.x, turn.y, turn.z, turn.w)
        == (a.x, a.y, a.z, b.x, b.y, b.z, 1.0)
        and said.twist.twist == told
        and np.array_equal(said.pose.covariance, a.x * steps)
        and np.array_equal(said.twist.covariance, b.z - steps)
    )


def exchange(node: Node, reader, writer) -> int:
    """How many of the twists were answered as they should be."""
    rng, answered = np.random.default_rng(1), 0
    for k in range(TWISTS):
        told = Twist(Vector3(*rng.normal(size=3).tolist()), Vector3(*rng.normal(size=3).tolist()))
        # Who is not yet there hears nothing: the first is said again and again.
        end = time.monotonic() + (PATIENCE if k == 0 else 1.0)
        said = []
        writer.write(told)
        while not any(right(told, each) for each in said) and time.monotonic() < end:
            if k == 0:
                writer.write(told)
            node.wait(0.1)
            said += node.take(reader)
        answered += any(right(told, each) for each in said)
        if k == 0 and not answered:
            return 0
    return answered


def main() -> int:
    domain = open_domain(DOMAIN, LOOPBACK)
    node, good = Node(DOMAIN), True
    reader, writer = node.reader("robot1/odom", Odometry), node.writer("robot1/cmd_vel", Twist)
    for name, title in PEERS.items():
        environment = {**os.environ, "CYCLONEDDS_URI": LOOPBACK}
        peer = subprocess.Popen([BUILT / name, str(DOMAIN)], env=environment)
        try:
            answered = exchange(node, reader, writer)
        finally:
            peer.kill()
            peer.wait()
        print(f"{title}: {answered} of {TWISTS} twists answered, every number as it should be")
        good = good and answered == TWISTS
    node.close()
    del domain
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
