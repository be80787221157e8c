"""LeafSystems of the social story: making friends, reading their pictures, finding the evader."""

from .agent_interest import AgentInterest
from .crowd_guard import CrowdGuard
from .evader_locator import EvaderLocator
from .forward_cameras import ForwardCameras
from .image_scanner import ImageScanner
from .infrared_sensors import InfraredSensors
from .network_evolution import NetworkEvolution
from .picture_poster import PicturePoster
from .route_pursuer import RoutePursuer
from .wanderers import Wanderers

__all__ = [
    "AgentInterest",
    "CrowdGuard",
    "EvaderLocator",
    "ForwardCameras",
    "ImageScanner",
    "InfraredSensors",
    "NetworkEvolution",
    "PicturePoster",
    "RoutePursuer",
    "Wanderers",
]
