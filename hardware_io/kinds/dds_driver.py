"""Stand-in for the driver of a robot on ROS 2, and the wire that carries its messages."""

import math
from typing import Any, Self

from ..emulation.stand_in_laboratory import Sensed
from .dds_node import (
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
    TwistStamped,
    TwistWithCovariance,
    Vector3,
    open_domain,
)

# Time between two messages of odometry [s].
_PERIOD = 0.05
# How plain little-endian CDR begins.
_CDR = bytes([0, 1, 0, 0])


class Driver:
    """A differential drive like ros2_control's: it follows every twist, and stops in silence.

    Args:
        silence: Silence after which it stops by itself [s].
        stamped: Whether it expects TwistStamped.
    """

    def __init__(self, silence: float, *, stamped: bool) -> None:
        self._silence, self._kind = silence, TwistStamped if stamped else Twist
        self._told, self._due = -math.inf, 0.0
        self._targets = (0.0, 0.0)

    def take(self, payload: bytes, now: float) -> None:
        """Take a message.

        Args:
            payload: In CDR.
            now: The time [s].
        """
        message = _read(self._kind, payload)
        if message is None:
            return
        twist = message if isinstance(message, Twist) else message.twist
        targets = (twist.linear.x, twist.angular.z)
        if all(map(math.isfinite, targets)):
            self._targets, self._told = targets, now

    def targets(self, now: float) -> tuple[float, float] | None:
        """Forward speed [m/s] and turn rate [rad/s]; None: the motors are cut.

        Args:
            now: The time [s].
        """
        return self._targets if now - self._told < self._silence else None

    def reports(self, now: float, sensed: Sensed) -> list[bytes]:
        """Odometry, twenty times a second.

        Args:
            now: The time [s].
            sensed: By its sensors.
        """
        if now < self._due:
            return []
        self._due = now + _PERIOD
        x, y, heading = sensed.odometry
        left, right = sensed.speeds
        turn = Quaternion(z=math.sin(heading / 2), w=math.cos(heading / 2))
        # Its wheels are 0.16 m apart.
        twist = Twist(Vector3(x=(left + right) / 2), Vector3(z=(right - left) / 0.16))
        odometry = Odometry(
            Header(Time(int(now), int(now % 1 * 1e9)), "odom"),
            "base_link",
            PoseWithCovariance(Pose(Point(x, y), turn)),
            TwistWithCovariance(twist),
        )
        return [odometry.serialize()]


class DdsWire:
    """Topics of robots that stand in, on a domain that stays on this machine.

    Args:
        names: Namespaces of the robots.
        domain: Number of the domain.
        stamped: Whether the robots expect TwistStamped.
    """

    def __init__(self, names: list[str], domain: int, *, stamped: bool) -> None:
        self._names, self._domain_number = names, domain
        self._kind = TwistStamped if stamped else Twist
        self._domain: Any = None
        self._node: Node | None = None
        self._readers: list[Any] = []
        self._writers: list[Any] = []

    def __enter__(self) -> Self:
        self._domain = open_domain(self._domain_number, LOOPBACK)
        node = self._node = Node(self._domain_number)
        self._readers = [node.reader(f"{name}/cmd_vel", self._kind) for name in self._names]
        self._writers = [node.writer(f"{name}/odom", Odometry) for name in self._names]
        return self

    def __exit__(self, *_: object) -> None:
        self._readers, self._writers = [], []
        if self._node is not None:
            self._node.close()
        self._node = self._domain = None

    def renew(self, k: int) -> None:
        """Let a robot's odometry come from a new writer, as after a reset.

        Args:
            k: Number of the robot.
        """
        if self._node is not None:
            self._writers[k] = self._node.writer(f"{self._names[k]}/odom", Odometry)

    def receive(self) -> list[tuple[int, bytes]]:
        """See `Wire`."""
        assert self._node is not None
        return [
            (k, message.serialize())
            for k, reader in enumerate(self._readers)
            for message in self._node.take(reader)
        ]

    def send(self, k: int, payload: bytes) -> None:
        """See `Wire`; a payload that is no valid message is not sent.

        Args:
            k: Number of the robot.
            payload: In CDR.
        """
        odometry = _read(Odometry, payload)
        if odometry is not None:
            self._writers[k].write(odometry)


def _read(kind: Any, payload: bytes) -> Any:
    """Decode a message from plain CDR; None if it is invalid."""
    if payload[:4] != _CDR:
        return None
    try:
        return kind.deserialize(payload)
    except Exception:
        # Whatever the package raises for bytes that are no message.
        return None
