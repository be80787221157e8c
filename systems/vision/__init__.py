"""LeafSystems of the vision story: cameras, and what estimates from their pictures."""

from .omni_camera import OmniCameraSensor
from .position_filter import PositionFilter
from .shared_estimate import SharedEstimate
from .shell_estimator import ShellEstimator

__all__ = [
    "OmniCameraSensor",
    "PositionFilter",
    "SharedEstimate",
    "ShellEstimator",
]
