"""LeafSystems between a controller and its robots: channels, receivers, gates, players."""

from .gates import AgeLimit, CommandGate, InfraredReflex, PoseParts
from .stand_in_devices import (
    CommandTimeout,
    ImperfectChannel,
    PicturePlayer,
    SampledReceiver,
    SamplePlayer,
    WheelEncoders,
)
from .supervision import FloorGuard, MotionCheck, PoseGate, RobotSupervisor

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
