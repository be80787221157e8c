"""LeafSystems of the social story: making friends, reading their pictures, finding the evader."""

from .common_robots import CrowdGuard, InfraredSensors, Wanderers
from .evader_locator import EvaderLocator
from .forward_cameras import ForwardCameras, PicturePoster
from .network_evolution import AgentInterest, ImageScanner, NetworkEvolution
from .route_pursuer import RoutePursuer

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
