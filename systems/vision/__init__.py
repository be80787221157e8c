"""LeafSystems of the vision story: cameras, and what estimates from their pictures."""

from .evader_tracker import EvaderTracker
from .omni_camera import OmniCameraSensor
from .shell_estimator import ShellEstimator

__all__ = [
    "EvaderTracker",
    "OmniCameraSensor",
    "ShellEstimator",
]
