"""The messages of ROS 2 that robots are driven by and report with, as DDS types.

Names are those that ROS gives them on DDS, as `geometry_msgs::msg::dds_::Twist_`; their bytes are
plain CDR, in the order of the fields.
"""

from dataclasses import dataclass, field

from cyclonedds.idl import IdlStruct
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
