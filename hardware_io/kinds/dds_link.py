"""The work station's end of ROS 2: twists to robots, and their odometry."""

import math
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from ...systems.numerics.errors import require
from ...systems.numerics.station.motion_checks import Chassis
from ..links.link_record import OdometryCounts, RobotClock
from ..links.reporting_link import Order, ReportingLink, What
from ..links.robot_link import LinkError, RobotReport, RobotState
from .dds_node import (
    Header,
    Node,
    Odometry,
    Time,
    Twist,
    TwistStamped,
    Vector3,
    open_on_loopback,
    planar,
)

# How often the receiving thread looks whether the link was closed [s].
_LOOK = 0.1
# A robot that moves more slowly stands [m/s], [rad/s].
_STANDS = 0.01
# Tolerance beyond the distance that wheels can have driven; a larger step is a jump [m] (REP 105:
# the frame odom is continuous).
_JUMP = 0.1


@dataclass
class _Driven:
    """What is known of a robot: its wheel counts, its last order, and its last odometry.

    Of the odometry: its writer, its stamp by the robot's clock, and its pose. The order is None
    before the first arm or stop, and again after a reset.
    """

    writer: Any
    reader: Any
    counts: OdometryCounts
    last: What | None = None
    source: int | None = None
    stamp: tuple[int, int] = (-1, 0)
    pose: tuple[float, float, float] | None = None
    clock: RobotClock = field(default_factory=lambda: RobotClock(settable=True))


class DdsLink(ReportingLink):
    """Commands to robots on ROS 2 as Twist or TwistStamped, and their reports from Odometry.

    Such robots know neither arms nor stops: the link sends nothing but zeros before it is armed and
    after a stop, and a stop is acknowledged when odometry says that the robot stands. Encoder
    counts are computed from odometry and the chassis. A command whose deadline has passed is not
    sent. Odometry that jumps, or comes from a new writer, means that the driver was restarted: the
    robot gets zeros until it is armed. Anyone in the domain can drive the robots.

    Args:
        robots: Their numbers, in the order of the commands.
        names: Namespaces of each; empty: robot1, ... by the numbers.
        chassis: Wheels of the robots.
        domain: Number of the domain (ROS_DOMAIN_ID).
        stamped: Whether to send TwistStamped instead of Twist.
        command, odometry: Names of the topics below the namespaces.
        loopback: Whether to stay on this machine, for stand-in robots.

    Raises:
        InvalidInput: There is not one distinct name for each robot, or the domain is not 0 to 232.
    """

    def __init__(
        self,
        robots: Sequence[int],
        names: Sequence[str] = (),
        *,
        chassis: Chassis,
        domain: int = 0,
        stamped: bool = False,
        command: str = "cmd_vel",
        odometry: str = "odom",
        loopback: bool = False,
    ) -> None:
        super().__init__(robots)
        names = [each.strip("/") for each in names] or [f"robot{each}" for each in self.robots]
        fits = len(names) == len(self.robots) == len(set(names)) and all(names)
        require(fits, "radio.addresses", "be a namespace for each robot, or none", names)
        require(0 <= domain <= 232, "radio.options.domain", "be 0 to 232", domain)
        self._names, self._chassis, self._domain = names, chassis, domain
        self._stamped, self._command, self._odometry = stamped, command, odometry
        self._loopback, self._kept_open = loopback, None
        self._node: Node | None = None
        self._driven: dict[int, _Driven] = {}
        self._closing = threading.Event()
        self._thread: threading.Thread | None = None

    def connect(self) -> None:
        """Join the domain.

        Raises:
            LinkError: There is no network for it.
        """
        if self._loopback:
            self._kept_open = open_on_loopback(self._domain)
        node = self._node = Node(self._domain)
        kind = TwistStamped if self._stamped else Twist
        for robot, name in zip(self.robots, self._names, strict=True):
            self._driven[robot] = _Driven(
                node.writer(f"{name}/{self._command}", kind),
                node.reader(f"{name}/{self._odometry}", Odometry),
                OdometryCounts(self._chassis),
            )
        self._closing.clear()
        self._thread = threading.Thread(target=self._listen, args=(node,), daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Leave the domain."""
        self._closing.set()
        if self._thread is not None:
            self._thread.join()
            self._thread = None
        self._driven.clear()
        if self._node is not None:
            self._node.close()
            self._node = None
        self._kept_open = None

    def transmit(self, robot: int, order: Order) -> None:
        """See `ReportingLink`."""
        driven = self._driven.get(robot)
        if driven is None:
            raise LinkError("the link is not open: use it in a `with` statement")
        if order.what == What.HAIL:
            # Keep sending zeros after a stop; send none otherwise, so that others may drive.
            if driven.last != What.STOP:
                return
        elif order.what != What.COMMAND or driven.last is not None:
            driven.last = order.what
        if order.what == What.COMMAND and time.monotonic() > order.deadline:
            return
        follows = driven.last is not None
        speed, turn_rate = (order.speed, order.turn_rate) if follows else (0.0, 0.0)
        told = Twist(Vector3(x=float(speed)), Vector3(z=float(turn_rate)))
        if self._stamped:
            seconds, rest = divmod(time.time_ns(), 1_000_000_000)
            driven.writer.write(TwistStamped(Header(Time(seconds, rest), "base_link"), told))
        else:
            driven.writer.write(told)

    def _listen(self, node: Node) -> None:
        while not self._closing.is_set():
            node.wait(_LOOK)
            for robot, driven in self._driven.items():
                for odometry in node.take(driven.reader):
                    with self._changed:
                        self._take(robot, driven, odometry, node.source(odometry))

    def _take(self, robot: int, driven: _Driven, odometry: Any, source: int) -> None:
        stamp = (odometry.header.stamp.sec, odometry.header.stamp.nanosec)
        twist = odometry.twist.twist
        speed, rate = twist.linear.x, twist.angular.z
        at = odometry.pose.pose
        pose = planar(at.position, at.orientation)
        known = source == driven.source
        stale = known and stamp <= driven.stamp
        if stale or not all(map(math.isfinite, (*pose, speed, rate))):
            self.heard_nothing_of_use()
            return
        if driven.pose is not None and (not known or self._jumps(driven, stamp, pose)):
            driven.last = None
            driven.counts.begin_anew()
        if not known:
            driven.clock = RobotClock(settable=True)
        driven.source, driven.stamp, driven.pose = source, stamp, pose
        now = time.monotonic()
        late = driven.clock.late(now, stamp[0] + 1e-9 * stamp[1])
        counts = driven.counts.after(*pose)
        moves = max(abs(speed), abs(rate)) > _STANDS
        self.heard(
            robot,
            RobotReport(time=now - late, state=_state(driven.last, moves), counts=counts),
        )

    def _jumps(self, driven: _Driven, stamp: tuple[int, int], pose: tuple[float, ...]) -> bool:
        """Whether a pose is further from the last one than the wheels can have driven."""
        assert driven.pose is not None
        elapsed = stamp[0] - driven.stamp[0] + 1e-9 * (stamp[1] - driven.stamp[1])
        gone = math.dist(pose[:2], driven.pose[:2])
        return gone > 2 * self._chassis.top_speed * elapsed + _JUMP


def _state(last: What | None, moves: bool) -> RobotState:
    """State of a robot that reports none, from its last order and whether it moves."""
    if last is None:
        return RobotState.DISARMED
    if last == What.STOP and not moves:
        return RobotState.STOPPED
    return RobotState.DRIVING if moves else RobotState.IDLE
