"""Robots on ROS 2, by DDS and without ROS; a driver with Twist and Odometry stands in."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

from ..links.robot_link import RobotLink
from .robot_kind import Laboratory, RobotFleet, RobotKind, Surroundings

# Of ros2_control's differential drive (cmd_vel_timeout), unless it is set otherwise [s].
_SILENCE = 0.5


def _link(fleet: RobotFleet) -> RobotLink:
    from ..dds.dds_link import DdsLink

    return DdsLink(
        fleet.robots,
        fleet.addresses,
        chassis=fleet.chassis,
        domain=fleet.option("domain", 0),
        stamped=fleet.option("stamped", False),
        command=fleet.option("command", "cmd_vel"),
        odometry=fleet.option("odometry", "odom"),
        loopback=fleet.option("loopback", False),
    )


@contextmanager
def _stand_in(fleet: RobotFleet, around: Surroundings) -> Iterator[tuple[Laboratory, RobotFleet]]:
    from ..dds.driver import DdsWire, Driver

    stamped = fleet.option("stamped", False)
    # Of this process, among those that ROS leaves to others.
    domain = 110 + os.getpid() % 100
    names = [f"stand_in{robot}" for robot in fleet.robots]
    wire = DdsWire(names, domain, stamped=stamped)

    def make_driver(k: int) -> Driver:
        wire.renew(k)
        return Driver(around.silence, stamped=stamped)

    with around.laboratory(fleet.robots, make_driver, wire) as laboratory:
        yield (
            laboratory,
            replace(
                fleet,
                addresses=tuple(names),
                options={"domain": domain, "stamped": stamped, "loopback": True},
            ),
        )


DDS = RobotKind(
    name="dds",
    silence=_SILENCE,
    link=_link,
    stand_in=_stand_in,
    recognises=frozenset(),
    extra="dds",
    needs=("cyclonedds",),
)
