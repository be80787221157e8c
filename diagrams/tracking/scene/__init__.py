"""What the tracking story looks like in Meshcat: the map, the robots, who sees whom, the clock."""

from .losing_layer import LosingSet
from .tracking_scene import TrackingScene
from .view import View

__all__ = ["LosingSet", "TrackingScene", "View"]
