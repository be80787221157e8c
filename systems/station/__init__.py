"""LeafSystems between a controller and its robots: channels, receivers, gates, players."""

from .age_limit import AgeLimit
from .command_gate import CommandGate
from .command_timeout import CommandTimeout
from .imperfect_channel import ImperfectChannel
from .picture_player import PicturePlayer
from .pose_parts import PoseParts
from .sample_player import SamplePlayer
from .sampled_receiver import SampledReceiver

__all__ = [
    "AgeLimit",
    "CommandGate",
    "CommandTimeout",
    "ImperfectChannel",
    "PicturePlayer",
    "PoseParts",
    "SamplePlayer",
    "SampledReceiver",
]
