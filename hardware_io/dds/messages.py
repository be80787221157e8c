"""The messages of ROS 2 that robots are driven by and report with, as DDS types.

Names are those that ROS gives them on DDS, as `geometry_msgs::msg::dds_::Twist_`; their bytes are
plain CDR, in the order of the fields. From Iron on ROS tells a hash of each type beside its topics
(REP 2011, RIHS01).
"""

import math
from dataclasses import dataclass, field

from cyclonedds.idl import IdlStruct
from cyclonedds.idl import types as idl
from cyclonedds.idl.annotations import final
from cyclonedds.idl.types import array, float64, int32, uint32


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
    """When something was, and in which frame, `frame_id`."""

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


@dataclass
@final
class Twist(IdlStruct, typename="geometry_msgs::msg::dds_::Twist_"):
    """Speeds and turn rates: `linear.x` forward, `angular.z` to the left."""

    linear: Vector3 = field(default_factory=Vector3)
    angular: Vector3 = field(default_factory=Vector3)


@dataclass
@final
class TwistStamped(IdlStruct, typename="geometry_msgs::msg::dds_::TwistStamped_"):
    """A twist, and when it was told; newer robots want it."""

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


@dataclass
@final
class Odometry(IdlStruct, typename="nav_msgs::msg::dds_::Odometry_"):
    """Where a robot, `child_frame_id`, is by its wheels, and how it moves."""

    header: Header = field(default_factory=Header)
    child_frame_id: str = ""
    pose: PoseWithCovariance = field(default_factory=PoseWithCovariance)
    twist: TwistWithCovariance = field(default_factory=TwistWithCovariance)


@dataclass
@final
class PoseStamped(IdlStruct, typename="geometry_msgs::msg::dds_::PoseStamped_"):
    """A pose, when it was, and in which frame."""

    header: Header = field(default_factory=Header)
    pose: Pose = field(default_factory=Pose)


@dataclass
@final
class Transform(IdlStruct, typename="geometry_msgs::msg::dds_::Transform_"):
    """Where a frame lies in another, and how it is turned."""

    translation: Vector3 = field(default_factory=Vector3)
    rotation: Quaternion = field(default_factory=Quaternion)


@dataclass
@final
class TransformStamped(IdlStruct, typename="geometry_msgs::msg::dds_::TransformStamped_"):
    """Where the frame `child_frame_id` lay in that of the header, and when."""

    header: Header = field(default_factory=Header)
    child_frame_id: str = ""
    transform: Transform = field(default_factory=Transform)


@dataclass
@final
class TFMessage(IdlStruct, typename="tf2_msgs::msg::dds_::TFMessage_"):
    """Where frames lie, as on the topic tf."""

    # The type says what is in it; the values are a list.
    transforms: idl.sequence[TransformStamped] = field(default_factory=list)  # pyright: ignore[reportAssignmentType]


# Of the types that are topics, as ROS computes them of their definitions.
TYPE_HASHES = {
    Twist: "RIHS01_9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a",
    TwistStamped: "RIHS01_5f0fcd4f81d5d06ad9b4c4c63e3ea51b82d6ae4d0558f1d475229b1121db6f64",
    Odometry: "RIHS01_3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0",
    PoseStamped: "RIHS01_10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8",
    TFMessage: "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087",
}


def planar(place: Point | Vector3, turn: Quaternion) -> tuple[float, float, float]:
    """x, y [m] and heading [rad] of a pose; not a number where its orientation is none.

    Args:
        place: Where it is [m].
        turn: Its orientation, a quaternion whose length is one to within a tenth.
    """
    length = math.sqrt(turn.x**2 + turn.y**2 + turn.z**2 + turn.w**2)
    if not 0.9 < length < 1.1:
        return (math.nan, math.nan, math.nan)
    sine = 2 * (turn.w * turn.z + turn.x * turn.y)
    heading = math.atan2(sine, length**2 - 2 * (turn.y**2 + turn.z**2))
    return (place.x, place.y, heading)
