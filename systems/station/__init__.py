"""LeafSystems between a controller and its robots: channels, receivers, gates, players."""

from .age_limit import AgeLimit
from .command_gate import CommandGate
from .command_timeout import CommandTimeout
from .floor_guard import FloorGuard
from .imperfect_channel import ImperfectChannel
from .infrared_reflex import InfraredReflex
from .motion_check import MotionCheck
from .picture_player import PicturePlayer
from .pose_gate import PoseGate
from .pose_parts import PoseParts
from .robot_supervisor import RobotSupervisor
from .sample_player import SamplePlayer
from .sampled_receiver import SampledReceiver
from .wheel_encoders import WheelEncoders

__all__ = [
    "AgeLimit",
    "CommandGate",
    "CommandTimeout",
    "FloorGuard",
    "ImperfectChannel",
    "InfraredReflex",
    "MotionCheck",
    "PicturePlayer",
    "PoseGate",
    "PoseParts",
    "RobotSupervisor",
    "SamplePlayer",
    "SampledReceiver",
    "WheelEncoders",
]
