"""A participant of a DDS domain, and the messages of ROS 2 that it sends and takes.

Types have the names that ROS uses on DDS, as `geometry_msgs::msg::dds_::Twist_`; messages are
encoded in plain CDR, in the order of the fields. Since Iron, ROS announces a hash of each type with
its topics (REP 2011, RIHS01).
"""

import math
from dataclasses import dataclass, field
from typing import Any

from cyclonedds.core import (
    DDSException,
    InstanceState,
    Qos,
    ReadCondition,
    SampleState,
    ViewState,
    WaitSet,
)
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl import types as idl
from cyclonedds.idl.annotations import final
from cyclonedds.idl.types import array, float64, int32, uint32
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from ..links.robot_link import LinkError
from .plain_cdr import plainly_encoded


def _zeros() -> list[float]:
    return [0.0] * 36


@dataclass
@final
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    """A time: seconds since 1970 [s], and nanoseconds [ns]."""

    sec: int32 = 0  # [s]
    nanosec: uint32 = 0  # [ns]


@dataclass
@final
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    """Time stamp and frame, `frame_id`, of a message."""

    stamp: Time = field(default_factory=Time)
    frame_id: str = ""


@dataclass
@final
class Vector3(IdlStruct, typename="geometry_msgs::msg::dds_::Vector3_"):
    """Three numbers, x, y, z: speeds [m/s] or turn rates [rad/s]."""

    x: float64 = 0.0
    y: float64 = 0.0
    z: float64 = 0.0


@dataclass
@final
class Point(IdlStruct, typename="geometry_msgs::msg::dds_::Point_"):
    """A place, x, y, z [m]."""

    x: float64 = 0.0
    y: float64 = 0.0
    z: float64 = 0.0


@dataclass
@final
class Quaternion(IdlStruct, typename="geometry_msgs::msg::dds_::Quaternion_"):
    """An orientation, x, y, z, w."""

    x: float64 = 0.0
    y: float64 = 0.0
    z: float64 = 0.0
    w: float64 = 1.0


@plainly_encoded
@dataclass
@final
class Twist(IdlStruct, typename="geometry_msgs::msg::dds_::Twist_"):
    """Speeds and turn rates: `linear.x` forward, `angular.z` to the left."""

    linear: Vector3 = field(default_factory=Vector3)
    angular: Vector3 = field(default_factory=Vector3)


@plainly_encoded
@dataclass
@final
class TwistStamped(IdlStruct, typename="geometry_msgs::msg::dds_::TwistStamped_"):
    """A twist with a header; newer robots expect this type."""

    header: Header = field(default_factory=Header)
    twist: Twist = field(default_factory=Twist)


@dataclass
@final
class Pose(IdlStruct, typename="geometry_msgs::msg::dds_::Pose_"):
    """Place and orientation."""

    position: Point = field(default_factory=Point)
    orientation: Quaternion = field(default_factory=Quaternion)


@dataclass
@final
class PoseWithCovariance(IdlStruct, typename="geometry_msgs::msg::dds_::PoseWithCovariance_"):
    """A pose, and its covariance row by row."""

    pose: Pose = field(default_factory=Pose)
    # The type says how many there are; the values are a list.
    covariance: array[float64, 36] = field(default_factory=_zeros)  # pyright: ignore[reportAssignmentType]


@dataclass
@final
class TwistWithCovariance(IdlStruct, typename="geometry_msgs::msg::dds_::TwistWithCovariance_"):
    """A twist, and its covariance row by row."""

    twist: Twist = field(default_factory=Twist)
    # The type says how many there are; the values are a list.
    covariance: array[float64, 36] = field(default_factory=_zeros)  # pyright: ignore[reportAssignmentType]


@plainly_encoded
@dataclass
@final
class Odometry(IdlStruct, typename="nav_msgs::msg::dds_::Odometry_"):
    """Pose and twist of a robot, `child_frame_id`, from wheel odometry."""

    header: Header = field(default_factory=Header)
    child_frame_id: str = ""
    pose: PoseWithCovariance = field(default_factory=PoseWithCovariance)
    twist: TwistWithCovariance = field(default_factory=TwistWithCovariance)


@plainly_encoded
@dataclass
@final
class PoseStamped(IdlStruct, typename="geometry_msgs::msg::dds_::PoseStamped_"):
    """A pose with its time and frame."""

    header: Header = field(default_factory=Header)
    pose: Pose = field(default_factory=Pose)


@dataclass
@final
class Transform(IdlStruct, typename="geometry_msgs::msg::dds_::Transform_"):
    """Position and orientation of one frame in another."""

    translation: Vector3 = field(default_factory=Vector3)
    rotation: Quaternion = field(default_factory=Quaternion)


@dataclass
@final
class TransformStamped(IdlStruct, typename="geometry_msgs::msg::dds_::TransformStamped_"):
    """Transform of the frame `child_frame_id` in that of the header, with its time."""

    header: Header = field(default_factory=Header)
    child_frame_id: str = ""
    transform: Transform = field(default_factory=Transform)


@dataclass
@final
class TFMessage(IdlStruct, typename="tf2_msgs::msg::dds_::TFMessage_"):
    """Transforms of frames, as on the topic tf."""

    # The type says what is in it; the values are a list.
    transforms: idl.sequence[TransformStamped] = field(default_factory=list)  # pyright: ignore[reportAssignmentType]


# Hashes of the types used as topics, as ROS computes them from the type definitions.
TYPE_HASHES = {
    Twist: "RIHS01_9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a",
    TwistStamped: "RIHS01_5f0fcd4f81d5d06ad9b4c4c63e3ea51b82d6ae4d0558f1d475229b1121db6f64",
    Odometry: "RIHS01_3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0",
    PoseStamped: "RIHS01_10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8",
    TFMessage: "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087",
}


def planar(place: Point | Vector3, turn: Quaternion) -> tuple[float, float, float]:
    """x, y [m] and heading [rad] of a pose; NaN if the quaternion's length is not about one.

    Args:
        place: Position [m].
        turn: Orientation, a quaternion whose length is one to within a tenth.
    """
    # hypot: squaring 1e200 would raise an error.
    length = math.hypot(turn.x, turn.y, turn.z, turn.w)
    if not 0.9 < length < 1.1:
        return (math.nan, math.nan, math.nan)
    sine = 2 * (turn.w * turn.z + turn.x * turn.y)
    heading = math.atan2(sine, length**2 - 2 * (turn.y**2 + turn.z**2))
    return (place.x, place.y, heading)


# How long a slow reader may block a writer [ms].
_BLOCKED = 5
# Depth of a reader's history, and the most messages taken at once.
_TAKEN = 50
# Configuration that keeps traffic on this machine; without it Cyclone uses the real networks.
LOOPBACK = (
    '<CycloneDDS><Domain id="any"><General><Interfaces><NetworkInterface name="lo"/></Interfaces>'
    "<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto"
    '</ParticipantIndex><Peers><Peer address="127.0.0.1"/></Peers></Discovery></Domain>'
    "</CycloneDDS>"
)
_PLAIN_CDR = Policy.DataRepresentation(use_cdrv0_representation=True)
# A reliable writer matches readers of either reliability, and a volatile best-effort reader matches
# every writer. Commands are volatile, so that a reader that joins late does not follow an old one;
# a reader that asks for old messages (transient local) does not match, and gets none at all.
_WRITER = Qos(
    Policy.Reliability.Reliable(duration(milliseconds=_BLOCKED)),
    Policy.Durability.Volatile,
    Policy.History.KeepLast(1),
    _PLAIN_CDR,
)
_READER = Qos(
    Policy.Reliability.BestEffort,
    Policy.Durability.Volatile,
    Policy.History.KeepLast(_TAKEN),
    _PLAIN_CDR,
)
_ANY = SampleState.Any | ViewState.Any | InstanceState.Any


def open_domain(number: int, configuration: str) -> Any:
    """Open a domain with its own configuration in this process; the caller must keep the result.

    Args:
        number: Number of the domain, 0 to 232.
        configuration: Cyclone's configuration, in XML.
    """
    return Domain(number, configuration)


def open_on_loopback(number: int) -> Any:
    """Open a domain that stays on this machine; the caller must keep the result.

    If this process has the domain open already, that one stays as it is, and None is returned.

    Args:
        number: Number of the domain, 0 to 232.
    """
    try:
        return open_domain(number, LOOPBACK)
    except DDSException:
        return None


class Node:
    """Topics of a domain, by the names that ROS gives them there.

    Args:
        domain: Its number (ROS_DOMAIN_ID), 0 to 232.

    Raises:
        LinkError: There is no network for it.
    """

    def __init__(self, domain: int) -> None:
        try:
            self._participant: Any = DomainParticipant(domain)
            self._waiting: Any = WaitSet(self._participant)
        except DDSException as error:
            raise LinkError(f"no DDS domain {domain}: {error.msg}") from None
        self._readers: list[tuple[Any, Any]] = []

    def writer(self, topic: str, kind: type) -> Any:
        """Make a writer of a topic.

        Args:
            topic: Name as in ROS: robot1/cmd_vel.
            kind: Type of its messages, one of `TYPE_HASHES`.
        """
        found = Topic(self._participant, f"rt/{topic}", kind)
        return DataWriter(self._participant, found, _told(_WRITER, kind))

    def reader(self, topic: str, kind: type) -> Any:
        """Make a reader of a topic; its messages wake `wait`.

        Args:
            topic: Name as in ROS: robot1/odom.
            kind: Type of its messages, one of `TYPE_HASHES`.
        """
        found = Topic(self._participant, f"rt/{topic}", kind)
        reader = DataReader(self._participant, found, _told(_READER, kind))
        condition = ReadCondition(reader, _ANY)
        self._waiting.attach(condition)
        self._readers.append((reader, condition))
        return reader

    def wait(self, patience: float) -> None:
        """Wait until a reader has something.

        Args:
            patience: How long at most [s].
        """
        self._waiting.wait(duration(milliseconds=round(1000 * patience)))

    def take(self, reader: Any) -> list[Any]:
        """Take the messages that have come, without waiting.

        Notices that a writer has ended, and messages with text that is not UTF-8, are left out.

        Args:
            reader: Reader to take them from.
        """
        found = []
        for _ in range(_TAKEN):
            try:
                taken = reader.take(1)
            except UnicodeDecodeError:
                continue
            if not taken:
                break
            found += [each for each in taken if isinstance(each, IdlStruct)]
        return found

    @staticmethod
    def source(message: Any) -> int:
        """Return the handle of the writer that sent a message; it changes if the writer restarts.

        Args:
            message: From `take`.
        """
        return message.sample_info.publication_handle

    def close(self) -> None:
        """Leave the domain."""
        self._readers.clear()
        self._waiting = self._participant = None


def _told(qos: Qos, kind: type) -> Qos:
    """Add the type's hash to a quality of service, as ROS announces it."""
    return qos + Qos(Policy.Userdata(f"typehash={TYPE_HASHES[kind]};".encode()))
